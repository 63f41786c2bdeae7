"""Each law's stamp, output current and parameters, by hand on one or two elements."""

import math

import numpy as np
import pytest
from oracle.node_voltages import in_node_voltages

from nsspice.circuit import MnaSystem, build
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text
from nsspice.problems.descriptor import Switch


def assembled(text: str, **conditions: object) -> MnaSystem:
    circuit = build(parse_text(f"title\n{text}\n"))
    assert len(circuit.islands) == 1
    return in_node_voltages(circuit.islands[0].assemble(**conditions))


def codes(text: str) -> list[str]:
    with pytest.raises(NetlistError) as caught:
        build(parse_text(f"title\n{text}\n"))
    return [d.code for d in caught.value.diagnostics]


def warned(text: str) -> list[str]:
    return [w.code for w in build(parse_text(f"title\n{text}\n")).warnings]


def test_resistor_stamp_and_current():
    mna = assembled("R1 a b 4\nR2 b 0 2")
    assert mna.system.G.dense().tolist() == [[0.25, -0.25], [-0.25, 0.75]]
    assert mna.functional("i(r1)").z == ((0, 0.25), (1, -0.25))


def test_zero_resistor_is_a_branch_and_infinite_one_is_open():
    mna = assembled("R1 a 0 0\nR2 a 0 1")
    assert mna.unknowns == ["v(a)", "i(r1)"]
    assert mna.system.G.dense().tolist() == [[1.0, 1.0], [-1.0, 0.0]]
    opened = assembled("R1 a 0 1\nR2 a 0 1", values={"r2": math.inf})
    assert opened.system.G.dense().tolist() == [[1.0]]
    assert opened.functional("i(r2)").z == ()


def test_resistor_temperature_multiplier_and_model():
    text = "R1 a 0 rm 100 m=2\n.model rm r(tc1=0.01 tc2=0.001)"
    value = assembled(text, temperature=37.0).system.G.dense()[0, 0]
    assert value == pytest.approx(2 / (100 * (1 + 0.1 + 0.1)))
    assert assembled("R1 a 0 100 tc1=0.01 temp=37").system.G.dense()[0, 0] == pytest.approx(1 / 110)
    given = "R1 a 0 rm scale=2\n.model rm r(r=50)"
    assert assembled(given).system.G.dense()[0, 0] == pytest.approx(1 / 100)


def test_negative_resistor_is_warned_about():
    assert warned("R1 a 0 -5\nR2 a 0 1") == ["NS2053"]


def test_capacitor_and_inductor_stamps():
    mna = assembled("C1 a 0 2u m=3 ic=4\nL1 a 0 5m ic=-1")
    assert mna.system.E.dense() == pytest.approx(np.diag([6e-6, 5e-3]))
    assert mna.system.G.dense().tolist() == [[0.0, 1.0], [-1.0, 0.0]]
    assert mna.functional("i(c1)").dz == ((0, pytest.approx(6e-6)),)
    assert mna.functional("i(l1)").z == ((1, 1.0),)
    assert mna.initial_charges() == pytest.approx([24e-6, -5e-3])
    assert [(s.name, s.value, s.ic) for s in mna.capacitors] == [("c1", pytest.approx(6e-6), 4.0)]
    assert [(s.name, s.value, s.ic) for s in mna.inductors] == [("l1", 5e-3, -1.0)]
    assert mna.system.row_kind.tolist() == [0, 1]


def test_wrong_capacitors_and_inductors():
    assert codes("C1 a 0 -1u\nL1 a 0 -1m\nR1 a 0 1") == ["NS2005", "NS2005"]
    assert warned("C1 a 0 0\nL1 a b 0\nR1 b 0 1\nR2 a 0 1") == ["NS2054", "NS2054"]


def test_initial_charges_use_node_voltages_where_no_ic_is_given():
    mna = assembled("C1 a b 1u\nC2 b 0 2u ic=1\nR1 a 0 1\nL1 b 0 1m")
    charges = mna.initial_charges({"a": 5.0, "v(b)": 2.0, "i(l1)": 3.0})
    assert charges == pytest.approx([3e-6, -3e-6 + 2e-6, 3e-3])


def test_coupled_inductors():
    mna = assembled("L1 a 0 1m ic=2\nL2 b 0 4m\nK1 L1 L2 0.5\nR1 a b 1")
    assert mna.system.E.dense()[2:, 2:] == pytest.approx(np.array([[1e-3, 1e-3], [1e-3, 4e-3]]))
    assert mna.initial_charges()[2:] == pytest.approx([2e-3, 2e-3])


def test_wrong_couplings():
    text = "L1 a 0 1m\nR1 a 0 1\nC1 a 0 1u\n"
    deck = parse_text(f"t\n{text}L2 a 0 1m\nK1 L1 L2 0.5\n")
    deck.elements = [e for e in deck.elements if e.name != "l2"]
    with pytest.raises(NetlistError, match="couples l2, which does not exist"):
        build(deck)
    assert codes(text + "K1 L1 C1 0.5") == ["NS2010"]
    assert codes(text + "L2 a 0 1m\nK1 L1 L2 1.5") == ["NS2010"]
    three = "L1 a 0 1\nL2 a 0 1\nL3 a 0 1\nR1 a 0 1\n"
    assert codes(three + "K1 L1 L2 1\nK2 L2 L3 1\nK3 L1 L3 -1") == ["NS2010"]
    assert warned(three + "K1 L1 L2 L3 1") == []


def test_sources_and_shared_columns():
    mna = assembled("V1 a 0 5\nV2 b 0 5\nI1 a b 5\nR1 a b 1\nV3 c b 0\nR2 c 0 1")
    assert len(mna.system.waveforms) == 1
    assert mna.system.S.dense()[:, 0].tolist() == [-5 / 5, 1.0, 0.0, -1.0, -1.0, 0.0]
    assert mna.functional("i(i1)").u == ((0, 1.0),)
    assert mna.functional("i(v1)").z == ((3, 1.0),)


def test_voltage_controlled_sources():
    mna = assembled("E1 a 0 b 0 3\nG1 b 0 a 0 2\nR1 a b 1")
    expected = [[1.0, -1.0, 1.0], [2.0 - 1.0, 1.0, 0.0], [-1.0, 3.0, 0.0]]
    assert mna.system.G.dense().tolist() == expected
    assert mna.functional("i(g1)").z == ((0, 2.0),)
    assert mna.functional("i(e1)").z == ((2, 1.0),)


def test_current_controlled_sources_read_any_current():
    mna = assembled("V1 a 0 1\nD1 a b\nC1 b 0 1u\nF1 0 c D1 2\nH1 d 0 C1 3\nR1 c 0 1\nR2 d 0 1")
    system = mna.system
    c, d, h1, c1 = (mna.unknowns.index(name) for name in ("v(c)", "v(d)", "i(h1)", "i(c1)"))
    assert system.A.dense()[c, 0] == -2.0
    assert system.G.dense()[h1, c1] == 3.0
    assert system.G.dense()[h1, d] == -1.0
    assert mna.functional("i(f1)").lam == ((0, 2.0),)


def test_wrong_controlling_elements():
    base = "V1 a 0 1\nR1 a 0 1\n"
    deck = parse_text(f"t\n{base}V12 b 0 1\nF1 a 0 V12 1\n")
    deck.elements = [e for e in deck.elements if e.name != "v12"]
    with pytest.raises(NetlistError, match="current of v12, which does not exist") as caught:
        build(deck)
    assert caught.value.diagnostics[0].hint == "did you mean v1?"
    assert codes(base + "F1 a 0 V1 1\nF2 a 0 F1 1") == ["NS2006"]


def test_ideal_diode():
    mna = assembled("D1 a 0\nR1 a 0 1")
    system = mna.system
    assert system.A.dense().tolist() == [[1.0]]
    assert system.B.dense().tolist() == [[1.0]]
    assert system.D.dense().tolist() == [[0.0]]
    assert system.q.tolist() == [0.0]
    assert mna.functional("i(d1)").lam == ((0, 1.0),)


def test_diode_with_all_effects():
    model = ".model dm d(Vfwd=0.7 Ron=1 Roff=100 Vrev=5 Rrev=3)"
    mna = assembled(f"D1 a b dm area=2\nR1 a b 1\nR2 b 0 1\n{model}")
    system = mna.system
    assert mna.pairs == ["d1.fwd", "d1.rev"]
    assert mna.pair_elements == ["d1", "d1"]
    assert system.q.tolist() == [0.7, 5.0]
    assert system.A.dense().tolist() == [[1.0, -1.0], [-1.0, 1.0]]
    assert system.B.dense().tolist() == system.A.dense().T.tolist()
    half = (0.5 * 50 / 49.5, 1.5 * 50 / 48.5)
    assert system.D.dense() == pytest.approx(np.diag(half))
    assert system.G.dense() == pytest.approx(np.array([[1.02, -1.02], [-1.02, 2.02]]))
    current = mna.functional("i(d1)")
    assert current.lam == ((0, 1.0), (1, -1.0))
    assert current.z == ((0, 0.02), (1, -0.02))


def test_breakdown_resistance_defaults_to_ron():
    mna = assembled("D1 a 0 dm\nR1 a 0 1\n.model dm d(ron=2 vrev=5)")
    assert mna.system.D.dense().tolist() == [[2.0, 0.0], [0.0, 2.0]]


@pytest.mark.parametrize(
    ("model", "code", "word"),
    [
        ("d(vfdw=1 ron=1)", "NS2003", "did you mean vfwd?"),
        ("d(ron=-1)", "NS2005", "ron"),
        ("d(ron=5 roff=1)", "NS2005", "roff"),
        ("d(vfwd=1 vrev=-2)", "NS2005", "vrev"),
        ("d(ron=1 ilimit=3)", "NS2008", "ilimit"),
        ("d(ron=1 epsilon=0.1)", "NS2008", "epsilon"),
        ("d(ron=1 cjo=1p)", "NS2008", "capacitor"),
        ("d(is=0)", "NS2005", "is=0"),
        ("d(v=foo)", "NS2005", "V={expression of i}"),
        ("d(fc=1)", "NS2005", "fc=1 must be >= 0 and < 1"),
        ("sw(vt=1)", "NS2002", "d1"),
    ],
)
def test_wrong_diode_models(model, code, word):
    with pytest.raises(NetlistError) as caught:
        build(parse_text(f"t\nD1 a 0 dm\nR1 a 0 1\n.model dm {model}\n"))
    assert caught.value.code == code
    assert word in str(caught.value)


def test_junction_parameters_beside_set_valued_ones_are_listed():
    text = "D1 a 0 dm\nD2 a 0 dm\nR1 a 0 1\n.model dm d(ron=1 is=1e-14 n=1.1 epsilon=0)"
    circuit = build(parse_text(f"t\n{text}\n"))
    assert [w.code for w in circuit.warnings] == ["NS2052"]
    assert "is, n" in circuit.warnings[0].message


def test_effects_on_the_element_line_go_before_the_model():
    mna = assembled("D1 a 0 dm vfwd=1\nD2 a 0 ron=2\nR1 a 0 1\n.model dm d(vfwd=0.7 ron=3)")
    assert mna.system.q.tolist() == [1.0, 0.0]
    assert mna.system.D.dense().tolist() == [[3.0, 0.0], [0.0, 2.0]]
    assert codes("D1 a 0 ron=-2\nR1 a 0 1") == ["NS2005"]
    assert codes("D1 a 0 dm vfwd=1\nR1 a 0 1\n.model dm d(is=1f)") == ["NS2005"]


def test_ideal_switch():
    mna = assembled("S1 a 0 c 0 sm\nR1 a 0 1\nV1 c a 0\n.model sm sw(vt=2 vh=0.5)")
    assert mna.pairs == ["s1"]
    assert mna.system.switches == (Switch(0, ((1, 1.0),), 2.5, 1.5, False, False),)
    assert mna.system.D.dense().tolist() == [[0.0]]


def test_switch_resistances_are_exact_in_both_states():
    mna = assembled("S1 a 0 c 0 sm on\nV1 c a 0\n.model sm sw(vt=2 ron=0.5 roff=100)")
    series = mna.system.D.dense()[0, 0]
    leak = mna.system.G.dense()[0, 0]
    assert 1 / (leak + 1 / series) == pytest.approx(0.5, rel=1e-15)
    assert leak == 1 / 100
    assert mna.system.switches[0].closed is True
    assert mna.functional("i(s1)").lam == ((0, 1.0),)


def test_switch_that_conducts_while_off():
    mna = assembled("S1 a 0 c 0 sm\nV1 c a 0\n.model sm sw(vt=2 ron=100 roff=0.5)")
    switch = mna.system.switches[0]
    assert switch.inverted
    assert switch.closed
    assert mna.system.G.dense()[0, 0] == 1 / 100


def test_vswitch_becomes_hysteresis_with_a_warning():
    text = "S1 a 0 c 0 sm\nV1 c a 0\nR1 a 0 1\n.model sm vswitch(von=3 voff=1 ron=1 roff=1meg)"
    switch = assembled(text).system.switches[0]
    assert (switch.on_above, switch.off_below, switch.inverted) == (3.0, 1.0, False)
    assert warned(text) == ["NS2055"]
    swapped = assembled(text.replace("von=3 voff=1", "von=1 voff=3")).system.switches[0]
    assert (swapped.on_above, swapped.off_below, swapped.inverted) == (3.0, 1.0, True)


def test_a_negative_hysteresis_blends_in_ltspice_and_becomes_one_with_a_warning():
    text = "S1 a 0 c 0 sm\nV1 c a 0\nR1 a 0 1\n.model sm sw(vt=2 vh=-0.5 ron=1 roff=1meg)"
    switch = assembled(text).system.switches[0]
    assert (switch.on_above, switch.off_below) == (2.5, 1.5)
    assert warned(text) == ["NS2055"]


def test_current_switch_by_a_source_and_by_a_diode():
    text = "V1 a 0 1\nD1 a b\nR1 b 0 1\nW1 b 0 {}\n.model wm csw(it=1m ih=0.1m)"
    mna = assembled(text.format("V1 wm"))
    assert mna.system.switches[0].control == ((mna.unknowns.index("i(v1)"), 1.0),)
    sensed = assembled(text.format("D1 wm"))
    row = sensed.unknowns.index("i(d1)")
    assert sensed.system.switches[0].control == ((row, 1.0),)
    assert sensed.system.G.dense()[row, row] == 1.0
    assert sensed.system.A.dense()[row].tolist() == [-1.0, 0.0]
    assert sensed.system.row_kind[row] == 0


def test_wrong_switch_models():
    base = "R1 a 0 1\nV1 c a 0\nS1 a 0 c 0 sm\n.model sm "
    assert codes(base + "vswitch(von=1 vhon=0.5 voff=0 vhoff=0)") == ["NS2008", "NS2008"]
    assert codes(base + "sw(vtt=1)") == ["NS2003"]
    assert codes(base + "sw(ron=0 roff=0)") == ["NS2005"]
    assert codes(base + "csw(it=1)") == ["NS2002"]


def test_nonlinear_stores_are_refused_by_name():
    text = "V1 a 0 1\nC1 a 0 {1u*v(b)}\nL1 a b {1m*time}\nR1 b 0 1\n"
    assert codes(text) == ["NS2009", "NS2009"]


def test_every_error_of_a_deck_is_reported_at_once():
    text = (
        "F1 a 0 F2 1\nF2 a 0 F1 1\nC1 a 0 -1\nL1 a 0 1 nt=3\nD1 a 0 dm\n.model dm d(ron=1 vfdw=2)\n"
    )
    assert sorted(codes(text)) == ["NS2003", "NS2005", "NS2006", "NS2006", "NS2008"]
