import pytest

from nsspice.circuit import ProblemClass, build
from nsspice.netlist import parse_text


def circuit(text: str):
    return build(parse_text(f"title\n{text}\n"))


def parts(text: str) -> list[list[str]]:
    return [[d.name for d in island.devices] for island in circuit(text).islands]


def test_ground_does_not_join():
    assert parts("R1 a 0 1\nR2 b 0 1\nR3 a 0 1") == [["r1", "r3"], ["r2"]]


@pytest.mark.parametrize(
    "coupling",
    [
        "E1 b 0 a 0 2",
        "G1 b 0 a 0 2",
        "F1 b 0 V1 2",
        "H1 b 0 V1 2",
        "S1 b 0 a 0 sm\n.model sm sw(vt=1)",
        "W1 b 0 V1 wm\n.model wm csw(it=1)",
        "L1 a 0 1m\nL2 b 0 1m\nK1 L1 L2 0.5",
    ],
)
def test_sensing_and_coupling_join(coupling):
    base = "V1 a 0 1\nR1 b 0 1\nR2 a 0 1"
    assert len(parts(base)) == 2
    assert len(parts(f"{base}\n{coupling}")) == 1


def test_elements_on_ground_only_join_the_first_island():
    assert parts("R9 0 0 1\nR1 a 0 1\nR2 b 0 1") == [["r9", "r1"], ["r2"]]
    assert parts("R9 0 0 1\nR8 0 0 1") == [["r9", "r8"]]


def test_a_thousand_islands():
    text = "\n".join(
        f"V{k} a{k} b{k} SIN(0 1 50)\nD{k}a a{k} p{k}\nD{k}b b{k} p{k}\nD{k}c n{k} a{k}\n"
        f"D{k}d n{k} b{k}\nR{k} p{k} n{k} 1k\nRG{k} n{k} 0 1"
        for k in range(1000)
    )
    islands = circuit(text).islands
    assert len(islands) == 1000
    assert {(len(i.nodes), i.pair_count) for i in islands} == {(4, 4)}


@pytest.mark.parametrize(
    ("text", "kind", "words"),
    [
        ("R1 a 0 1\nV1 a 0 1", ProblemClass.LINEAR_ALGEBRAIC, "no element stores energy"),
        ("R1 a 0 1\nD1 a 0", ProblemClass.LCP, "d1 is set-valued"),
        ("R1 a 0 1\nC1 a 0 1u", ProblemClass.LINEAR_DAE, "c1 stores energy"),
        ("L1 a 0 1\nD1 a 0\nD2 0 a", ProblemClass.DLCP, "d1 and d2 are set-valued"),
        ("R1 a 0 1\nD1 a 0 dm\n.model dm d(ron=5 roff=6)", ProblemClass.LCP, "d1"),
    ],
)
def test_classes(text, kind, words):
    island = circuit(text).islands[0]
    assert island.problem_class is kind
    assert words in island.reason


def test_long_lists_are_cut():
    text = "\n".join(f"D{k} a 0" for k in range(9)) + "\nR1 a 0 1"
    assert "d0, d1, d2 and 6 more are set-valued" in circuit(text).islands[0].reason
