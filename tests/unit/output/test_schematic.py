"""Schematics: what is drawn connected is connected in the deck, and nothing else."""

from __future__ import annotations

import math
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

import nsspice
from nsspice.output.schematic import schematic
from nsspice.output.schematic.conduction import conducting_at

NETLISTS = Path(__file__).parents[3] / "netlists"
SVG = "{http://www.w3.org/2000/svg}"
THREE = frozenset("mqjz")
SIX = [
    "converters/buck", "converters/boost", "rectifiers/full_bridge_capacitor", "converters/flyback",
    "steady/dual_active_bridge", "converters/npc_leg",
]  # fmt: skip

Point = tuple[float, float]


def wires(root: ElementTree.Element) -> list[tuple[Point, Point]]:
    """Return the straight pieces of all wires; the symbol of ground is written in small letters."""
    found = []
    for path in root.iter(f"{SVG}path"):
        if path.get("class") != "wires":
            continue
        x = y = 0.0
        for letter, text in re.findall(r"([MHVmhv])\s*([-\d., ]+)", path.get("d", "")):
            numbers = [float(n) for n in re.findall(r"-?[\d.]+", text)]
            if letter == "M":
                x, y = numbers
            elif letter in "HV":
                new = (numbers[0], y) if letter == "H" else (x, numbers[0])
                found.append(((x, y), new))
                x, y = new
    return found


def terminals(root: ElementTree.Element) -> dict[str, tuple[Point, Point]]:
    """Return where the first and the second end of each part's symbol are."""
    found = {}
    for group in root.iter(f"{SVG}g"):
        name = group.get("data-name")
        if name is None:
            continue
        transform = group.find(f"{SVG}g").get("transform")  # type: ignore[union-attr]
        x, y = map(float, re.findall(r"translate\(([-\d.]+) ([-\d.]+)\)", transform)[0])
        turned = re.findall(r"rotate\(([-\d.]+)\)", transform)
        angle = math.radians(float(turned[0]) if turned else 0.0)
        # (0, -30), turned clockwise as SVG does
        dx, dy = 30.0 * math.sin(angle), -30.0 * math.cos(angle)
        found[name] = ((x + dx, y + dy), (x - dx, y - dy))
    return found


def on(p: Point, piece: tuple[Point, Point]) -> bool:
    (ax, ay), (bx, by) = piece
    near = 1e-6
    return (
        min(ax, bx) - near <= p[0] <= max(ax, bx) + near
        and min(ay, by) - near <= p[1] <= max(ay, by) + near
    )


def drawn_nets(root: ElementTree.Element) -> dict[tuple[str, int], int]:
    """Return a number for each end of each part, the same where wires join them.

    An end of a wire that touches another wire is a joint; wires that cross are not joined.
    """
    pieces = wires(root)
    home = list(range(len(pieces)))

    def top(k: int) -> int:
        while home[k] != k:
            k = home[k]
        return k

    for j, one in enumerate(pieces):
        for k, other in enumerate(pieces):
            if j != k and any(on(end, other) for end in one):
                home[top(j)] = top(k)
    found = {}
    for name, ends in terminals(root).items():
        for k, end in enumerate(ends):
            touching = {top(j) for j, piece in enumerate(pieces) if on(end, piece)}
            assert len(touching) == 1, (name, k)
            found[name, k] = touching.pop()
    return found


def decks() -> list[Path]:
    return sorted(p for p in NETLISTS.rglob("*.net") if p.with_suffix(".expect.toml").exists())


def test_every_deck_of_the_collection_is_drawn_as_it_is_connected() -> None:
    compared = 0
    for path in decks():
        try:
            circuit = nsspice.read(path)
        except nsspice.NsspiceError:
            continue
        elements = {e.name: e for e in circuit.deck.elements if len(e.nodes) > 1}
        if not 1 < len(elements) <= 40:
            continue
        root = ElementTree.fromstring(schematic(circuit))
        drawn = drawn_nets(root)
        nets: dict[int, set[str]] = {}
        where: dict[str, set[int]] = {}
        for (name, k), number in drawn.items():
            e = elements[name]
            second = 2 if e.letter in THREE and len(e.nodes) > 2 else 1
            net = e.nodes[0 if k == 0 else second]
            nets.setdefault(number, set()).add(net)
            where.setdefault(net, set()).add(number)
        assert all(len(found) == 1 for found in nets.values()), (path.name, nets)
        # one wire for each net; ground has one for each part of the circuit
        assert all(len(found) == 1 for net, found in where.items() if net != "0"), path.name
        shorted = {n for n, e in elements.items() if e.nodes[0] == e.nodes[1]}
        assert {name for name, _ in drawn} >= set(elements) - shorted, path.name
        compared += 1
    assert compared > 60


@pytest.mark.parametrize("name", SIX)
def test_symbols_and_names_do_not_overlap(name: str) -> None:
    root = ElementTree.fromstring(schematic(nsspice.read(NETLISTS / f"{name}.net")))
    middles = [(0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])) for a, b in terminals(root).values()]
    for k, (x, y) in enumerate(middles):
        for u, v in middles[:k]:
            assert abs(x - u) >= 60.0 or abs(y - v) >= 60.0
    # a wire may pass a symbol only at a distance
    for x, y in middles:
        for (ax, ay), (bx, by) in wires(root):
            if ax == bx and abs(ax - x) < 15.0 and ax != x:
                raise AssertionError((ax, ay, by))
            if ay == by and min(ax, bx) < x < max(ax, bx):
                assert abs(ay - y) >= 30.0


def test_rails_are_above_ground_and_midpoints_between() -> None:
    root = ElementTree.fromstring(schematic(nsspice.read(NETLISTS / "converters/buck.net")))
    height = {
        t.text: float(t.get("y", "0")) for t in root.iter(f"{SVG}text") if t.get("class") == "net"
    }
    assert height["in"] < height["sw"] == height["out"]
    ends = terminals(root)
    lowest = max(y for pair in ends.values() for _, y in pair)
    assert height["sw"] < lowest
    # the inductor lies between the switch node and the output, the load is on the right
    (a, b) = ends["l1"]
    assert a[1] == b[1]
    assert ends["vin"][0][0] < ends["s1"][0][0] < a[0] < b[0] < ends["rload"][0][0]


def test_who_conducts_is_coloured(tmp_path: Path) -> None:
    """A duty of one half at 100 kHz: the switch in the first 5 us of a period, then the diode."""
    circuit = nsspice.read(NETLISTS / "converters" / "buck.net")
    solution = circuit.run()[0]
    for time, state in ((2e-6, True), (7e-6, False), (12e-6, True)):
        on_ = conducting_at(solution, time)
        assert on_ == {"s1": state, "d1": not state}
        root = ElementTree.fromstring(schematic(circuit, on_))
        classes = {g.get("data-name"): g.get("class") for g in root.iter(f"{SVG}g")}
        assert classes["s1"] == ("part on" if state else "part off")
        assert classes["d1"] == ("part off" if state else "part on")
        assert classes["l1"] == "part"


def test_a_schematic_cannot_contain_what_a_deck_says() -> None:
    circuit = nsspice.read("<script>x</script>\nV1 a<b 0 1\nR1 a<b 0 1\n.op\n")
    text = schematic(circuit)
    ElementTree.fromstring(text)
    assert "<script>" not in text
