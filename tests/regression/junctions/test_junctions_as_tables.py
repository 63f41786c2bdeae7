"""A flyback converter whose junctions are tables of current and charge: nothing in it is smooth.

It was given to the steps as smooth, and later refused: voltages of 3e-10 V that rounding had left
between parts of the charge drove 1e-11 A through the table of a current of microamperes.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsspice

#: V, A and V, C: clamp and output
CLAMP_CURRENT = "-900,-1e-09, 0,0, 0.637950984,0.002, 0.78981922,0.0632455532, 0.941687476,2"
CLAMP_CHARGE = (
    "-450,-2.42841134e-09, -253.125,-1.7929559e-09, -112.5,-1.15843662e-09, "
    "-28.125,-5.27611069e-10, 0,0, 0.637950984,1.9766011e-10, 0.78981922,4.80671931e-09, "
    "0.941687476,1.50080903e-07"
)
CURRENT = "-80,-5e-06, 0,0, 0.206440146,0.01, 0.300227982,0.316227766, 0.394028549,10"
CHARGE = (
    "-40,-5.40275424e-09, -22.5,-3.72755958e-09, -10,-2.17226349e-09, -2.5,-8.04231688e-10, 0,0, "
    "0.206440146,1.13958071e-10, 0.300227982,1.76238863e-10, 0.394028549,2.47741457e-10"
)
DECK = f"""junctions as tables
Vin in 0 100
Llk in p1 10u
Lp p1 sw 500u
Ls 0 s1 7.2u
K1 Lp Ls 1
S1 sw 0 g 0 SM
Coss sw 0 150p
.model SM SW(VT=2 VH=0.5 RON=0.3 ROFF=1e7)
Vg g 0 PULSE(0 5 0 50n 50n 0.7u 15.385u)
Rjcls sw clx 0.05
Bjcl clx cl I={{table(v(clx,cl), {CLAMP_CURRENT})}}
Cjcl clx cl Q={{table(x, {CLAMP_CHARGE})}}
Ccl cl in 10n
Rcl cl in 22k
Rjouts s1 outx 0.01
Bjout outx out I={{table(v(outx,out), {CURRENT})}}
Cjout outx out Q={{table(x, {CHARGE})}}
Co out 0 470u Rser=20m
RL out 0 6
.tran 5n 1u
"""
SIGNALS = ("v(out)", "v(sw)", "i(llk)", "v(s1)", "v(cl)")
#: the control passes 2.5 V and 1.5 V [s]
ON, OFF = 25e-9, 785e-9
#: measured by the ranges of the signals; at 1e-8 the integration differs by 2e-5 from itself
RTOL, AGREES = 1e-9, 1e-5


def _line(text: str) -> np.ndarray:
    return np.array(text.split(","), dtype=float).reshape(-1, 2).T


def _reference(times: np.ndarray) -> dict[str, np.ndarray]:
    """Integrate the seven states: currents, voltages and the two charges of the junctions."""
    (i1, q1), (i2, q2) = map(_line, (CLAMP_CURRENT, CLAMP_CHARGE)), map(_line, (CURRENT, CHARGE))
    ratio, load, series = 0.12, 6.0, 0.02

    def signals(state: np.ndarray) -> tuple[np.ndarray, ...]:
        primary, core, _, _, _, charge, v = state
        secondary = (core - primary) / ratio
        out = (v + series * secondary) / (1.0 + series / load)
        across = np.interp(charge, q2[1], q2[0])
        return secondary, out, across, out + across + 0.01 * secondary

    def rates(_: float, state: np.ndarray, conductance: float) -> list[float]:
        primary, _, sw, charge, cl, *_ = state
        secondary, out, across, winding = signals(state)
        clamp = np.interp(charge, q1[1], q1[0])
        into = (sw - cl - clamp) / 0.05
        lp = -winding / ratio
        return [
            (100.0 - sw - lp) / 10e-6,
            lp / 500e-6,
            (primary - into - conductance * sw) / 150e-12,
            into - np.interp(clamp, *i1),
            (into - (cl - 100.0) / 22e3) / 10e-9,
            secondary - np.interp(across, *i2),
            (secondary - out / load) / 470e-6,
        ]

    state, begin = np.array([1e-5, 1e-5, 100.0, 0.0, 100.0, 0.0, 0.0]), 0.0
    sizes, found = np.array([1.0, 1.0, 200.0, 2e-9, 50.0, 2e-9, 1e-3]), []
    for end, siemens in ((ON, 1e-7), (OFF, 1.0 / 0.3), (times[-1], 1e-7)):
        rows = times[(times > begin) & (times <= end)]
        part = solve_ivp(
            rates, (begin, end), state, "LSODA", np.unique([*rows, end]),
            args=(siemens,), rtol=RTOL, atol=RTOL * sizes, max_step=2e-9,
        )  # fmt: skip
        found.append(part.y[:, : len(rows)])
        state, begin = part.y[:, -1], end
    states = np.hstack(found)
    _, out, _, winding = signals(states)
    return dict(zip(SIGNALS, (out, states[2], states[0], winding, states[4]), strict=True))


def test_tables_of_junctions_are_exact() -> None:
    """Both junctions pass their knots forwards and backwards."""
    circuit = nsspice.read(DECK)
    run = nsspice.tran(circuit, signals=SIGNALS)
    assert run.certificate.passed
    assert run.stats["mode_changes"] > 50
    assert run.stats["fixed_steps"] == 0
    after = run.time > 0.0
    for name, expected in _reference(run.time[after]).items():
        assert run[name][after] == pytest.approx(expected, abs=AGREES * np.ptp(expected)), name
