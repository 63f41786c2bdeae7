"""Transistors: currents against ngspice 39.3 and against the equations of the thesis.

ngspice's figures were printed with ``numdgt=9``, ``reltol=1e-9``, ``gmin=1e-30``; its constants k
and q differ by 3.4e-7 of k/q, which at 30 thermal voltages is 1e-5 of a current.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracle.newton import Static
from oracle.node_voltages import in_node_voltages
from oracle.tapes import run

from nsspice.circuit import Circuit, MnaSystem, ProblemClass, build
from nsspice.circuit.explain import explain
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text

VT = 1.380649e-23 * 300.15 / 1.602176634e-19
ONE = "(is=2e-15 bf=150 br=3 nf=1.05 nr=1.1)"
TWO = "(is=1e-15 bf=120 br=2 vaf=50 var=8 ikf=20m ikr=5m ise=1e-13 ne=1.6 isc=2e-13 nc=1.8 xtb=1.5)"
THREE = "(is=1e-15 bf=120 br=2 vaf=50 rb=100 rbm=20 rc=5 re=2 ikf=20m)"


def circuit_of(text: str) -> Circuit:
    return build(parse_text(f"title\n{text}\n"))


def assembled(text: str, **conditions: object) -> MnaSystem:
    circuit = circuit_of(text)
    assert len(circuit.islands) == 1
    return in_node_voltages(circuit.islands[0].assemble(**conditions))


def codes(text: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        circuit_of(text)
    return sorted(d.code for d in caught.value.diagnostics)


def currents(card: str, kind: str, vc: float, vb: float, celsius: float = 27.0) -> list[float]:
    """Return the currents into collector, base and emitter; the emitter is grounded."""
    text = f"V1 c 0 {vc!r}\nV2 b 0 {vb!r}\nQ1 c b e qm\nV3 e 0 0\n.model qm {kind}{card}"
    mna = assembled(text, temperature=celsius)
    static = Static(mna.system)
    u = [w.values[0] for w in mna.system.waveforms]
    guess = np.zeros(static.n)
    for index, name in enumerate(mna.unknowns):
        at = {"v(c)": vc, "v(b)": vb, "v(q1#collector)": vc, "v(q1#base)": vb}
        guess[index] = at.get(name, 0.0)
    (x,) = static.solutions(u, guesses=[guess])
    return [static.output(mna.functional(f"i(q1{end})"), x, u) for end in ("", ".b", ".e")]


@pytest.mark.parametrize("kind", ["npn", "pnp"])
@pytest.mark.parametrize(
    ("celsius", "vc", "vb", "card", "ic", "ib"),
    [
        (27, 0.05, 0.6, ONE, 7.204243147e-06, 2.181554441e-07),
        (27, 0.05, 0.6, TWO, 8.386274858e-06, 1.182818029e-06),
        (27, 0.05, 0.6, THREE, 9.130458278e-06, 9.557803121e-07),
        (27, 0.05, 0.8, ONE, 1.166998373e-02, 2.699582412e-04),
        (27, 0.05, 0.8, TWO, 8.061816593e-03, 2.211930722e-03),
        (27, 0.05, 0.8, THREE, 1.934765768e-03, 5.201705830e-04),
        (27, 3.0, 0.6, ONE, 7.867076227e-06, 5.244717416e-08),
        (27, 3.0, 0.6, TWO, 1.154457133e-05, 2.968923300e-07),
        (27, 3.0, 0.8, TWO, 1.447247073e-02, 2.505478745e-04),
        (27, 3.0, 0.8, THREE, 8.136533820e-03, 9.032941829e-05),
        (75, 0.05, 0.6, ONE, 1.899919650e-04, 8.124624939e-06),
        (75, 0.05, 0.6, TWO, 1.819266783e-04, 2.439489515e-05),
        (75, 0.05, 0.8, THREE, 2.241001280e-03, 1.192133656e-03),
        (75, 3.0, 0.6, TWO, 2.695180864e-04, 3.017927337e-06),
        (75, 3.0, 0.8, TWO, 5.397128656e-02, 1.545455259e-03),
        (75, 3.0, 0.8, THREE, 1.869561715e-02, 2.834516773e-04),
    ],
)
def test_currents_of_ngspice(
    kind: str, celsius: float, vc: float, vb: float, card: str, ic: float, ib: float
):
    sign = 1.0 if kind == "npn" else -1.0
    found = currents(card, kind, sign * vc, sign * vb, celsius)
    expected = [sign * ic, sign * ib, -sign * (ic + ib)]
    assert found == pytest.approx(expected, rel=3e-5)


def test_the_plain_transistor_is_that_of_ebers_and_moll():
    vbe, vbc = 0.65, 0.35
    forward, reverse = (1e-16 * math.expm1(v / VT) for v in (vbe, vbc))
    ic = forward - reverse - reverse / 2
    ib = forward / 50 + reverse / 2
    found = currents("(bf=50 br=2)", "npn", vbe - vbc, vbe)
    assert found == pytest.approx([ic, ib, -ic - ib], rel=1e-12)


def test_only_what_the_card_gives_is_simulated():
    text = "V1 c 0 1\nV2 b 0 1\nQ1 c b 0 qm\n.model qm npn"
    plain = assembled(text)
    assert plain.unknowns == ["v(c)", "v(b)", "i(v1)", "i(v2)"]
    assert plain.system.smooth is not None
    assert plain.system.smooth.Q.data.size == 0
    assert circuit_of(text).islands[0].problem_class is ProblemClass.GE
    # rbm = rb is a plain resistance
    full = assembled(text + "(rc=1 rb=2 re=3 rbm=2 cje=1p cjc=1p)")
    inside = ["collector", "base", "emitter"]
    assert full.unknowns[4:] == [f"v(q1#{end})" for end in inside]
    # nothing holds the nodes inside: currents through the resistances are unknowns
    bare = assembled(text + "(rc=1 rb=2 re=3 rbm=2)")
    assert bare.unknowns[4:] == [f"{of}(q1#{end})" for end in inside for of in "vi"]
    assert circuit_of(text + "(tf=1n)").islands[0].problem_class is ProblemClass.DNCP
    zeros = assembled(text + "(rc=0 rb=0 re=0 cje=0 tf=0 vaf=0 ikf=0 ise=0)")
    assert zeros.unknowns == plain.unknowns


def test_charges_against_their_formula():
    # no current that would matter: IS = 1e-30
    card = "npn(is=1e-30 cje=2p vje=.8 mje=.4 cjc=1p vjc=.6 mjc=.5 fc=.5)"
    mna = assembled(f"V1 c 0 1\nV2 b 0 1\nQ1 c b 0 qm 3\n.model qm {card}")
    smooth = mna.system.smooth
    assert smooth is not None
    vb, vc = 0.2, 2.0
    _, slopes = run(smooth.tape, [vc, vb, 0.0, 0.0])
    capacitance = smooth.Q.dense() @ slopes
    cje = 3 * 2e-12 * (1 - vb / 0.8) ** -0.4
    cjc = 3 * 1e-12 * (1 - (vb - vc) / 0.6) ** -0.5
    c, b = mna.unknowns.index("v(c)"), mna.unknowns.index("v(b)")
    assert capacitance[b, b] == pytest.approx(cje + cjc, rel=1e-12)
    assert capacitance[c, b] == pytest.approx(-cjc, rel=1e-12)
    assert mna.functional("i(q1)").df
    charges = mna.initial_charges({"b": vb, "c": vc})
    one = 3 * 2e-12 * 0.8 / 0.6 * (1 - (1 - vb / 0.8) ** 0.6)
    two = 3 * 1e-12 * 0.6 / 0.5 * (1 - (1 - (vb - vc) / 0.6) ** 0.5)
    assert charges[[c, b]] == pytest.approx([-two, one + two], rel=1e-12)


def test_the_transit_time_carries_the_base_charge():
    card = "pnp(is=1e-15 tf=2n xtf=3 itf=10m vtf=2 tr=5n)"
    mna = assembled(f"V1 c 0 1\nV2 b 0 1\nQ1 c b 0 qm\n.model qm {card}")
    smooth = mna.system.smooth
    assert smooth is not None
    vb, vc = -0.7, -0.3
    forward, reverse = (1e-15 * math.expm1(v / VT) for v in (-vb, vc - vb))
    growth = 1 + 3 * (forward / (forward + 10e-3)) ** 2 * math.exp((vc - vb) / (1.44 * 2))
    values, _ = run(smooth.tape, [vc, vb, 0.0, 0.0])
    charge = (smooth.Q.dense() @ values)[:2]
    expected = [5e-9 * reverse, -(2e-9 * forward * growth + 5e-9 * reverse)]
    assert charge == pytest.approx(expected, rel=1e-9)


def test_ebers_moll_with_practical_diodes():
    # example 4.2.2 without drops: linear in every mode
    text = """VU1 n1 0 0.5
RB n1 b 30k
VU2 n2 0 -9
RL n2 c 3k
Q1 c b 0 pm
.model pm PNP(alphaN=0.1 alphaI=0.7 DE=de DC=dc)
.model de D(Vfwd=2 Vrev=2)
.model dc D(Vfwd=4 Vrev=4)"""
    circuit = circuit_of(text)
    assert circuit.islands[0].problem_class is ProblemClass.LCP
    mna = in_node_voltages(circuit.islands[0].assemble())
    assert mna.pairs == ["q1.de.fwd", "q1.de.rev", "q1.dc.fwd", "q1.dc.rev"]
    static = Static(mna.system)
    u = [w.values[0] for w in mna.system.waveforms]
    (x,) = static.solutions(u)
    emitter, base, collector = (
        static.output(mna.functional(f"i(q1{end})"), x, u) for end in (".e", ".b", "")
    )
    # forward emitter diode: v(b) = -2; broken down collector diode: v(c) = v(b) - 4
    assert [x[mna.unknowns.index(n)] for n in ("v(b)", "v(c)")] == pytest.approx([-2.0, -6.0])
    # 30 kOhm carry 2.5 V into the base, 3 kOhm carry 3 V into the collector's source
    assert collector == pytest.approx(-1e-3, rel=1e-12)
    assert emitter == pytest.approx(1e-3 - 2.5 / 30e3, rel=1e-12)
    assert base == pytest.approx(2.5 / 30e3, rel=1e-12)


def test_ebers_moll_npn_mirrors_pnp():
    text = "V1 c 0 {0}\nV2 b 0 {1}\nQ1 c b e qm\nR1 e 0 1\n.model qm {2}(alphaN=.9 DE=d DC=d)"
    found = []
    for kind, sign in (("npn", 1.0), ("pnp", -1.0)):
        deck = text.format(sign * 5, sign * 2, kind) + "\n.model d D(Vfwd=0.5)"
        mna = assembled(deck)
        static = Static(mna.system)
        u = [w.values[0] for w in mna.system.waveforms]
        (x,) = static.solutions(u)
        found.append(
            [sign * static.output(mna.functional(f"i(q1{e})"), x, u) for e in ("", ".b", ".e")]
        )
    assert found[0] == pytest.approx([0.9 * 1.5, 0.1 * 1.5, -1.5])
    assert found[1] == pytest.approx(found[0])


def test_ebers_moll_junctions_may_be_smooth_and_have_drops():
    text = "V1 c 0 5\nV2 b 0 .7\nQ1 c b 0 qm m=2\n.model qm npn(alphaN=.99 DE=d DC=x)\n"
    mna = assembled(text + ".model d D(is=1e-14)\n.model x D(ideal V={2*i})")
    static = Static(mna.system)
    u = [w.values[0] for w in mna.system.waveforms]
    guess = np.zeros(static.n + static.m)
    guess[:2] = 5, 0.7
    (x,) = static.solutions(u, guesses=[guess])
    emitter = 2e-14 * math.expm1(0.7 / VT)
    assert static.output(mna.functional("i(q1)"), x, u) == pytest.approx(0.99 * emitter, rel=1e-9)
    assert mna.pairs == ["q1.dc"]
    assert "i(q1.dc)" in mna.unknowns


def test_junctions_on_the_element_line_and_ideal_ones():
    circuit = circuit_of(
        "V1 c 0 1\nR1 c b 1\nQ1 c b 0 qm DE=d\n.model qm npn(ideal)\n.model d D(ideal)"
    )
    text = explain(circuit).text()
    assert "Ebers-Moll NPN, emitter diode: conduction, collector diode: conduction" in text
    assert circuit.default_signals() == ["v(c)", "v(b)", "i(v1)", "i(q1)"]


def test_wrong_transistors():
    base = "V1 c 0 1\nR1 c b 1\nQ1 c b 0 qm\n"
    assert codes(base + ".model qm d") == ["NS2002"]
    assert codes(base + ".model qm npn(bf=-1 is=0 fc=1 vaff=3 rco=1)") == [
        *["NS2003"],
        *["NS2005"] * 3,
        "NS2008",
    ]
    assert codes(base + ".model qm npn(alphaN=1.5)") == ["NS2005"]
    assert codes(base + ".model qm npn(alphaN=.5 bf=3)") == ["NS2008"]
    assert codes(base + ".model qm npn(alphaN=.5 de=zz)") == ["NS1060"]
    assert codes(base + ".model qm npn(alphaN=.5 de=qm)") == ["NS2002"]
    assert codes(base + ".model qm npn(alphaN=.5 de=3)") == ["NS1060"]


def test_terminals_are_signals_everywhere():
    text = """V1 c 0 5
R1 c b 10k
Q1 c b 0 qm
B1 x 0 V={i(Q1.B)*1k}
R2 x 0 1
.model qm npn(bf=100)
.save ib(q1) @q1[ie] i(q1) i(x) ic(q1)
"""
    deck = parse_text(f"t\n{text}")
    assert [s.name for s in deck.saves] == ["i(q1.b)", "i(q1.e)", "i(q1)"]
    circuit = build(deck)
    assert len(circuit.islands) == 1
    assert circuit.parts("i(q1.e)") == [(0, "i(q1.e)", 1.0)]
    with pytest.raises(NetlistError):
        circuit.parts("i(q1.x)")
    assert codes(text.replace("Q1.B", "Q1.X")) == ["NS1070"]


def test_other_models_of_a_transistor_are_refused():
    # VBIC is level 4, HICUM level 8 in ngspice; levels 1 and 2 are one law there
    deck = "V1 c 0 1\nQ1 c c 0 qm\n.model qm npn(level={})"
    assert codes(deck.format(4)) == ["NS2008"]
    for level in (1, 2):
        assert not circuit_of(deck.format(level)).warnings
