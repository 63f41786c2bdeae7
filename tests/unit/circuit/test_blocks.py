"""Which blocks of an island are split from which."""

from __future__ import annotations

import pytest

import nsspice
from nsspice.circuit.blocks import Blocks, blocks
from nsspice.solvers.polynomial import Polynomial

RECTIFIER = """rectifier
V1 a 0 SIN(0 10 50)
D1 a b
C1 b 0 1m
R1 b 0 10
"""


def split(*lines: str, first: str = RECTIFIER) -> Blocks:
    return blocks(nsspice.read(first + "\n".join(lines) + "\n"), Polynomial)


def names(found: Blocks) -> list[list[str]]:
    return [[device.name for device in island.devices] for island in found.circuit.islands]


def test_two_sensors_are_two_blocks() -> None:
    found = split("E1 c 0 VALUE={tanh(v(b))}", "C2 c 0 1u", "B1 d 0 V={v(b)^2+v(a)}", "R2 d 0 1")
    assert names(found) == [
        ["v1", "d1", "c1", "r1"],
        ["e1", "c2", "input.v(b)"],
        ["b1", "r2", "input.v(a)", "input.v(b)"],
    ]
    links = {(link.source, link.target, link.signal) for link in found.links}
    assert links == {(0, 1, "v(b)"), (0, 2, "v(a)"), (0, 2, "v(b)")}
    assert found.circuit.node_island["b"] == 0
    assert found.circuit.element_island["b1"] == 2


def test_blocks_that_sense_each_other_stay_together() -> None:
    found = split("B1 c 0 V={tanh(v(b)+v(d))}", "R2 c 0 1", "B2 d 0 V={sin(v(c))}", "R3 d 0 1")
    assert names(found)[1] == ["b1", "r2", "b2", "r3", "input.v(b)"]


def test_currents_are_handed_on_as_well() -> None:
    found = split("F1 0 c D1 2", "DJ c 0 DJ", ".model DJ D(IS=1e-12)", "H1 d 0 V1 1", "R2 d 0 1")
    # what is linear behind it stays where closed forms are
    assert names(found) == [
        ["v1", "d1", "c1", "r1", "h1", "r2"],
        ["f1", "dj", "input.i(d1)"],
    ]


@pytest.mark.parametrize(
    "lines",
    [
        # the block drives the converter back
        ("E1 c 0 VALUE={tanh(v(b))}", "R2 c 0 1", "G1 b 0 c 0 1m"),
        # it is connected to it
        ("DJ b 0 DJ", ".model DJ D(IS=1e-12)"),
        # a smooth reference drives the rectifier
        ("B1 c 0 V={tanh(time*50)}", "R2 c 0 1", "G1 0 b c 0 1"),
        # nothing is smooth
        ("E1 c 0 b 0 2", "R2 c 0 1"),
    ],
)
def test_what_stays_whole(lines: tuple[str, ...]) -> None:
    found = split(*lines)
    assert not found
    assert len(found.circuit.islands) == 1


def test_sources_alone_are_no_block() -> None:
    first = "sources\nV1 a 0 SIN(0 1 50)\nR1 a 0 1\n"
    assert not split("B1 c 0 V={tanh(v(a))}", "C1 c 0 1u", first=first)


def test_kinks_of_the_driving_block_become_pairs() -> None:
    # the limiter of its loop would stay on the tape of the whole
    found = split(
        "B1 x 0 V={limit(10*(5-v(b)),0,3)}",
        "G1 0 b x 0 1",
        "B2 c 0 V={tanh(v(b))}",
        "C2 c 0 1u",
    )
    driving = found.circuit.islands[0]
    assert not any(device.smooth for device in driving.devices)
    assert driving.pair_count == 3
    assert names(found)[1] == ["b2", "c2", "input.v(b)"]
