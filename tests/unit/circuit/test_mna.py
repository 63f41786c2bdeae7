import time

import numpy as np
import pytest
from oracle.node_voltages import in_node_voltages, potentials_of

from nsspice.circuit import build
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text

BRIDGE = """oscillator with bridge (thesis example 4.2.4)
C0 n1 0 1e-10 IC=10
L1 n1 0 1m IC=-5
DF1 n1 p
DR1 0 p
DF2 n 0
DR2 n n1
R1 p n 2k
.tran 1u 1m uic
"""


def test_bridge_against_hand_made_matrices():
    mna = in_node_voltages(build(parse_text(BRIDGE)).islands[0].assemble())
    system = mna.system
    g = 1 / 2000
    assert mna.unknowns == ["v(n1)", "v(p)", "v(n)", "i(l1)"]
    assert mna.pairs == ["df1", "dr1", "df2", "dr2"]
    assert system.E.dense() == pytest.approx(np.diag([1e-10, 0.0, 0.0, 1e-3]))
    expected = [[0, 0, 0, 1], [0, g, -g, 0], [0, -g, g, 0], [-1, 0, 0, 0]]
    assert system.G.dense() == pytest.approx(np.array(expected))
    assert system.A.dense().tolist() == [[1, 0, 0, -1], [-1, -1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 0]]
    assert (system.B.dense() == system.A.dense().T).all()
    assert system.row_kind.tolist() == [0, 0, 0, 1]
    assert mna.row_nodes == ["n1", "p", "n", None]
    assert mna.row_elements == [None, None, None, "l1"]
    assert mna.initial_charges() == pytest.approx([1e-9, 0.0, 0.0, -5e-3])


def test_unknowns_may_be_voltages_of_the_heaviest_tree():
    mna = build(parse_text(BRIDGE)).islands[0].assemble()
    # the capacitor, the load, and one of the diodes
    assert mna.unknowns == ["v(n1)", "v(p,n1)", "v(n,p)", "i(l1)"]
    tree = potentials_of(mna)
    assert tree.tolist() == [[1, 0, 0, 0], [1, 1, 0, 0], [1, 1, 1, 0], [0, 0, 0, 1]]
    plain = in_node_voltages(mna).system
    for ours, theirs in ((mna.system.E, plain.E), (mna.system.G, plain.G)):
        assert ours.dense() == pytest.approx(tree.T @ theirs.dense() @ tree, abs=1e-20)
    assert (mna.system.A.dense() == tree.T @ plain.A.dense()).all()
    assert (mna.system.B.dense() == plain.B.dense() @ tree).all()
    # the load is an entry of its own
    assert mna.system.G.dense()[2].tolist() == [0.0, 0.0, 1 / 2000, 0.0]
    assert mna.functional("v(p)").z == ((1, 1.0), (0, 1.0))
    assert mna.functional("v(p,n)").z == ((2, -1.0),)


def test_passive_networks_have_monotone_matrices():
    text = """t
V1 a 0 SIN(0 1 50)
L1 a b 1m
L2 c 0 4m
K1 L1 L2 0.9
C1 b d 1u
D1 b c dm
S1 d 0 a 0 sm
R1 d c 10
R2 a d 0
.model dm d(vfwd=0.7 ron=0.1 roff=1k vrev=5)
.model sm sw(ron=1 roff=1meg)
"""
    system = build(parse_text(text)).islands[0].assemble().system
    E, G = system.E.dense(), system.G.dense()
    assert (E == E.T).all()
    assert np.linalg.eigvalsh(E).min() >= -1e-18
    assert np.linalg.eigvalsh(G + G.T).min() >= -1e-15
    assert (system.B.dense() == system.A.dense().T).all()
    assert system.D.dense().diagonal().min() >= 0.0


def test_functionals():
    mna = in_node_voltages(build(parse_text(BRIDGE)).islands[0].assemble())
    assert mna.functional("v(p)").z == ((1, 1.0),)
    assert mna.functional("V(p, n)").z == ((1, 1.0), (2, -1.0))
    assert mna.functional("v(0,p)").z == ((1, -1.0),)
    assert mna.functional("v(p,p)").z == ()
    assert mna.functional("i(c0)").dz == ((0, 1e-10),)
    assert mna.functional("i(df2)").lam == ((2, 1.0),)
    with pytest.raises(NetlistError, match="NS2012") as caught:
        mna.functional("i(df3)")
    assert "did you mean i(df" in str(caught.value)


def test_values_replace_those_of_the_deck():
    circuit = build(parse_text("t\nV1 a 0 5\nR1 a b 1k\nR2 b 0 1k\n"))
    mna = circuit.islands[0].assemble(values={"r1": 2.0, "v1": 3.0})
    assert in_node_voltages(mna).system.G.dense()[0, 0] == 0.5
    assert mna.system.waveforms[0].values == (3.0,)
    short = circuit.islands[0].assemble(values={"r1": 0.0})
    assert list(short.values(np.ones(4))) == ["v(a)", "v(b)", "i(v1)", "i(r1)"]


def test_terminals_on_one_node_or_ground_only():
    circuit = build(parse_text("t\nR1 a a 1\nC1 a a 1\nD1 a a\nR2 a 0 1\nL1 0 0 1m\nR3 0 0 1\n"))
    mna = circuit.islands[0].assemble()
    assert mna.unknowns == ["v(a)", "i(l1)"]
    assert mna.system.G.dense().tolist() == [[1.0, 0.0], [0.0, 0.0]]
    assert mna.functional("i(r1)").z == ()
    assert {w.code for w in circuit.warnings} == {"NS2057"}


def test_circuit_parts_lead_to_islands():
    circuit = build(parse_text("t\nV1 a 0 1\nR1 a 0 1\nV2 b 0 2\nR2 b c 1\nR3 c 0 1\n"))
    assert circuit.parts("v(a)") == [(0, "v(a)", 1.0)]
    assert circuit.parts("v(b,c)") == [(1, "v(b,c)", 1.0)]
    assert circuit.parts("v(a,b)") == [(0, "v(a)", 1.0), (1, "v(b)", -1.0)]
    assert circuit.parts("v(0)") == []
    assert circuit.parts("i(r3)") == [(1, "i(r3)", 1.0)]
    assert circuit.default_signals() == ["v(a)", "v(b)", "v(c)", "i(v1)", "i(v2)"]
    assert circuit.device("R2").name == "r2"
    for name in ("v(x)", "i(x)", "x", "v(a"):
        with pytest.raises(NetlistError, match="NS2012"):
            circuit.parts(name)


def test_large_circuits_are_assembled_in_linear_time():
    """The bound is loose on purpose: it catches a quadratic step, not a slow machine."""
    text = ["t", "V1 n0 0 SIN(0 1 50)"]
    for k in range(2000):
        text += [f"D{k} n{k} n{k + 1} dm", f"C{k} n{k + 1} 0 1u"]
    text.append(".model dm d(ron=0.1 roff=1g)")
    deck = parse_text("\n".join(text))
    start = time.process_time()
    mna = build(deck).islands[0].assemble()
    assert time.process_time() - start < 20.0
    assert (mna.system.n, mna.system.m) == (2002, 2000)


def test_a_system_is_assembled_anew_under_other_conditions_alone():
    island = build(parse_text(BRIDGE)).islands[0]
    values = {"r1": 2.0}
    first = island.assemble(values=values)
    assert island.assemble(values=dict(values)) is first
    values["r1"] = 4.0
    second = island.assemble(values=values)
    conductances = [in_node_voltages(m).system.G.dense()[1, 1] for m in (first, second)]
    assert conductances == [0.5, 0.25]
    assert island.assemble(50.0, values) is not second
    assert island.assemble(values=values, analysis="dc") is not second
    # times of the run count where a source has them as defaults
    last = island.assemble(values=values)
    assert island.assemble(values=values, tstop=1.0) is last
    pulse = build(parse_text("edge\nV1 a 0 PULSE(0 1)\nR1 a 0 1")).islands[0]
    edges = [pulse.assemble(tstop=t).system.waveforms[0].values[3] for t in (1.0, 2.0)]
    assert edges == [1e-3, 2e-3]
