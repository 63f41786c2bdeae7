"""Short steps in circuits a part of which is tied to ground by little.

In a step of 1 ns the capacitor of 470 uF is E/h = 4.7e5 S, the resistor that ties it to
ground 1 uS: one rounding of the 1e8 A in the equations of the former would move it by volts.
Exactly it stays at zero: no current can flow through the tie, for it would have to come back.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

FLOATING = """Rectifier of which nothing but the output capacitor is alive
Vac ac 0 SIN(0 325 50)
D1 ac r
D2 0 r
D3 m ac
D4 m 0
L1 r sw 2m
S1 sw m 0 0 open
D5 sw out
C1 out m 470u IC=400
R1 out m 400
Rg m 0 1meg
.model open SW(VT=1)
.tran {row} {stop} uic
"""
# the current of R1 is 1 A: what rounding of it is in the tie, a thousand times
BOUND = 1e3 * np.finfo(float).eps * 1.0 * 1e6


def decay(t: np.ndarray) -> np.ndarray:
    return 400.0 * np.exp(-t / (400.0 * 470e-6))


@pytest.mark.parametrize("step", [1e-6, 1e-7, 1e-8, 1e-9])
def test_a_shorter_step_is_not_worse(step: float) -> None:
    stop = 1e3 * step
    circuit = nsspice.read(FLOATING.format(row=step, stop=stop))
    run = nsspice.tran(circuit, method="moreau", step=step)
    later = run.time > 3.5 * step  # the start is a limit of steps that are shorter still
    assert np.abs(run["v(m)"][later]).max() < BOUND
    # one Euler step errs by (h / RC)^2 / 2, which adds up over time
    error = np.abs(run["v(out)"] - run["v(m)"] - decay(run.time))[later]
    assert error.max() < 400.0 * (step / 0.188) * (stop / 0.188) + BOUND


@pytest.mark.parametrize("stop", [100e-6, 1.2e-3, 2e-3])
def test_error_control_does_not_chase_rounding(stop: float) -> None:
    circuit = nsspice.read(FLOATING.format(row=stop / 50, stop=stop))
    run = nsspice.tran(circuit, method="sdirk")
    stats = run.islands[0].stats
    assert stats["steps"] < 150
    assert stats["forced"] == 0
    assert stats["rejected"] == 0
    later = run.time > 0.0
    assert np.abs(run["v(m)"][later]).max() < BOUND
    gap = np.abs(run["v(out)"] - run["v(m)"] - decay(run.time))
    assert gap.max() < 1e-5 * 400.0  # reltol
