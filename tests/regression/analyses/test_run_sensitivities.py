"""Exact derivatives of measures of transients: closed forms, and central differences."""

from __future__ import annotations

import math

import pytest

import nsspice
from nsspice.analyses.results.sensitivity import Sensitivity


def slopes(text: str) -> dict[tuple[str, str], Sensitivity]:
    (solution,) = nsspice.read(text).run()
    assert not [w for w in solution.warnings if ".sens" in w.message]
    return {(s.signal, s.element): s for s in solution.sensitivities}


def test_a_charge_of_rc() -> None:
    R, C, V, t = 1e3, 1e-6, 5.0, 1e-3
    found = slopes(
        f"""RC
V1 a 0 {V}
R1 a b {R}
C1 b 0 {C} IC=0
.tran 10u 3m uic
.measure tran half WHEN v(b)=2.5
.measure tran end FIND v(b) AT=1m
.measure tran mean AVG v(b) FROM=0 TO=1m
.measure tran late INTEG v(b) FROM=1m TO=3m
.sens half end mean late r1 c1 v1
"""
    )
    tau = R * C

    def integral(t: float) -> float:
        """Of v over [0, t], by tau."""
        e = math.exp(-t / tau)
        return -V * (1.0 - e - e * t / tau)

    e = math.exp(-t / tau)
    by_tau = {
        "end": -V * e * t / tau**2,
        "mean": integral(t) / t,
        "late": integral(3.0 * t) - integral(t),
    }
    for name, slope in by_tau.items():
        for element, factor in (("r1", C), ("c1", R)):
            s = found[name, element]
            assert s.error is None  # exact
            assert abs(s.derivative - slope * factor) < 1e-12 * abs(slope * factor), s
    assert abs(found["end", "v1"].derivative - (1.0 - e)) < 1e-13
    assert found["half", "r1"].error is None
    assert abs(found["half", "r1"].derivative - C * math.log(2.0)) < 1e-12 * C


CONVERTERS = {
    "boost": """Boost converter from rest: the diode's current ends, and the control is hit
Vin in 0 12
L1 in sw 20u IC=0
S1 sw 0 c saw SW1
D1 sw out DX
C1 out 0 {c} IC=10
R1 out 0 {r}
Rc ref c 1k
C2 c 0 30n IC=0
Vref ref 0 0.4
Vsaw saw 0 PULSE(0 1 0 10u 0 0 10u)
.model SW1 SW(VT=0 RON=20m)
.model DX D(Vfwd=0.5 Ron=10m)
.tran 1u 95u uic
.measure tran m FIND v(out) AT=93.7u
.measure tran a AVG i(l1) FROM=20u TO=93.7u
""",
    "hysteresis": """Hysteretic buck converter from rest
Vin in 0 12
S1 in sw 5 fb SW1
V5 5 0 5
D1 0 sw
L1 sw out 22u IC=0
C1 out 0 {c} IC=0
R1 out 0 {r}
Rf out fb 1
Rg fb 0 1meg
.model SW1 SW(VT=0 VH=50m)
.tran 1u 200u uic
.measure tran m FIND v(out) AT=190u
.measure tran a AVG i(l1) FROM=20u TO=190u
""",
}
VALUES = {"c": 2e-6, "r": 20.0}


@pytest.mark.parametrize("name", list(CONVERTERS))
def test_events_move_with_the_elements(name: str) -> None:
    """Central differences, which leave the square of h."""
    deck = CONVERTERS[name]

    def measures(**changed: float) -> dict[str, float]:
        (sol,) = nsspice.read(deck.format(**{**VALUES, **changed})).run()
        assert len(sol.events) > 8
        return sol.measures

    found = slopes(deck.format(**VALUES) + ".sens m a c1 r1 l1 vin\n")
    assert not [key for key, s in found.items() if s.error is not None]
    for element, key in (("c1", "c"), ("r1", "r")):
        value, h = VALUES[key], 1e-5
        sides = [measures(**{key: value * (1.0 + side * h)}) for side in (1.0, -1.0)]
        for measure in ("m", "a"):
            s = found[measure, element]
            difference = (sides[0][measure] - sides[1][measure]) / (2.0 * h)
            assert abs(s.relative - difference) < 1e-6 * max(abs(difference), abs(s.average)), s
