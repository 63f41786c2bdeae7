"""Derivatives of small-signal measures and of margins, against complex steps on closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.devices.temperature import thermal_voltage
from tests.oracle import complex_step

#: of the largest relative derivative of a measure: a difference along the rows keeps 1e-10
CLOSE = 1e-9


def assert_close(found, wanted, values) -> None:
    for measure, row in wanted.items():
        size = max(abs(d * values[p]) for p, d in row.items())
        for name, d in row.items():
            off = abs(found[measure][name] - d) * abs(values[name])
            assert off <= CLOSE * size, (measure, name, found[measure][name], d)


FILTER = """RLC low-pass
.param a=2 l=1m c=1u turn=0
V1 in 0 AC {-a} {180+turn}
L1 in b {l}
R1 b out 50
C1 out 0 {c}
.ac list 1k 3k 5k 10k
.measure ac g3 find vm(out) at=3k
.measure ac d5 find vdb(out) at=5k
.measure ac ph find vp(out) at=5k
.measure ac f1 when vm(out)=0.7
.measure ac rel param='g3/f1'
"""


def filtered(p):
    """Return the measures in closed form; between rows vm is a line."""

    def size(f):
        w = 2.0 * np.pi * f
        return p["a"] / np.sqrt((1 - w * w * p["l"] * p["c"]) ** 2 + (w * p["r1"] * p["c"]) ** 2)

    w = 2.0 * np.pi * 5e3
    angle = -np.arctan(w * p["r1"] * p["c"] / (1 - w * w * p["l"] * p["c"]))  # below resonance
    low, high = size(5e3), size(10e3)
    f1 = 5e3 + (low - 0.7) / (low - high) * 5e3
    return {
        "g3": size(3e3),
        "d5": 20.0 * np.log(low) / np.log(10.0),
        "ph": angle * 180.0 / np.pi,
        "f1": f1,
        "rel": size(3e3) / f1,
    }


def test_a_filter() -> None:
    nominal = {"a": 2.0, "l": 1e-3, "c": 1e-6, "r1": 50.0}
    found = nsspice.gradient(nsspice.read(FILTER), parameters=[*nominal, "turn"])
    turned = {m: row.pop("turn") for m, row in found.derivatives.items()}
    assert turned == pytest.approx({"g3": 0, "d5": 0, "ph": 1, "f1": 0, "rel": 0}, abs=1e-8)
    exact = filtered(nominal)
    for name, value in found.measures.items():
        assert value == pytest.approx(exact[name], rel=1e-12)
    assert_close(found.derivatives, complex_step.derivatives(filtered, nominal), nominal)


def test_sens_of_a_response_is_exact() -> None:
    (solution,) = nsspice.run(FILTER + ".sens g3 a r1\n")
    nominal = {"a": 2.0, "l": 1e-3, "c": 1e-6, "r1": 50.0}
    wanted = complex_step.derivatives(filtered, nominal)["g3"]
    assert {s.element for s in solution.sensitivities} == {"a", "r1"}
    for s in solution.sensitivities:
        assert s.error is None
        assert s.derivative == pytest.approx(wanted[s.element], rel=CLOSE)


def test_an_objective_of_responses() -> None:
    """Values of elements that the deck does not have, and some of its measures."""
    target = nsspice.objective(nsspice.read(FILTER), {"g3": 1.0, "d5": 3.0}, ["r1", "l"])
    x = {"r1": 40.0, "l": 1.2e-3}
    wanted = complex_step.derivatives(lambda p: filtered({"a": 2.0, "c": 1e-6, **p}), x)
    jacobian = target.jacobian(list(x.values())) * [[1.0], [3.0]]
    rows = {
        m: dict(zip(x, row, strict=True)) for m, row in zip(("g3", "d5"), jacobian, strict=True)
    }
    assert_close(rows, {m: wanted[m] for m in rows}, x)


def test_a_diode_whose_operating_point_moves() -> None:
    """The resistance of a junction depends on its bias; of the temperature nothing is traced."""
    deck = """junction
.param vb=3
V1 a 0 DC {vb} AC 1
R1 a d 1k
D1 d 0 dm
.model dm D(IS=1e-14 N=1.2)
.ac list 1k
.measure ac gain find vm(d) at=1k
"""
    nvt = 1.2 * thermal_voltage(300.15)

    def gain(p):
        v = 0.7 + 0.0 * p["vb"]
        for _ in range(60):  # Newton's method, in complex numbers as well
            i = p["is"] * (np.exp(v / nvt) - 1.0)
            slope = p["is"] * np.exp(v / nvt) / nvt
            v = v - (i + (v - p["vb"]) / p["r1"]) / (slope + 1.0 / p["r1"])
        return {"gain": 1.0 / (1.0 + p["r1"] * p["is"] * np.exp(v / nvt) / nvt)}

    nominal = {"vb": 3.0, "r1": 1e3, "is": 1e-14}
    found = nsspice.gradient(nsspice.read(deck), ["gain"], ["vb", "r1", "dm(is)"])
    row = dict(zip(nominal, found.derivatives["gain"].values(), strict=True))
    assert_close({"gain": row}, complex_step.derivatives(gain, nominal), nominal)


LOOP = """integrator with a second pole
.param k=100 r=1k c=1u
E1 y 0 0 c2 {k}
Vt x y 0
R1 x c1 {r}
C1 c1 0 {c}
E2 z 0 c1 0 1
R2 z c2 2k
C2 c2 0 50n
.loop vt dec 20 10 100k
"""


def margin(p):
    """Return crossover and phase margin of K / (1 + s T1) / (1 + s T2)."""
    one, two = (p["r"] * p["c"]) ** 2, (p["r2"] * p["c2"]) ** 2
    square = (-(one + two) + np.sqrt((one + two) ** 2 + 4 * one * two * (p["k"] ** 2 - 1))) / (
        2 * one * two
    )
    w = np.sqrt(square)
    phase = -np.arctan(w * np.sqrt(one)) - np.arctan(w * np.sqrt(two))
    return {"crossover": w / (2 * np.pi), "phase_margin": 180.0 + phase * 180.0 / np.pi}


def test_crossover_and_phase_margin() -> None:
    nominal = {"k": 100.0, "r": 1e3, "c": 1e-6, "r2": 2e3, "c2": 50e-9}
    found = nsspice.gradient(nsspice.read(LOOP), ["crossover", "phase_margin"], list(nominal))
    exact = margin(nominal)
    assert found.measures == pytest.approx(exact, rel=1e-10)
    assert_close(found.derivatives, complex_step.derivatives(margin, nominal), nominal)


def test_a_gain_margin_that_is_not_there() -> None:
    with pytest.raises(nsspice.UsageError, match=r"NS4041.*gain_margin.*no result"):
        nsspice.gradient(nsspice.read(LOOP), ["gain_margin"], ["k"])


def test_three_equal_poles_turn_at_a_gain_of_eight() -> None:
    """At -180 degrees w = sqrt(3)/T and |T| = K/8, whatever T is: dB = 20 log(8/K)."""
    deck = """three poles
.param k=4
E1 y 0 0 c3 {k}
Vt x y 0
R1 x c1 1k
C1 c1 0 1u
E2 a 0 c1 0 1
R2 a c2 1k
C2 c2 0 1u
E3 b 0 c2 0 1
R3 b c3 1k
C3 c3 0 1u
.loop vt dec 20 1 10k
"""
    found = nsspice.gradient(nsspice.read(deck), ["gain_margin"], ["k", "r1", "r2", "r3"])
    row = found.derivatives["gain_margin"]
    assert row["k"] == pytest.approx(-20.0 / np.log(10.0) / 4.0, rel=CLOSE)
    # all three together do nothing
    assert sum(row[f"r{k}"] for k in (1, 2, 3)) * 1e3 == pytest.approx(0.0, abs=CLOSE * 20.0)


def test_a_resistance_for_small_signals_alone() -> None:
    """R1 at DC sets the current of nothing here, and its ac= is a value of its own."""
    deck = """divider
.param ra=3k
V1 a 0 AC 1
R1 a b 1k ac={ra}
R2 b 0 1k
.ac list 1k
.measure ac gain find vm(b) at=1k
"""
    row = nsspice.gradient(nsspice.read(deck), ["gain"], ["ra", "r1", "r2"]).derivatives["gain"]
    # R2 / (Ra + R2)
    wanted = {"ra": -1e3 / 16e6, "r1": 0.0, "r2": 3e3 / 16e6}
    assert row == pytest.approx(wanted, rel=CLOSE, abs=1e-15)


def test_delays_are_refused() -> None:
    deck = """line
V1 a 0 AC 1
R1 a b 50
T1 b 0 c 0 z0=50 td=1u
R2 c 0 50
.ac list 1k
.measure ac gain find vm(c) at=1k
"""
    with pytest.raises(nsspice.UsageError, match=r"NS4041.*delays"):
        nsspice.gradient(nsspice.read(deck), ["gain"], ["r1"])


def test_a_response_about_a_steady_state_is_refused() -> None:
    deck = """chopped
V1 a 0 PULSE(0 1 0 0 0 5u 10u) AC 1
R1 a b 1k
C1 b 0 10n
.pss
.ac list 1k
.measure ac gain find vm(b) at=1k
"""
    with pytest.raises(nsspice.UsageError, match=r"NS4041.*steady state"):
        nsspice.gradient(nsspice.read(deck), ["gain"], ["r1"])
