"""Tables of a flux with flat ends: slopes that are alike but for rounding make no kink.

The slopes of 10 mWb over 49 A on both sides of the steep part differ by 2.5e-18 H; a layer of that
inductance commuted ahead of time, and the current came to 38 A where 30 V drive 1 Ohm.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

AMPLITUDE, OMEGA = 30.0, 2.0 * np.pi * 50.0


def deck(end: float) -> str:
    table = f"-{end:g},-0.06, -1,-0.05, 0,0, 1,0.05, {end:g},0.06"
    return (
        "saturating inductor\nV1 a 0 SIN(0 30 50)\nR1 a b 1\n"
        f"L1 b 0 Flux={{table(x, {table})}}\n.tran 50u 40m uic\n"
    )


def by_euler(end: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return instants and currents of implicit Euler steps: flux(i) + step i is a rising line."""
    x = np.array([-end - 1e3, -end, -1.0, 0.0, 1.0, end, end + 1e3])
    flux = np.array([-0.06, -0.06, -0.05, 0.0, 0.05, 0.06, 0.06])
    time = step * np.arange(1, round(40e-3 / step) + 1)
    voltages, rising, now, currents = AMPLITUDE * np.sin(OMEGA * time), flux + step * x, 0.0, []
    for voltage in voltages:
        current = float(np.interp(now + step * voltage, rising, x))
        now += step * (voltage - current)
        currents.append(current)
    return time, np.array(currents)


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
@pytest.mark.parametrize("end", [10.0, 50.0])
def test_the_current_is_that_of_small_steps(end: float, method: str) -> None:
    run = nsspice.tran(nsspice.read(deck(end)), method=method)
    assert run.certificate.passed
    current = run["i(l1)"]
    assert np.abs(current).max() <= AMPLITUDE * (
        1.0 + 1e-9
    )  # the inductor stores and gives nothing
    # of first order: what is left of two steps is twice and once the error of the finer one
    errors = []
    for step in (4e-6, 2e-6):
        time, euler = by_euler(end, step)
        errors.append(
            np.abs(np.interp(run.time, np.append(0.0, time), np.append(0.0, euler)) - current).max()
        )
    assert errors[1] < 0.6 * errors[0]
    assert errors[1] < 0.02 * AMPLITUDE
