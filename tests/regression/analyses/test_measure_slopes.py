"""Derivatives of measures by parameters, against closed forms and against the perturbed orbit."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice

#: what the extrapolated differences are asked for: they err by about 1e-12 of a measure
CLOSE = 1e-9


def slopes(text: str) -> dict[tuple[str, str], nsspice.analyses.results.sensitivity.Sensitivity]:
    (solution,) = nsspice.read(text).run()
    assert not [w for w in solution.warnings if ".sens" in w.message]
    return {(s.signal, s.element): s for s in solution.sensitivities}


def test_a_charge_of_rc() -> None:
    R, C, V, t = 1e3, 1e-6, 5.0, 1e-3
    found = slopes(
        """RC
.param r=1k c=1u v=5
V1 a 0 {v}
R1 a b {r}
C1 b 0 {c} IC=0
.tran 10u 3m uic
.measure tran half WHEN v(b)=2.5
.measure tran end FIND v(b) AT=1m
.measure tran mean AVG v(b) FROM=0 TO=1m
.measure tran eff RMS v(b) FROM=0 TO=1m
.measure tran sum INTEG v(b) FROM=0 TO=1m
.measure tran swing PP v(b) FROM=0.5m TO=1m
.measure tran rise TRIG v(b) VAL=1 RISE=1 TARG v(b) VAL=4 RISE=1
.sens half end mean eff sum swing rise r c v
"""
    )
    tau, e = R * C, math.exp(-t / (R * C))
    by_tau = {
        "half": math.log(2.0),
        "end": -V * e * t / tau**2,
        "mean": -V * (1.0 - e - e * t / tau) / t,
        "sum": -V * (1.0 - e - e * t / tau),
        "swing": V * (0.5 * t * math.exp(-0.5 * t / tau) - t * e) / tau**2,
        "rise": math.log(4.0),
    }
    for name, slope in by_tau.items():
        for element, factor in (("r", C), ("c", R)):
            s = found[name, element]
            assert abs(s.derivative - slope * factor) < CLOSE * abs(slope * factor), s
            assert s.error is None
    assert abs(found["half", "v"].derivative + tau / V) < CLOSE * tau / V  # ln(V/(V - 2.5))
    mean_square = V**2 * (1.0 - 2.0 * tau / t * (1.0 - e) + 0.5 * tau / t * (1.0 - e**2))
    assert abs(found["eff", "v"].derivative - math.sqrt(mean_square) / V) < CLOSE


def test_a_forward_drop_and_a_resistance_of_a_diode() -> None:
    """A rectified sine: its mean, its peak and the instant at which it conducts."""
    A, f, Vf, Ron, R = 10.0, 50.0, 0.7, 0.5, 9.5
    found = slopes(
        f"""rectifier
.param vf={Vf} ron={Ron}
V1 a 0 SIN(0 {A} {f})
D1 a b DX
R1 b 0 {R}
.model DX D(Vfwd={{vf}} Ron={{ron}})
.tran 0.1m 20m
.measure tran mean AVG v(b)
.measure tran top MAX v(b)
.measure tran on WHEN v(b)=1m RISE=1
.sens mean top on vf ron
"""
    )
    k, start = R / (R + Ron), math.asin(Vf / A)
    whole = 2.0 * A * math.cos(start) - Vf * (math.pi - 2.0 * start)  # over half a turn
    expected = {
        ("mean", "vf"): -k * (math.pi - 2.0 * start) / (2.0 * math.pi),
        ("mean", "ron"): -whole / (2.0 * math.pi) * k / (R + Ron),
        ("top", "vf"): -k,
        ("top", "ron"): -(A - Vf) * k / (R + Ron),
        ("on", "vf"): 1.0 / (2 * math.pi * f * math.sqrt(A**2 - (Vf + 1e-3 / k) ** 2)),
    }
    for key, slope in expected.items():
        assert abs(found[key].derivative - slope) < CLOSE * abs(slope), key


def test_thresholds_and_the_resistance_of_a_switch() -> None:
    """A relaxation oscillator: its period by both thresholds, closed form."""
    V, R, C, Rs, vt, vh = 10.0, 10e3, 100e-9, 1e3, 4.0, 1.5
    found = slopes(
        f"""relaxation
.param vt={vt} vh={vh} ron={Rs}
V1 a 0 {V}
R1 a b {R}
C1 b 0 {C} IC=0
S1 b 0 b 0 SX
.model SX SW(VT={{vt}} VH={{vh}} RON={{ron}})
.tran 1u 6m uic
.measure tran period TRIG v(b) VAL=4 FALL=1 TARG v(b) VAL=4 FALL=3
.sens period vt vh ron
"""
    )

    def period(vt: float, vh: float, rs: float) -> float:
        low, high = vt - vh, vt + vh
        goal = V * rs / (R + rs)
        tau = C * R * rs / (R + rs)
        return 2.0 * (
            R * C * math.log((V - low) / (V - high)) + tau * math.log((high - goal) / (low - goal))
        )

    at = np.array([vt, vh, Rs])
    for k, name in enumerate(("vt", "vh", "ron")):
        # a complex step has no truncation error that counts, but log needs cmath: differences
        h = 1e-4 * at[k] * np.eye(3)[k]
        wide, fine = (
            (period(*(at + s * h)) - period(*(at - s * h))) / (2.0 * s * h[k]) for s in (2.0, 1.0)
        )
        slope = fine + (fine - wide) / 3.0  # leaves (1e-4)^4, and 1e-16/1e-4 of rounding
        assert abs(found["period", name].derivative - slope) < 1e-8 * abs(slope), name


def test_times_of_a_source() -> None:
    """An inductor integrates a pulse: its current by delay, rise, width and fall."""
    V, L = 10.0, 1e-3
    found = slopes(
        f"""pulse
.param td=10u tr=1u pw=5u tf=2u per=30u
V1 a 0 PULSE(0 {V} {{td}} {{tr}} {{tf}} {{pw}} {{per}})
L1 a b {L} IC=0
R1 b 0 1u
.tran 1u 60u uic
.measure tran inside FIND i(L1) AT=13u
.measure tran after FIND i(L1) AT=35u
.measure tran twice FIND i(L1) AT=43u
.sens inside after twice td tr pw tf per
"""
    )
    # at 13 us the pulse has been at its top for 2 us: V (t - td - tr/2)/L
    expected = {
        "inside": {"td": -1.0, "tr": -0.5, "pw": 0.0, "tf": 0.0, "per": 0.0},
        "after": {"td": 0.0, "tr": 0.5, "pw": 1.0, "tf": 0.5, "per": 0.0},
        "twice": {"td": -1.0, "tr": 0.0, "pw": 1.0, "tf": 0.5, "per": -1.0},
    }
    for name, row in expected.items():
        for element, factor in row.items():
            # the resistor takes 1e-9 per 1 us of what flows
            error = abs(found[name, element].derivative - factor * V / L)
            assert error < 1e-7 * V / L, (name, element)


def test_a_closed_loop_against_the_perturbed_orbit() -> None:
    """The exact perturbation of an orbit across moving instants is another way to the same."""
    deck = """Buck in discontinuous conduction
.param r=50
Vin in 0 24
S1 in sw g 0 SH
D1 0 sw DX
L1 sw out 10u
C1 out 0 2u
R1 out 0 {r}
Vg g 0 PULSE(-1 1 0 0 0 3u 10u)
.model SH SW(VT=0 RON=20m)
.model DX D(Vfwd=0.5)
.pss
.measure pss v AVG v(out)
.measure pss i AVG i(L1)
.sens v i l1 vin r
.sens v(out) r1 l1 vin
"""
    (solution,) = nsspice.read(deck).run()
    exact = {s.element: s.derivative for s in solution.sensitivities if s.signal == "v(out)"}
    found = {s.element: s.derivative for s in solution.sensitivities if s.signal == "v"}
    for one, other in (("r1", "r"), ("l1", "l1"), ("vin", "vin")):
        assert abs(found[other] - exact[one]) < 1e-8 * abs(exact[one])


def test_where_there_is_no_derivative_the_error_tells() -> None:
    found = slopes(
        """the larger of two
.param x=1
V1 a 0 PULSE({x} {2-x} 1 0 0 1)
R1 a 0 1
.tran 0.1 2
.measure tran top MAX v(a)
.sens top x
"""
    )
    s = found["top", "x"]  # -1 below 1 and +1 above: the error reaches both
    assert s.error is not None
    assert abs(s.derivative) + s.error > 1.0 - 1e-9
    assert s.error > 0.5


@pytest.mark.parametrize(
    ("card", "words"),
    [
        (".sens m nothing", "no measure and no parameter nothing"),
        (".sens m v1", "v1 is not a constant"),
        (".sens m zero", "0"),
    ],
)
def test_what_cannot_be_differentiated_is_left_out_with_a_word(card: str, words: str) -> None:
    (solution,) = nsspice.read(
        """RC
.param zero=0
V1 a 0 SIN(0 1 1k)
R1 a 0 1k
.tran 10u 1m
.measure tran m AVG v(a)
"""
        + card
    ).run()
    (warning,) = [w for w in solution.warnings if ".sens" in w.message]
    assert words in warning.message
    assert not solution.sensitivities


def test_each_step_has_its_own() -> None:
    solutions = nsspice.read(
        """divider
.param r=1k
V1 a 0 6
R1 a b {r}
R2 b 0 1k
.op
.step param r list 1k 2k
.measure op out FIND v(b) AT=0
.sens out r r2
"""
    ).run()
    for solution, r in zip(solutions, (1e3, 2e3), strict=True):
        by = {s.element: s.derivative for s in solution.sensitivities}
        slope = 6e3 / (r + 1e3) ** 2
        assert abs(by["r"] + slope) < CLOSE * slope
        assert abs(by["r2"] - slope * r / 1e3) < CLOSE * slope * r / 1e3
