"""What surrounds the transistor: base resistance over current, substrate, outer base, coefficients.

The currents were printed by ngspice 39.3 with ``reltol=1e-9`` and ``gmin=1e-30``, the capacitances
are those of its ``.ac`` at 1 MHz; its constants k and q differ by 3.4e-7 of k/q (see
``test_transistor.py``): at 30 thermal voltages 1e-5 of a current.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle.newton import Static
from oracle.node_voltages import in_node_voltages
from oracle.tapes import run

import nsspice
from nsspice.circuit import Circuit, MnaSystem, build
from nsspice.circuit.explain import explain
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text

VT = 1.380649e-23 * 300.15 / 1.602176634e-19
CROWDED = "(is=1e-15 bf=120 br=2 rb=200 rbm=20 irb=50u)"
KNEE = "(is=1e-15 bf=120 br=2 ikf=2m nkf=0.7)"
RISING = (
    "(is=1e-15 bf=120 br=2 vaf=50 ikf=20m rb=100 rc=5 re=2 trb1=3m trb2=1u trc1=2m tre1=1m"
    " tikf1=-1m tvaf1=2m tbf1=5m tbf2=-1u tnf1=1e-4)"
)


def circuit_of(text: str) -> Circuit:
    return build(parse_text(f"title\n{text}\n"))


def assembled(text: str, **conditions: object) -> MnaSystem:
    return in_node_voltages(circuit_of(text).islands[0].assemble(**conditions))


def output(mna: MnaSystem, names: list[str], start: dict[str, float]) -> list[float]:
    static = Static(mna.system)
    u = [w.values[0] for w in mna.system.waveforms]
    guess = np.array([start.get(name, 0.0) for name in mna.unknowns])
    (x,) = static.solutions(u, guesses=[guess])
    return [static.output(mna.functional(name), x, u) for name in names]


@pytest.mark.parametrize(("kind", "sign"), [("npn", 1.0), ("pnp", -1.0)])
@pytest.mark.parametrize(
    ("card", "celsius", "vb", "ic", "ib"),
    [
        (CROWDED, 27, 0.65, 8.162889023e-05, 6.802407514e-07),
        (CROWDED, 27, 0.80, 1.709692928e-02, 1.424744107e-04),
        (CROWDED, 75, 0.65, 1.401329365e-03, 1.167774441e-05),
        (CROWDED, 75, 0.80, 7.245090090e-02, 6.037575072e-04),
        (KNEE, 27, 0.65, 7.768841347e-05, 6.837303033e-07),
        (KNEE, 27, 0.80, 3.083889193e-03, 2.256916343e-04),
        (KNEE, 75, 0.80, 6.118486220e-03, 1.838420128e-03),
        (RISING, 27, 0.80, 7.898551473e-03, 8.696225637e-05),
        (RISING, 75, 0.65, 1.178500672e-03, 8.060893285e-06),
        (RISING, 75, 0.80, 1.664473362e-02, 1.986494022e-04),
    ],
)
def test_currents_of_ngspice(
    kind: str, sign: float, card: str, celsius: float, vb: float, ic: float, ib: float
):
    vc, vb = sign * 3.0, sign * vb
    text = f"V1 c 0 {vc!r}\nV2 b 0 {vb!r}\nQ1 c b 0 qm\n.model qm {kind}{card}"
    start = {"v(c)": vc, "v(b)": vb, "v(q1#collector)": vc, "v(q1#base)": vb}
    found = output(assembled(text, temperature=float(celsius)), ["i(q1)", "i(q1.b)"], start)
    assert found == pytest.approx([sign * ic, sign * ib], rel=2e-5)


def test_the_base_resistance_falls_to_half_at_irb():
    # the drop from base to inner base, over the base current: RBM + (RB - RBM)/2 by definition of
    # IRB; SPICE's approximation of z puts 0.5058 in place of the half at x = 1
    text = "I1 0 b 1m\nQ1 b b 0 qm\n.model qm npn(is=1e-16 bf=1e-3 rb=100 rbm=10 irb={irb!r})"
    mna = assembled(text.format(irb=1e-3 / 1.001))
    start = {"v(b)": 0.8, "v(q1#base)": 0.7}
    outer, inner, base = output(mna, ["v(b)", "v(q1#base)", "i(q1.b)"], start)
    assert base == pytest.approx(1e-3 / 1.001, rel=1e-9)
    z = (math.sqrt(1 + 14.59025) - 1) / 2.4317
    left = 3 * (math.tan(z) - z) / (z * math.tan(z) ** 2)
    assert left == pytest.approx(0.5, rel=0.012)
    assert (outer - inner) / base == pytest.approx(10 + 90 * left, rel=1e-9)


SHAPE = "is=1e-30 cjs=2p vjs=.6 mjs=.4"


@pytest.mark.parametrize(
    ("card", "celsius", "vs", "node", "farad"),
    [
        (f"npn({SHAPE})", 27, -2.0, "c", 2.930156052e-12),
        (f"npn({SHAPE})", 80, 0.3, "c", 4.557812504e-12),
        (f"pnp({SHAPE})", 27, -2.0, "b", 3.240026319e-12),
        (f"pnp({SHAPE})", 80, 0.3, "b", 7.079524827e-12),
        (f"pnp({SHAPE} subs=1)", 27, 0.3, "c", 8.8e-12),
        (f"pnp({SHAPE} subs=1)", 80, -2.0, "c", 2.289680691e-11),
        (f"npn({SHAPE} subs=-1)", 27, 0.3, "b", 5.641213474e-12),
        (f"npn({SHAPE} subs=-1)", 80, -2.0, "b", 1.853341875e-11),
    ],
)
def test_substrate_capacitances_of_ngspice(
    card: str, celsius: float, vs: float, node: str, farad: float
):
    text = f"V1 c 0 1\nV2 b 0 1\nV3 s 0 1\nQ1 c b 0 s qm 3\n.model qm {card}"
    mna = assembled(text, temperature=float(celsius))
    smooth = mna.system.smooth
    assert smooth is not None
    at = {"v(c)": 1.0, "v(b)": 0.2, "v(s)": vs}
    _, slopes = run(smooth.tape, [at.get(name, 0.0) for name in mna.unknowns])
    capacitance = smooth.Q.dense() @ slopes
    s, other = mna.unknowns.index("v(s)"), mna.unknowns.index(f"v({node})")
    assert capacitance[s, s] == pytest.approx(farad, rel=2e-8)
    assert capacitance[other, s] == pytest.approx(-farad, rel=2e-8)


def test_the_substrate_is_ground_without_a_fourth_node_and_its_current_is_a_signal():
    text = "V1 c 0 1\nV2 b 0 1\nQ1 c b 0 {}qm 2\n.model qm npn(ccs=2p iss=1e-14 ns=1.1)"
    mna = assembled(text.format(""))
    found = output(mna, ["i(q1.s)", "i(q1)", "i(q1.b)", "i(q1.e)"], {"v(c)": 1.0, "v(b)": 1.0})
    assert found[0] == pytest.approx(-2e-14 * -math.expm1(-1.0 / (1.1 * VT)), rel=1e-9)
    assert sum(found) == pytest.approx(0.0, abs=1e-15 * max(map(abs, found)))
    assert mna.functional("i(q1.s)").df
    assert not circuit_of(text.format("s ").replace("V2", "V3 s 0 0\nV2")).warnings


def test_the_substrate_junction_of_ngspice():
    # a p substrate at 3.4 V above a collector at 3 V, at 27 degrees
    text = (
        "V1 c 0 3\nV2 b 0 .65\nV3 s 0 3.4\nQ1 c b 0 s qm\n.model qm npn(is=1e-15 iss=1e-13 ns=1.2)"
    )
    found = output(assembled(text), ["i(q1.s)"], {"v(c)": 3.0, "v(b)": 0.65, "v(s)": 3.4})
    assert found == pytest.approx([3.953264412e-08], rel=1e-5)


def test_a_substrate_without_effects_is_warned_about():
    text = "V1 c 0 1\nQ1 c c 0 0 qm\n.model qm npn"
    assert ["substrate" in w.message for w in circuit_of(text).warnings] == [True]


def test_the_outer_base_has_its_share_of_the_charge():
    card = "npn(is=1e-30 rb=10 cjc=3p vjc=.7 mjc=.4 xcjc=.3)"
    mna = assembled(f"V1 c 0 2\nV2 b 0 0\nQ1 c b 0 qm\n.model qm {card}")
    smooth = mna.system.smooth
    assert smooth is not None
    at = {"v(c)": 2.0}
    _, slopes = run(smooth.tape, [at.get(name, 0.0) for name in mna.unknowns])
    matrix = smooth.Q.dense() @ slopes
    whole = 3e-12 * (1 + 2 / 0.7) ** -0.4
    b, inner = (mna.unknowns.index(name) for name in ("v(b)", "v(q1#base)"))
    assert [matrix[b, b], matrix[inner, inner]] == pytest.approx(
        [0.7 * whole, 0.3 * whole], rel=1e-12
    )
    charges = mna.initial_charges({"c": 2.0})
    stored = 3e-12 * 0.7 / 0.6 * (1 - (1 + 2 / 0.7) ** 0.6)
    assert charges[[b, inner]] == pytest.approx([0.7 * stored, 0.3 * stored], rel=1e-12)


def test_the_substrate_capacitance_slows_the_collector():
    # no current but that through 1 kOhm: a linear CJS of 1 nF charges like a capacitor
    text = "V1 a 0 PULSE(0 1 0 0 0 1 2)\nR1 a c 1k\nQ1 c 0 0 qm\n.model qm npn(is=1e-30 cjs=1n)"
    solution = nsspice.read(f"t\n{text}\n.tran 0.1u 5u\n.options reltol=1e-8\n").run()[0]
    expected = 1 - np.exp(-solution.axis / 1e-6)
    # the error control holds each step to 1e-8 of 1 V; 50 steps at most that many times over
    assert solution["v(c)"] == pytest.approx(expected, abs=1e-6)


def test_initial_charge_of_the_substrate():
    text = "V1 c 0 1\nV2 b 0 0\nQ1 c b 0 s qm\nR1 s 0 1\n.model qm npn(cjs=2p vjs=1 mjs=.5)"
    mna = assembled(text)
    charges = mna.initial_charges({"c": 3.0})
    # 2 VJ CJS (1 - sqrt(1 - v/VJ)) between substrate and collector, v = -3 V
    s, c = (mna.unknowns.index(name) for name in ("v(s)", "v(c)"))
    assert charges[[s, c]] == pytest.approx([4e-12 * (1 - 2.0), 4e-12], rel=1e-12)


def test_effects_are_listed_and_wrong_values_named():
    card = "npn(rb=9 rbm=1 irb=1m cjs=1p trb1=1m nk=.6 cjc=1p xcjc=.5)"
    shown = explain(circuit_of(f"V1 c 0 1\nQ1 c c 0 qm\n.model qm {card}")).text()
    for part in (
        "base resistance over current (irb=0.001 A)",
        "substrate charge (cjs=1e-12 F)",
        "temperature coefficients (trb1)",
        "exponent of high injection (nk=0.6)",
        "share of the inner base (xcjc=0.5)",
    ):
        assert part in shown
    bad = "V1 c 0 1\nQ1 c c 0 qm\n.model qm npn(subs=2 xcjc=1.5 vjs=0 fc=1)"
    with pytest.raises(NetlistError) as caught:
        circuit_of(bad)
    assert [d.code for d in caught.value.diagnostics] == ["NS2005"] * 4
    idle = circuit_of("V1 c 0 1\nQ1 c c 0 qm\n.model qm npn(rb=10 irb=1m)").warnings
    assert ["irb has no effect without rbm" in w.message for w in idle] == [True]


@pytest.mark.parametrize("reltol", [1e-3, 1e-4, 1e-5, 1e-6])
def test_charges_near_zero_are_as_exact_as_large_ones(reltol: float) -> None:
    """The charge of a substrate at microvolts: an edge of 1 ns moves it by attocoulombs."""
    circuit = nsspice.read("""A substrate that leaves rest
V1 in 0 PULSE(0 5 0 1n 1n 5u 10u)
L1 in a 10u Rser=0.1 Rpar=10k Cpar=5p
C1 a 0 1u Rser=0.05 ic=0
Rl a 0 10
Q1 c bb 0 sub npn1
Rc in c 1k
Rb a bb 10k
Rs sub 0 1
.model npn1 NPN(IS=1e-15 BF=100 CJS=2p VJS=0.75 MJS=0.4 IRB=1e-4 RB=100 RBM=10)
.tran 50n 5u uic
""")
    assert nsspice.tran(circuit, reltol=reltol).certificate.passed
