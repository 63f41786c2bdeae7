"""Derivatives of runs by steps with error control, against closed forms, the exact engine and runs.

Steps of 1e-9 leave some 1e-9 in values and, with their lengths held, in derivatives; they are
compared relative to the largest relative derivative of a measure.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

import nsspice

CLOSE = 2e-8
Table = Mapping[str, Mapping[str, float]]


def assert_close(found: Table, wanted: Table, values: Mapping[str, float], close: float) -> None:
    for measure, row in wanted.items():
        size = max(abs(d * values[p]) for p, d in row.items())
        for name, d in row.items():
            off = abs(found[measure][name] - d) * abs(values[name])
            assert off <= close * size, (measure, name, found[measure][name], d)


def test_a_capacitor_discharged_by_the_cube_of_its_voltage() -> None:
    """C v' = -g v^3: v = v0 / sqrt(1 + k t) with k = 2 g v0^2 / C; value, mean, instant, charge."""
    deck = """cube
.param g=1m v0=3 c=1u at=0.4m level=1
B1 a 0 I={g*v(a)**3}
C1 a 0 {c} IC={v0}
.options reltol=1e-9
.tran 10u 1m uic
.measure tran end find v(a) at={at}
.measure tran mean avg v(a) from=0 to={at}
.measure tran half when v(a)={level}
.measure tran charge integ i(c1) from=0 to={at}
"""
    g, v0, c, at, level = 1e-3, 3.0, 1e-6, 0.4e-3, 1.0
    k = 2.0 * g * v0**2 / c
    root = np.sqrt(1.0 + k * at)
    end, per_k = v0 / root, -0.5 * v0 * at / root**3
    mean = 2.0 * v0 * (root - 1.0) / (k * at)
    mean_k = v0 / (k * root) - mean / k
    by_k = {"g": k / g, "v0": 2.0 * k / v0, "c": -k / c}
    wanted = {
        "end": {p: per_k * d for p, d in by_k.items()},
        "mean": {p: mean_k * d for p, d in by_k.items()},
    }
    wanted["end"] |= {"v0": wanted["end"]["v0"] + 1.0 / root, "at": -0.5 * v0 * k / root**3}
    wanted["mean"] |= {"v0": wanted["mean"]["v0"] + mean / v0, "at": (end - mean) / at}
    half = ((v0 / level) ** 2 - 1.0) / k
    wanted["half"] = {p: -half / k * d for p, d in by_k.items()}
    wanted["half"] |= {"v0": wanted["half"]["v0"] + 2.0 * v0 / level**2 / k}
    wanted["half"] |= {"level": -2.0 * v0**2 / level**3 / k}
    wanted["charge"] = {p: c * d for p, d in wanted["end"].items()}
    wanted["charge"]["v0"] -= c
    wanted["charge"]["c"] += end - v0
    values = {"g": g, "v0": v0, "c": c, "at": at, "level": level}
    found = nsspice.gradient(nsspice.read(deck), parameters=list(values))
    assert_close(found.derivatives, wanted, values, CLOSE)


BUCK = """buck
.param duty=0.4 l=100u c=20u r=5 vin=12 ron=20m vf=0.6 vt=0.5 rise=100n
V1 in 0 {vin}
VG g 0 PULSE(0 1 0 {rise} {rise} {duty*10u} 10u)
S1 in sw g 0 sm
.model sm SW(RON={ron} ROFF=1e9 VT={vt} VH=0)
D1 0 sw dm
.model dm D(Vfwd={vf} Ron=10m)
L1 sw out {l} IC=1
C1 out 0 {c} IC=4
R1 out 0 {r}
.tran 100n 60u uic
.measure tran mean avg v(out) from=20u to=53u
.measure tran ripple pp i(l1) from=33u to=55u
.measure tran heat avg p(s1) from=20u to=50u
.measure tran wave harm1 v(out) from=20u to=50u
"""
BANK = """capacitors joined at one instant
.param c1=1u c2=2u v1=5 tt=20u r=30
VG g 0 PULSE(0 1 {tt} 0 0 1 2)
C1 a 0 {c1} IC={v1}
C2 b 0 {c2} IC=1
S1 a b g 0 sm
.model sm SW(VT=0.5 VH=0)
R1 a 0 {r}
.tran 1u 100u uic
.measure tran mean avg v(b) from=5u to=90u
.measure tran end find v(a) at=60u
"""
RESTING = """at rest, then a source that moves
.param v=2 r1=100 r2=300 l=10m a=1
V1 a 0 SIN({v} {a} 1k)
R1 a b {r1}
D1 b c dm
.model dm D(Vfwd=0.5 Ron=1)
L1 c d {l}
R2 d 0 {r2}
.tran 1u 1m
.measure tran mean avg i(l1) from=0.1m to=0.8m
.measure tran top max i(l1)
"""


@pytest.mark.parametrize("deck", [BUCK, BANK, RESTING])
def test_the_exact_engine_has_the_same(deck: str) -> None:
    """Thresholds, ramps, jumps of charge, a DC solution at the beginning, moved ideal edges."""
    exact = nsspice.gradient(nsspice.read(deck))
    steps = nsspice.gradient(nsspice.read(deck + ".options method=sdirk reltol=1e-9\n"))
    assert_close(steps.derivatives, exact.derivatives, exact.parameters, CLOSE)


def test_a_static_diode() -> None:
    """Of ``a sin = r i + n Vt ln(1 + i/Is)`` by the implicit function theorem."""
    deck = """static
.param a=3 r=100 n=1.2
V1 a 0 SIN(0 {a} 1k)
R1 a b {r}
D1 b 0 dm
.model dm D(IS=1e-12 N={n})
.options reltol=1e-8
.tran 1u 0.5m
.measure tran i find i(d1) at=0.2m
"""
    circuit = nsspice.read(deck)
    found = nsspice.gradient(circuit)
    i, sine = found.measures["i"], np.sin(0.4 * np.pi)
    junction = (3.0 * sine - 100.0 * i) / 1.2  # Vt ln(1 + i/Is)
    slope = 100.0 + junction / np.log1p(i / 1e-12) * 1.2 / (i + 1e-12)
    wanted = {"a": sine / slope, "r": -i / slope, "n": -junction / slope}
    assert_close(found.derivatives, {"i": wanted}, found.parameters, 1e-9)


STEADY = """junctions in steady state
.param f=100k duty=0.4 r=5 is=1p
V1 in 0 PULSE(0 12 0 0 0 {duty/f} {1/f})
D1 in a dm
D2 0 a dm
.model dm D(IS={is} N=1.3 RS=0.1)
L1 a out 20u
C1 out 0 5u
R1 out 0 {r}
.options reltol=1e-7
.pss
.measure pss mean avg v(out)
.measure pss ripple pp v(out)
.measure pss loss avg p(d1)
"""


def test_a_steady_state_with_junctions() -> None:
    """By all parameters at once, the period among them, against differences along one direction.

    A difference over 2e-4 leaves the square of that, and an error of 1e-10 of steps and orbit over
    it.
    """
    circuit = nsspice.read(STEADY)
    found = nsspice.gradient(circuit)

    def measured(share: float) -> np.ndarray:
        values = {p: v * (1.0 + share) for p, v in found.parameters.items()}
        (solution,) = nsspice.read(STEADY, params=values).run()
        return np.array([solution.measures[name] for name in found.measures])

    difference = (measured(2e-4) - measured(-2e-4)) / 4e-4
    along = found.matrix() @ np.array(list(found.parameters.values()))
    assert along == pytest.approx(difference, rel=2e-6)


FREE = """hysteretic buck
.param l=40u c=47u r=3 vin=12 vt=5 vh=50m level=2
V1 in 0 {vin}
S1 in sw ref fb sm
VR ref 0 {vt}
.model sm SW(RON=0.05 ROFF=1meg VT=0 VH={vh})
D1 0 sw dm
.model dm D(Ron=10m Vfwd=0.4)
L1 sw x {l}
RX x out 30m
C1 out 0 {c}
R1 out 0 {r}
R2 out fb 1k
R3 x fb 100k
.pss trigger=i(L1) level={level}
.measure pss mean avg v(out)
.measure pss ripple pp i(l1)
"""


def test_a_free_period() -> None:
    """Whose end moves with everything; the level that ends it is a point of the same orbit."""
    found = nsspice.gradient(nsspice.read(FREE))
    values = dict(found.parameters)
    for row in found.derivatives.values():
        assert abs(row.pop("level")) * values["level"] < 1e-7
    values.pop("level")

    def measured(share: float) -> np.ndarray:
        moved = {p: v * (1.0 + share) for p, v in values.items()}
        (solution,) = nsspice.read(FREE, params=moved).run()
        return np.array([solution.measures[name] for name in found.measures])

    # the exact engine errs by rounding: a difference over 1e-3, extrapolated, is good to 1e-10
    wide, fine = ((measured(h) - measured(-h)) / (2.0 * h) for h in (1e-3, 5e-4))
    along = [sum(d * values[p] for p, d in row.items()) for row in found.derivatives.values()]
    assert along == pytest.approx((4.0 * fine - wide) / 3.0, rel=1e-7)


def test_an_objective_of_steps() -> None:
    """Value and gradient as ``scipy.optimize`` takes them."""
    target = nsspice.objective(nsspice.read(BUCK + ".options method=sdirk\n"), "mean", ["duty"])
    (step,) = target.start * 1e-3
    value, slope = target(target.start)
    ahead, behind = (target(target.start + d)[0] for d in (step, -step))
    assert slope[0] == pytest.approx((ahead - behind) / (2.0 * step), rel=1e-4)
    assert value == pytest.approx(0.5 * (ahead + behind), rel=1e-5)


def test_fixed_steps_say_that_they_have_no_derivatives() -> None:
    deck = BUCK + ".options method=moreau\n"
    with pytest.raises(nsspice.UsageError, match=r"NS4041.*steps of moreau"):
        nsspice.gradient(nsspice.read(deck), ["mean"])
