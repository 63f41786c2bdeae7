import pytest

from nsspice.circuit import build
from nsspice.errors import TopologyError
from nsspice.netlist import parse_text


def warned(text: str) -> list[str]:
    return [w.code for w in build(parse_text(f"title\n{text}\n")).warnings]


def refused(text: str) -> TopologyError:
    with pytest.raises(TopologyError) as caught:
        build(parse_text(f"title\n{text}\n"))
    return caught.value


def test_no_ground():
    error = refused("V1 a b 5\nR1 a b 1")
    assert error.code == "NS2020"
    assert len(error.diagnostics) == 1


def test_contradicting_sources_in_parallel():
    error = refused("V1 a 0 5\nR1 a 0 1\nV2 a 0 3")
    assert error.code == "NS2021"
    assert sorted(error.elements) == ["v1", "v2"]
    text = str(error)
    for word in ("v1 (line 2)", "v2 (line 4)", "nodes a and 0", "3 V", "5 V"):
        assert word in text
    assert error.diagnostics[0].span.line == 4


def test_loop_through_shorts_and_other_sources():
    error = refused("V1 a 0 5\nR1 a b 0\nV2 c b 1\nV3 c 0 5\nR2 c 0 1")
    assert sorted(error.elements) == ["r1", "v1", "v2", "v3"]


def test_every_contradiction_is_reported():
    error = refused("V1 a 0 5\nV2 a 0 3\nV3 b 0 1\nV4 b 0 2\nR1 a b 1\nI1 c 0 1\nI2 c 0 2")
    assert [d.code for d in error.diagnostics] == ["NS2021", "NS2021", "NS2023"]


@pytest.mark.parametrize(
    "text",
    [
        "V1 a 0 5\nV2 a 0 5",
        "V1 a 0 SIN(0 1 50)\nV2 b a 5\nV3 b 0 SIN(5 1 50)",
        "V1 a 0 SIN(0 1 50)\nV2 0 a SIN(0 -1 50)",
        "V1 a 0 PULSE(0 5 0 0 0 1m 2m)\nV2 0 a PULSE(0 -5 0 0 0 1m 2m)",
        "V1 a 0 PWL(0 5 1 5)\nV2 a 0 5",
        "V1 a 0 5\nE1 b 0 a 0 2\nV2 b 0 10",
        "V1 a 0 0\nR9 a 0 0",
        "I1 0 b 1\nI2 b 0 1",
    ],
)
def test_redundant_but_consistent_sources_are_accepted(text):
    build(parse_text(f"title\n{text}\nR1 a 0 1\n.tran 1m 10m\n"))  # raises nothing


@pytest.mark.parametrize(
    "text",
    [
        "V1 a 0 SIN(0 1 50)\nV2 a 0 SIN(0 1 60)",
        "V1 a 0 SIN(0 1 50)\nV2 a 0 0",
        "V1 a 0 5\nE1 b 0 a 0 2\nV2 b 0 9",
        "V1 a a 5",
    ],
)
def test_loops_that_contradict_at_some_time(text):
    assert refused(f"{text}\nR1 a 0 1\n.tran 1m 10m").code == "NS2021"


def test_a_feedback_loop_of_controlled_sources_is_left_to_the_solver():
    assert warned("V1 a 0 5\nE1 a 0 b 0 2\nR1 b 0 1\nR2 b a 1") == []


def test_inductor_across_a_source_needs_uic():
    text = "V1 a 0 5\nL1 a b 1m\nL2 b 0 1m\nR1 a 0 1\n"
    error = refused(text + ".tran 1u 1m")
    assert error.code == "NS2022"
    assert sorted(error.elements) == ["l1", "l2", "v1"]
    assert "uic" in error.diagnostics[0].hint
    assert refused(text + ".op").code == "NS2022"
    assert warned(text + ".tran 1u 1m uic") == []
    assert warned(text) == []
    assert warned("V1 a 0 SIN(0 5 50)\nL1 a 0 1m\n.tran 1u 1m") == []


def test_capacitor_charged_by_a_current_source_needs_uic():
    text = "I1 0 a 1m\nC1 a 0 1u\n"
    error = refused(text + ".tran 1u 1m")
    assert error.code == "NS2024"
    assert sorted(error.elements) == ["c1", "i1"]
    assert "node a" in str(error)
    assert warned(text + ".tran 1u 1m uic") == []


def test_current_without_a_way_out():
    error = refused("I1 0 a 1\nI2 a 0 2\nR1 a b 1\nR2 c 0 1")
    assert error.code == "NS2023"
    assert "nodes a, b" in str(error)
    assert sorted(error.elements) == ["i1", "i2"]


def test_a_controlled_source_may_take_the_current():
    build(parse_text("t\nI1 0 a 1\nG1 a 0 a 0 2\nR1 b 0 1\n"))  # raises nothing


def test_a_swept_source_is_not_judged_by_its_card():
    assert warned("V1 a 0 5\nV2 a 0 3\nR1 a 0 1\n.dc V2 5 5 1") == []


@pytest.mark.parametrize(
    "text",
    [
        "V1 a 0 5\nC1 a 0 1u\nC2 a b 1u\nC3 b 0 1u\nR1 b 0 1",
        "I1 0 a 1\nL1 a b 1m\nL2 b 0 1m\nR1 a 0 1",
        "V1 a 0 5\nD1 a b\nD2 b 0 dz\nR1 a 0 1\n.model dz d(vrev=5)",
        "D1 a 0\nD2 a 0\nD3 0 a\nR1 a 0 1",
        "V1 a 0 5\nS1 a b a 0 sm\nL1 b 0 1m\nD1 0 b\n.model sm sw(vt=1)",
    ],
)
def test_what_ideal_elements_make_legal(text):
    assert warned(text + "\n.tran 1u 1m") == []


def test_dangling_nodes_get_a_hint():
    circuit = build(parse_text("t\nV1 input 0 5\nR1 input output 1\nR2 outptu 0 1\n"))
    assert [w.code for w in circuit.warnings] == ["NS2050", "NS2050"]
    assert "r1" in circuit.warnings[0].message
    assert circuit.warnings[0].hint == "did you mean outptu?"
    assert circuit.warnings[0].span.line == 3


def test_sensed_nodes_do_not_dangle_but_must_be_driven():
    base = "V1 a 0 5\nS1 a b ctl 0 sm\nR1 b 0 1\n.model sm sw(vt=1)\n"
    assert warned(base + "V2 ctl 0 1") == []
    error = refused(base + "V2 ctrl 0 1")
    assert error.code == "NS2025"
    assert error.diagnostics[0].hint == "did you mean ctrl?"


def test_floating_parts_are_named():
    text = "V1 a 0 SIN(0 1 50)\nL1 a 0 1\nL2 c d 1\nK1 L1 L2 1\nD1 c e\nR1 e d 1"
    circuit = build(parse_text(f"t\n{text}\n"))
    assert [w.code for w in circuit.warnings] == ["NS2051"]
    assert "c, d, e" in circuit.warnings[0].message
    assert circuit.warnings[0].span.line == 4
