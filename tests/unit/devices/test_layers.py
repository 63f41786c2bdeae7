"""Charges and fluxes that are broken lines: closed forms, conservation, and steps beside them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice.devices.expressions.broken_line import broken_line
from nsspice.devices.expressions.stored_curve import StoredCurve
from nsspice.netlist.expressions.expression import Expression


def run(text: str, signals: list[str], **options: object) -> nsspice.Solution:
    circuit = nsspice.read(f"t\n{text}\n")
    if options:
        return nsspice.tran(circuit, signals=signals, **options)
    return circuit.run(signals=signals)[0]


@pytest.mark.parametrize("seed", range(8))
def test_layers_add_up_to_the_curve(seed: int):
    random = np.random.default_rng(seed)
    places = np.sort(random.uniform(-5.0, 5.0, 6))
    slopes = random.uniform(0.0, 3.0, 7)
    curve = StoredCurve.of(places.tolist(), slopes.tolist())
    assert curve is not None
    assert all(layer.value > 0.0 for layer in curve.layers)
    x = np.linspace(-8.0, 8.0, 1001)
    fine = np.union1d(x, places)
    middle = 0.5 * (fine[1:] + fine[:-1])
    rates = slopes[np.searchsorted(places, middle)]
    charge = np.append(0.0, np.cumsum(rates * np.diff(fine)))
    energy = np.append(0.0, np.cumsum(rates * middle * np.diff(fine)))  # the integral of v dq
    found = np.array([Expression(curve.tree("v")).evaluate({"v": v}) for v in x])
    assert found - found[0] == pytest.approx(np.interp(x, fine, charge), abs=1e-12)
    stored = np.array([curve.energy(v) for v in fine])
    assert stored - stored[0] == pytest.approx(energy, abs=1e-12)


@pytest.mark.parametrize(
    ("text", "places", "slopes"),
    [
        ("if(v>2, 1, v>-1 ? 3 : 0.5)", (-1.0, 2.0), (0.0, 0.0, 0.0)),
        ("abs(v) + max(2*v - 1, v)", (0.0, 1.0), (0.0, 2.0, 3.0)),
        ("table(v, 0, 0, 1, 5, 3, 6)", (0.0, 1.0, 3.0), (0.0, 5.0, 0.5, 0.0)),
        ("v*(v>1) + (v<=1)", (1.0,), (0.0, 1.0)),
        ("limit(-v, -1, 2)", (-2.0, 1.0), (0.0, -1.0, 0.0)),
    ],
)
def test_a_broken_line_has_its_places(text: str, places: tuple, slopes: tuple):
    line = broken_line(Expression.parse(text.replace("v", "v(v)")).node, {"v(v)": 1.0})
    assert line is not None
    assert line.places == pytest.approx(places)
    assert line.slopes == pytest.approx(slopes)
    assert broken_line(Expression.parse("v(a)*v(a)").node, {"v(a)": 1.0}) is None
    assert broken_line(Expression.parse("v(a)+v(b)").node, {"v(a)": 1.0}) is None


def _two_sinusoids(time: np.ndarray, inductance: float, above: float, below: float, kink: float):
    """An inductor of -0.2 A and a capacitor of two slopes at 0 V: sinusoids from kink to kink."""
    v, i, now, found = 0.0, -0.2, 0.0, np.empty_like(time)
    while now <= time[-1]:
        high = v > kink or (v == kink and i < 0.0)
        c = above if high else below
        z, w = math.sqrt(inductance / c), 1.0 / math.sqrt(inductance * c)
        # v = a cos(w t + p), so that C v' = -i
        a, p = math.hypot(v, z * i), math.atan2(z * i, v)
        end = math.inf
        for side in (1.0, -1.0):
            if a > abs(kink):
                s = ((side * math.acos(kink / a) - p) / w) % (2.0 * math.pi / w)
                end = min(end, s if s > 1e-9 / w else s + 2.0 * math.pi / w)
        part = (time >= now) & (time <= now + end)
        found[part] = a * np.cos(w * (time[part] - now) + p)
        v, i = kink, a * math.sin(w * end + p) / z
        now += end
    return found


@pytest.mark.parametrize(
    "line", ["C1 a 0 C={v(a)>2 ? 1u : 3u} ic=0", "C1 0 a Q={3u*x+2u*max(-x-2,0)} ic=0"]
)
def test_an_lc_circuit_with_two_slopes_is_two_sinusoids(line: str):
    """The second line is the same charge seen from the other end."""
    text = f"L1 a 0 1m ic=-0.2\n{line}\n.tran 1u 2m uic"
    solution = run(text, ["v(a)", "i(l1)"])
    exact = _two_sinusoids(solution.time, 1e-3, 1e-6, 3e-6, 2.0)
    # 15 segments, each begun at an instant known to 1e-15 of the time: 1e-12 of the amplitude
    assert np.abs(solution["v(a)"] - exact).max() < 1e-11 * np.abs(exact).max()
    energy = solution.certificate.energy
    assert energy is not None
    assert energy.complete
    # nothing is dissipated, and what is stored stays
    for part in (energy.stored, energy.dissipated, energy.delivered):
        assert abs(part) < 1e-10 * 0.5e-3 * 0.2**2
    assert energy.drift < 1e-10
    steps = run(text, ["v(a)"], method="sdirk", reltol=1e-10)
    # 300 steps with an error of 1e-10 each, which a phase of 30 radians adds up
    assert np.abs(steps["v(a)"] - solution["v(a)"]).max() < 300 * 1e-10 * np.abs(exact).max()


_SATURATING = "V1 a 0 SIN(0 10 1k)\nR1 a b 1\nD1 b c d\nRd c d2 2\nL1 d2 0 {} \nC2 c 0 1u\n"
_SATURATING += ".model d D(ideal)\n.tran 2u 3m uic"


def test_a_saturating_inductor_in_three_words():
    forms = ["Flux={0.2m*x+1m*limit(x,-1,1)}", "{abs(i(L1))<1 ? 1.2m : 0.2m}",
             "L={i>-1 && i<1 ? 1.2m : 0.2m}"]  # fmt: skip
    runs = [run(_SATURATING.format(form), ["i(l1)", "v(c)"]) for form in forms]
    assert runs[0]["i(l1)"].max() > 1.5
    for other in runs[1:]:
        assert np.array_equal(other["i(l1)"], runs[0]["i(l1)"])
    assert runs[0].certificate.energy.drift < 1e-10
    steps = run(_SATURATING.format(forms[0]), ["i(l1)", "v(c)"], method="sdirk", reltol=1e-10)
    for name in ("i(l1)", "v(c)"):
        assert np.abs(steps[name] - runs[0][name]).max() < 1e-7 * np.abs(steps[name]).max()


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_charge_is_kept_where_capacitors_are_joined(method: str):
    """3 uF above 3 V, 5 V, and an empty 1 uF: 3 uF (5 V - v) = 1 uF v."""
    text = "C1 a 0 Q={1u*x+2u*max(x,3)} ic=5\nC2 b 0 1u ic=0\nS1 a b g 0 sw\n"
    text += ".model sw SW(VT=0.5)\nVg g 0 PULSE(0 1 10u 0 0 1 2)\n.tran 1u 20u uic"
    solution = run(text, ["v(a)", "v(b)"], method=method)
    assert solution["v(a)"][-1] == pytest.approx(3.75, rel=1e-9)
    (jump,) = solution.jumps
    # half of 1 uF 5 V squared and half of 2 uF 5 V squared; half of 4 uF 3.75 V squared
    assert jump.before == pytest.approx(37.5e-6, rel=1e-9)
    assert jump.after == pytest.approx(28.125e-6, rel=1e-9)
    assert solution.impulses[0].value == pytest.approx(3.75e-6, rel=1e-9)


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_a_step_over_a_kink_brings_the_charge(method: str):
    text = "V1 a 0 PULSE(0 5 1u 0 0 1 2)\nC1 a 0 C={v(a)>2 ? 1u : 3u} m=2\nR1 a 0 1k\n.tran 0.1u 3u"
    solution = nsspice.tran(nsspice.read(f"t\n{text}\n"), method=method, signals=["i(v1)"])
    assert solution.impulses[0].value == pytest.approx(-2 * 9e-6, rel=1e-9)
    # the integral of v dq of each: half of 3 uF times 4, half of 1 uF times 21
    assert solution.jumps[0].after == pytest.approx(2 * 16.5e-6, rel=1e-9)


def test_a_current_of_layers_is_read():
    text = "L1 a 0 1m ic=-0.2\nRb b 0 1\nC1 b a Q={3u*x-2u*max(x-2,0)} m=2\n"
    text += "F1 0 g C1 2\nRg g 0 1\n.tran 1u 1m uic"
    solution = run(text, ["i(c1)", "v(g)", "v(b)"])
    assert solution["v(g)"] == pytest.approx(2.0 * solution["i(c1)"], rel=1e-12)
    assert solution["v(b)"] == pytest.approx(-solution["i(c1)"], rel=1e-12)


@pytest.mark.parametrize("law", ["x*(v(g)>2 ? 1u : 3u)", "x*(1u+2u*(v(g)<2))",
                                 "if(v(g)>2 && v(g)<9, 1u*x, 3u*x)"])  # fmt: skip
def test_a_charge_stays_where_its_capacitance_is_switched(law: str):
    """Plates that are moved at once: the voltage is three times as high, the charge what it was."""
    text = f"C1 a 0 Q={{{law}}} ic=3\nR1 a 0 1meg\nVg g 0 PULSE(0 5 10u 1u 1u 20u 40u)\n"
    text += ".tran 1u 100u uic"
    solution = run(text, ["v(a)"])
    # it loses charge with 3 s while it is large and 1 s while it is small, at 2 V from 10.4 us on
    t = np.asarray(solution.time)
    small, rest = np.zeros_like(t), t.copy()
    for begin, end in ((10.4e-6, 31.6e-6), (50.4e-6, 71.6e-6), (90.4e-6, 1.0)):
        small += np.clip(t - begin, 0.0, end - begin)
    rest -= small
    charge = 9e-6 * np.exp(-rest / 3.0 - small / 1.0)
    inside = [(begin < t) & (t < end) for begin, end in ((10.4e-6, 31.6e-6), (50.4e-6, 71.6e-6))]
    is_small = inside[0] | inside[1] | (t > 90.4e-6)
    assert solution["v(a)"] == pytest.approx(charge / np.where(is_small, 1e-6, 3e-6), rel=1e-9)
    steps = run(text, ["v(a)"], method="sdirk", reltol=1e-9)
    assert steps["v(a)"] == pytest.approx(solution["v(a)"], rel=1e-8)


def test_what_rises_or_falls_with_other_signals_stays_on_the_tape():
    for law in ("1u*x*v(g)", "1u*x + (v(g)>2)", "(v(g)>2 ? -1u : 3u)*x", "x*(x>v(g) ? 1u : 3u)"):
        circuit = nsspice.read(
            f"t\nC1 a 0 Q={{{law}}}\nR1 a 0 1\nVg g 0 1\nRg g a 1\n.tran 1u 2u\n"
        )
        assert any(d.smooth for island in circuit.islands for d in island.devices), law
