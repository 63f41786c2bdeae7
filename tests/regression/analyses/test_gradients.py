"""Derivatives of measures by one pass backwards, against closed forms and complex steps."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest

import nsspice
from tests.oracle import complex_step

#: of the largest relative derivative of a measure: both sides are sums of some hundred roundings,
#: enlarged where a measure is the difference of parts of a period
CLOSE = 1e-10

RC = """charging
.param v=5 level=2.5 v0=0.5
V1 a 0 {v}
R1 a b 1k
C1 b 0 1u IC={v0}
.tran 10u 3m uic
.measure tran half WHEN v(b)={level}
.measure tran mean AVG v(b) from=0.5m to=2m
.measure tran end FIND v(b) AT=1.7m
.measure tran heat INTEG p(r1)
.measure tran i_rms RMS i(r1)
"""


def rc(v: complex, level: complex, v0: complex, r: complex, c: complex) -> dict[str, complex]:
    """Return the measures of the deck in closed form."""
    tau, swing = r * c, v0 - v

    def whole(t: float) -> complex:
        return v * t - swing * tau * np.expm1(-t / tau)

    heat = -(swing**2) / r * tau / 2.0 * np.expm1(-6e-3 / tau)
    return {
        "half": -tau * np.log((level - v) / swing),
        "mean": (whole(2e-3) - whole(0.5e-3)) / 1.5e-3,
        "end": v + swing * np.exp(-1.7e-3 / tau),
        "heat": heat,
        "i_rms": np.sqrt(heat / r / 3e-3),
    }


def assert_close(
    found: dict[str, dict[str, float]],
    wanted: dict[str, dict[str, float]],
    values: dict[str, float],
) -> None:
    """Assert that derivatives agree, relative to the largest one of a measure."""
    for measure, row in wanted.items():
        size = max(abs(d * values[p]) for p, d in row.items())
        for name, d in row.items():
            off = abs(found[measure][name] - d) * abs(values[name])
            assert off <= CLOSE * size, (measure, name, found[measure][name], d)


def test_a_charging_capacitor() -> None:
    """Averages, values, crossings, heat and root mean squares, by all that they depend on."""
    nominal = {"v": 5.0, "level": 2.5, "v0": 0.5, "r1": 1e3, "c1": 1e-6}
    wanted = complex_step.derivatives(
        lambda p: rc(p["v"], p["level"], p["v0"], p["r1"], p["c1"]), nominal
    )
    found = nsspice.gradient(nsspice.read(RC), parameters=list(nominal))
    assert_close(found.derivatives, wanted, nominal)
    exact = rc(**{k.rstrip("1"): v for k, v in nominal.items()})
    for name, value in found.measures.items():
        assert value == pytest.approx(exact[name].real, rel=1e-9)


BUCK = """buck
.param vin=24 rs=30m rd=10m vf=0.6 l=40u rl=20m c=10u r=60 don=0.4 t=10u
Vin in 0 {vin}
S1 in sw g 0 SWITCH
D1 0 sw DIODE
L1 sw x {l}
RL x out {rl}
C1 out 0 {c}
R1 out 0 {r}
Vg g 0 PULSE(1 -1 {don*t} 0 0 {(1-don)*t} {t})
.model SWITCH SW(VT=0 RON={rs})
.model DIODE D(Ron={rd} Vfwd={vf})
"""
MEASURES = """.measure KIND v_avg AVG v(out)
.measure KIND v_rms RMS v(out)
.measure KIND i_avg AVG i(L1)
.measure KIND i_max MAX i(L1)
.measure KIND p_r AVG p(R1)
"""


@pytest.mark.parametrize("load", [60.0, 3.0], ids=["discontinuous", "continuous"])
def test_a_buck_converter_in_steady_state(load: float) -> None:
    """Every parameter, the forward drop, the duty and the period among them."""
    nominal = {**complex_step.NOMINAL, "r": load}
    wanted = complex_step.derivatives(complex_step.steady, nominal)
    del wanted["v_end"]
    deck = BUCK.replace("r=60", f"r={load}") + ".pss\n" + MEASURES.replace("KIND", "pss")
    found = nsspice.gradient(nsspice.read(deck))
    assert_close(found.derivatives, wanted, nominal)


@pytest.mark.parametrize("load", [60.0, 3.0], ids=["discontinuous", "continuous"])
def test_a_buck_converter_from_rest(load: float) -> None:
    """Five periods of a transient; its end does not move with the period."""
    nominal = {**complex_step.NOMINAL, "r": load}
    wanted = complex_step.derivatives(partial(complex_step.transient, periods=5), nominal)
    deck = BUCK.replace("r=60", f"r={load}") + ".tran 1u 50u uic\n"
    deck += MEASURES.replace("KIND", "tran") + ".measure tran v_end FIND v(out) AT=50u\n"
    names = [name for name in nominal if name != "t"]
    found = nsspice.gradient(nsspice.read(deck), parameters=names)
    assert_close(
        found.derivatives, {m: {n: row[n] for n in names} for m, row in wanted.items()}, nominal
    )


BANK = """bank of capacitors
.param t0=0.2m
V1 a 0 10
R1 a b 10
C1 b 0 10u IC=0
S1 b c g 0 sw
C2 c 0 22u IC=1
R2 c 0 80
Vg g 0 PULSE(0 1 {t0} 0 0 1 2)
.model sw SW(VT=0.5)
.tran 1u 1m uic
.measure tran end FIND v(c) AT=0.8m
.measure tran mean AVG v(b) from=0.1m to=1m
"""


def bank(p: dict[str, complex]) -> dict[str, complex]:
    """Return the measures of the deck in closed form."""
    v, r1, r2, c1, c2, t0 = (p[name] for name in ("v1", "r1", "r2", "c1", "c2", "t0"))
    tau = r1 * c1
    first = v * (1.0 - np.exp(-t0 / tau))
    both = (c1 * first + c2 * np.exp(-t0 / (r2 * c2))) / (c1 + c2)
    last, slow = v * r2 / (r1 + r2), (c1 + c2) * r1 * r2 / (r1 + r2)
    before = v * (t0 - 1e-4) + v * tau * (np.exp(-t0 / tau) - np.exp(-1e-4 / tau))
    after = last * (1e-3 - t0) + (both - last) * slow * (1.0 - np.exp(-(1e-3 - t0) / slow))
    return {
        "end": last + (both - last) * np.exp(-(8e-4 - t0) / slow),
        "mean": (before + after) / 9e-4,
    }


def test_charge_that_is_shared_at_one_instant() -> None:
    """An ideal switch joins two capacitors: their voltages jump."""
    nominal = {"v1": 10.0, "r1": 10.0, "r2": 80.0, "c1": 10e-6, "c2": 22e-6, "t0": 0.2e-3}
    found = nsspice.gradient(nsspice.read(BANK), parameters=list(nominal))
    assert_close(found.derivatives, complex_step.derivatives(bank, nominal), nominal)


LOOP = """coupled inductors, k = 1
V1 a 0 1
R1 a b 10
L1 b 0 1m
L2 s 0 4m
K1 L1 L2 1
R2 s 0 100
.tran 1u 100u uic
.measure tran end FIND v(s) AT=60u
.measure tran mean AVG i(R1)
"""


def loop(p: dict[str, complex]) -> dict[str, complex]:
    """Return the measures of the deck: one flux, of the two windings in parallel."""
    v, r1, r2, l1, l2 = (p[name] for name in ("v1", "r1", "r2", "l1", "l2"))
    ratio = np.sqrt(l2 / l1)
    load = r2 / ratio**2
    both, source = r1 * load / (r1 + load), v * load / (r1 + load)
    tau = l1 / both
    through = source * tau * (1.0 - np.exp(-1e-4 / tau))
    return {
        "end": ratio * source * np.exp(-6e-5 / tau),
        "mean": v / r1 - through / r1 / 1e-4,
    }


def test_perfectly_coupled_inductors() -> None:
    """Their currents jump though the flux does not; k = 1 stays as each inductance changes."""
    nominal = {"v1": 1.0, "r1": 10.0, "r2": 100.0, "l1": 1e-3, "l2": 4e-3}
    found = nsspice.gradient(nsspice.read(LOOP), parameters=list(nominal))
    assert_close(found.derivatives, complex_step.derivatives(loop, nominal), nominal)


def test_a_transient_that_begins_with_the_dc_solution() -> None:
    """Charges at the beginning depend on the resistors; the source steps afterwards."""
    deck = """divider with capacitor
V1 a 0 PULSE(6 3 10u 0 0 1 2)
R1 a b 1k
R2 b 0 2k
C1 b 0 20n
.tran 1u 30u
.measure tran end FIND v(b) AT=25u
"""

    def closed(p: dict[str, complex]) -> dict[str, complex]:
        share = p["r2"] / (p["r1"] + p["r2"])
        tau = p["r1"] * share * p["c1"]
        return {"end": share * (3.0 + 3.0 * np.exp(-15e-6 / tau))}

    nominal = {"r1": 1e3, "r2": 2e3, "c1": 20e-9}
    found = nsspice.gradient(nsspice.read(deck), parameters=list(nominal))
    assert_close(found.derivatives, complex_step.derivatives(closed, nominal), nominal)


def test_thresholds_with_hysteresis() -> None:
    """A relaxation oscillator: the instant of its third turn, by both thresholds."""
    deck = """relaxation oscillator
.param vt=2 vh=1
V1 a 0 5
R1 a b 1k
C1 b 0 1u IC=0
S1 b 0 b 0 sw
.model sw SW(VT={vt} VH={vh} RON=10)
.tran 1u 5m uic
.measure tran third WHEN v(b)=2.5 CROSS=4
"""

    def closed(p: dict[str, complex]) -> dict[str, complex]:
        high, low, r, c = p["vt"] + p["vh"], p["vt"] - p["vh"], p["r1"], p["c1"]
        rest = 5.0 * 10.0 / (10.0 + r)
        fall = 10.0 * r / (10.0 + r) * c
        down = fall * np.log((high - rest) / (low - rest))
        up = r * c * np.log((5.0 - low) / (5.0 - high))
        first = r * c * np.log(5.0 / (5.0 - high))
        part = fall * np.log((high - rest) / (2.5 - rest))
        return {"third": first + down + up + part}

    nominal = {"vt": 2.0, "vh": 1.0, "r1": 1e3, "c1": 1e-6}
    found = nsspice.gradient(nsspice.read(deck), parameters=list(nominal))
    assert found.measures["third"] == pytest.approx(closed(nominal)["third"].real, rel=1e-9)
    assert_close(found.derivatives, complex_step.derivatives(closed, nominal), nominal)


def test_edges_that_move_apart_have_no_derivative() -> None:
    """Two ideal edges at one instant, of which a parameter moves one: the instant is named."""
    deck = """two edges
.param d=1u
V1 a 0 PULSE(0 1 {d} 0 0 5u 10u)
V2 b 0 PULSE(0 1 1u 0 0 5u 10u)
R1 a c 1k
R2 b c 1k
C1 c 0 1n
.tran 0.1u 4u uic
.measure tran mean AVG v(c)
"""
    with pytest.raises(nsspice.StepError, match=r"NS3068.*at t = 1e-06 s") as raised:
        nsspice.gradient(nsspice.read(deck), ["mean"], ["d"])
    assert raised.value.time == pytest.approx(1e-6)


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (".measure tran m DERIV v(b) AT=1m", "deriv is not differentiated"),
        (".measure tran m AVG abs(v(b))", "sums and products"),
        (".measure tran m RMS p(r1)", "root mean square"),
        (".measure tran m MAX_AT v(b)", "max_at is not differentiated"),
    ],
)
def test_measures_without_a_derivative_say_so(line: str, reason: str) -> None:
    """NS4041 with the reason."""
    with pytest.raises(nsspice.UsageError, match=f"NS4041.*{reason}"):
        nsspice.gradient(nsspice.read(RC + line + "\n"), ["m"], ["r1"])


def test_a_peak_right_after_a_jump() -> None:
    """The flyback of the collection: its secondary takes over the flux when the switch opens."""
    deck = nsspice.read("netlists/converters/flyback.net")
    names = ["vin", "don", "lp", "ls"]
    found = nsspice.gradient(deck, ["i_sec"], names)
    # V don T / Lp sqrt(Lp / Ls), from rest in each period: powers 1, 1, -1/2, -1/2
    peak = 48.0 * 0.3 * 10e-6 / 50e-6 * 4.0
    wanted = {
        name: power * peak / found.parameters[name]
        for name, power in zip(names, (1.0, 1.0, -0.5, -0.5), strict=True)
    }
    assert_close(found.derivatives, {"i_sec": wanted}, found.parameters)


def test_a_parameter_and_the_element_whose_value_it_is() -> None:
    """Each moves with the other at rest: Vref is iref - 5 in the deck."""
    deck = nsspice.read("netlists/steady/peak_current.net")
    found = nsspice.gradient(deck, ["i_low"], ["iref", "vref", "vin"])
    # I - (Vin - Vo)/L t1 + ... = I - Vo (1 - Vo/Vin) T / L, duty Vo/Vin
    low = {"iref": 1.0, "vref": 1.0, "vin": -(4.0**2) / 10.0**2 * 10e-6 / 20e-6}
    assert_close(found.derivatives, {"i_low": low}, found.parameters)


def test_a_parameter_and_an_element_with_another_value() -> None:
    """What an optimiser tries: R1 is not what the deck says while V is a parameter of the deck."""
    target = nsspice.objective(nsspice.read(RC), "end", ["v", "r1"])
    x = np.array([4.0, 2e3])
    wanted = complex_step.derivatives(
        lambda p: {"end": rc(p["v"], 2.5, 0.5, p["r1"], 1e-6)["end"]}, {"v": 4.0, "r1": 2e3}
    )
    found = dict(zip(["v", "r1"], target(x)[1].tolist(), strict=True))
    assert_close({"end": found}, wanted, {"v": 4.0, "r1": 2e3})


def test_one_assembly_gives_what_differences_of_many_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """Coupled inductors, delays that depend on parameters, functions that are not traced."""
    text = Path("netlists/steady/dual_active_bridge.net").read_text("utf-8")
    text = text.replace(".param t=20u ph={t/10}", ".param a=0.1 t=20u ph={t*sqrt(a*a)*cos(0)}")
    deck = nsspice.read(text)
    names = ["a", "v1", *(d.name for d in deck.devices if d.letter in "rlc")]
    one = nsspice.gradient(deck, ["v_avg"], names)
    monkeypatch.setattr("nsspice.analyses.gradients.differentiated.traced", lambda *_: None)
    many = nsspice.gradient(deck, ["v_avg"], names)
    size = max(abs(d * one.parameters[n]) for n, d in many.derivatives["v_avg"].items())
    for name, d in one.derivatives["v_avg"].items():
        # differences of numbers are known to 1e-11; sums of them cancel to a hundredth here
        assert abs(d - many.derivatives["v_avg"][name]) * one.parameters[name] <= 1e-9 * size


def test_a_function_that_is_not_traced_is_differentiated_all_the_same() -> None:
    deck = nsspice.read(RC.replace(".param v=5", ".param a=0.3 v={5*exp(a)}"))
    found = nsspice.gradient(deck, ["end"], ["a"])
    tau, v = 1e-3, 5.0 * np.exp(0.3)
    end = v * -np.expm1(-1.7e-3 / tau)
    assert found.derivatives["end"]["a"] == pytest.approx(end, rel=1e-10)


def test_a_number_taken_by_its_value_alone_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A device that drops what a number depends on: the derivative is that of differences."""
    from nsspice.devices.passive.resistor import Resistor

    plain = Resistor.at
    monkeypatch.setattr(Resistor, "at", lambda self, c: float.__mul__(plain(self, c), 1.0))
    found = nsspice.gradient(nsspice.read(RC), ["end"], ["r1"])
    # d/dR of V - (V - V0) e^(-t/RC), t = 1.7 ms
    x = 1.7
    wanted = -(5.0 - 0.5) * np.exp(-x) * x / 1e3
    assert found.derivatives["end"]["r1"] == pytest.approx(wanted, rel=1e-9)
