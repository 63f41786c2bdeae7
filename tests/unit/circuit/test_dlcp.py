import numpy as np
import pytest

from nsspice.circuit import build
from nsspice.circuit.dlcp import DlcpForm, dlcp_form
from nsspice.circuit.normal_tree import normal_tree
from nsspice.errors import RegularityError
from nsspice.netlist import parse_text


def form(text: str) -> DlcpForm:
    return dlcp_form(build(parse_text(f"title\n{text}\n")).islands[0].assemble())


def test_bridge_gives_the_matrices_of_the_thesis():
    C0, L, R = 1e-10, 1e-3, 2e3
    got = form(f"C0 n1 0 {C0}\nL1 n1 0 {L}\nDF1 n1 p\nDR1 0 p\nDF2 n 0\nDR2 n n1\nR1 p n {R}")
    # thesis, example 4.2.4: x = (vC, iL), u = (-vDR1, -vDF2, iDF1, iDR2)
    A = [[0, -1 / C0], [1 / L, 0]]
    B = [[0, 0, -1 / C0, 1 / C0], [0, 0, 0, 0]]
    C = [[0, 0], [0, 0], [-1, 0], [1, 0]]
    D = [[1 / R, 1 / R, -1, 0], [1 / R, 1 / R, 0, -1], [1, 0, 0, 0], [0, 1, 0, 0]]
    order = [got.inputs.index(n) for n in ("-v[dr1]", "-v[df2]", "i[df1]", "i[dr2]")]
    assert got.states == ["v[c0]", "i[l1]"]
    assert pytest.approx(np.array(A), rel=1e-14) == got.A
    assert got.B[:, order] == pytest.approx(np.array(B), rel=1e-14)
    assert got.C[order] == pytest.approx(np.array(C), rel=1e-14)
    assert got.D[np.ix_(order, order)] == pytest.approx(np.array(D), rel=1e-14)
    assert got.E_x.tolist() == [[C0, 0.0], [0.0, L]]


def test_series_zener_circuit():
    """Thesis 4.2.3: L i' = -R i - q/C + v, the two pairs of the Zener diode in series."""
    z = ".model dz d(vfwd=0 vrev=2)"
    got = form(f"L1 0 n1 1\nR1 n1 n2 1\nDZ n2 n3 dz\nC1 n3 0 1\n{z}")
    assert got.states == ["v[c1]", "i[l1]"]
    assert pytest.approx(np.array([[0.0, 1.0], [-1.0, -1.0]])) == got.A
    assert got.inputs == ["-v[dz.fwd]", "i[dz.rev]"]
    assert got.c.tolist() == [0.0, 2.0]
    assert got.D.tolist() == [[0.0, 1.0], [-1.0, 0.0]]


def test_capacitor_loop_with_a_source_has_one_state_and_a_derivative():
    got = form("V1 a 0 SIN(0 1 50)\nC1 a b 1u\nC2 b 0 2u\nR1 b 0 1k")
    assert got.states == ["v[c1]"]
    assert got.E_x[0, 0] == pytest.approx(3e-6)
    assert got.F1[0, 0] == pytest.approx(2 / 3)
    assert got.A[0, 0] == pytest.approx(-1 / (3e-6 * 1e3))


def test_inductor_cut_set_with_a_source():
    got = form("I1 0 a SIN(0 1 50)\nL1 a b 1m\nL2 a 0 2m\nR1 b 0 3\nR2 a b 1e3")
    assert len(got.states) == 2
    cut = form("I1 0 a SIN(0 1 50)\nL1 a b 1m\nL2 a 0 2m\nR1 b 0 3")
    assert cut.states == ["i[l2]"]
    assert cut.E_x[0, 0] == pytest.approx(3e-3)
    assert abs(cut.F1[0, 0]) == pytest.approx(1 / 3)


def test_perfect_transformer_has_the_magnetising_current_as_state():
    text = (
        "V1 a 0 10\nL1 a s 1m\nS1 s 0 g 0 m\nV2 g 0 1\nL2 0 q 4m\nK1 L1 L2 {}\nD1 q o\n"
        "C1 o 0 1u\nR1 o 0 10\n.model m sw(vt=.5)"
    )
    got = form(text.format(1))
    assert got.states == ["v[c1]", "i[l1]+2*i[l2]"]
    assert got.E_x == pytest.approx(np.diag([1e-6, 1e-3]))
    assert got.inputs == ["-v[s1]", "i[d1]"]
    # flyback: both off -> the diode carries half the magnetising current into C1
    assert pytest.approx(np.array([[0.0, 1e6], [1e3, 0.0]])) == got.B
    assert pytest.approx(np.array([[0.0, -2.0], [2.0, 0.0]])) == got.D
    loose = form(text.format(0.5))
    assert loose.states == ["v[c1]", "i[l1]", "i[l2]"]
    assert loose.E_x[1, 2] == pytest.approx(0.5 * 2e-3)


def test_three_perfect_windings():
    text = "V1 a 0 1\nR1 a b 1\nL1 b 0 1m\nL2 c 0 4m\nR2 c 0 1\nL3 d 0 9m\nC1 d 0 1u\nK1 L1 L2 L3 1"
    got = form(text)
    assert got.states == ["v[c1]", "i[l1]+2*i[l2]+3*i[l3]"] or len(got.states) == 2
    energy = got.E_x.diagonal()
    assert energy.min() > 0.0


def test_a_capacitor_tied_to_a_multiplier_is_named():
    text = "V1 a 0 1\nR1 a b 1\nD1 b 0\nE1 c 0 b 0 2\nC1 c 0 1u\nF1 0 x E1 1\nC2 x 0 1u"
    with pytest.raises(RegularityError, match="NS2061") as caught:
        form(text)
    assert "e1" in str(caught.value)


def test_an_undetermined_circuit_is_named():
    text = "F1 a 0 V1 1\nV1 b 0 1\nR1 b 0 1\nC1 b 0 1u\nG1 a 0 b 0 1"
    with pytest.raises(RegularityError, match="NS2060") as caught:
        form(text)
    assert "f1" in str(caught.value)


def test_normal_tree_is_deterministic_and_prefers_grounded_diodes():
    text = "t\nD1 a b\nD2 b c\nD3 c 0\nR1 a 0 1\nV1 a c 1\nV2 a c 1\n"
    mna = build(parse_text(text)).islands[0].assemble()
    tree = normal_tree(mna)
    assert [b.device.name for b in tree.chosen("P", True)] == ["d1", "d3"]
    assert [b.device.name for b in tree.redundant] == ["v2"]
    assert tree == normal_tree(mna)


def test_floating_parts_get_a_root():
    mna = build(parse_text("t\nR1 a b 1\nC1 a b 1u\nR2 c 0 1\n")).islands[0].assemble()
    assert normal_tree(mna).roots == (0,)
