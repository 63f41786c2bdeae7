"""Columns and rows: the order of columns that leaves short wires and few crossings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .levels import Order, columns_of
from .parts import GROUND, Part

_CROSSING, _STANDING, _APART = 3.0, 5.0, 4.0
_ROWS = 2.0
_SOURCE, _LOAD = 0.4, 0.25  # pull to the left, and to the right
_SEARCHED = 34  # columns: beyond that only neighbours are exchanged


@dataclass
class Placement:
    """Where parts and nets are, in columns and rows.

    Parameters
    ----------
    column : dict of Part to int
    row : dict of str to int
        Of each net, from the bottom.
    ends : dict of str to (float, float)
        First and last column of each net's wire.
    lying : dict of Part to (str, str)
        Parts drawn lying, with the nets at their left and right.
    cost : float
    """

    column: dict[Part, int]
    row: dict[str, int]
    ends: dict[str, tuple[float, float]]
    lying: dict[Part, tuple[str, str]]
    cost: float


def place(parts: Sequence[Part]) -> Placement:
    """Return the best placement that a search by moving single columns finds."""
    levels = Order(parts).levels()
    stacks = _from_sources(columns_of(parts, levels))
    best = _evaluate(stacks, levels)
    improved = True
    while improved:
        improved = False
        for k in range(len(stacks)):
            near = range(k - 1, k + 2) if len(stacks) > _SEARCHED else range(len(stacks))
            for j in near:
                if j == k or not 0 <= j < len(stacks):
                    continue
                order = [*stacks[:k], *stacks[k + 1 :]]
                order.insert(j, stacks[k])
                tried = _evaluate(order, levels)
                if tried.cost < best.cost - 1e-9:
                    stacks, best, improved = order, tried, True
                    break
    return best


def _from_sources(stacks: list[list[Part]]) -> list[list[Part]]:
    """Return the columns in the order in which they are reached from a source."""
    todo = sorted(stacks, key=lambda s: s[0].letter not in "vi")
    found: list[list[Part]] = []
    known: set[str] = set()
    while todo:
        nets = [{n for p in s for n in (p.high, p.low, *p.coupled)} - {GROUND} for s in todo]
        k = next((k for k, n in enumerate(nets) if n & known), 0)
        known |= nets[k] | {p.name for p in todo[k]}
        found.append(todo.pop(k))
    return found


def _evaluate(stacks: Sequence[Sequence[Part]], levels: dict[str, int]) -> Placement:
    """Return the placement of columns in an order, with its cost."""
    column = {part: k for k, stack in enumerate(stacks) for part in stack}
    touches: dict[str, list[Part]] = {}
    for part in column:
        for net in (part.high, part.low):
            touches.setdefault(net, []).append(part)
    lying: dict[Part, tuple[str, str]] = {}
    for part, c in column.items():
        if part.level:
            for left, right in ((part.high, part.low), (part.low, part.high)):
                before = all(column[p] < c for p in touches[left] if p is not part)
                if before and all(column[p] > c for p in touches[right] if p is not part):
                    lying[part] = (left, right)
                    break
    ends: dict[str, tuple[float, float]] = {}
    for net, members in touches.items():
        places = [
            float(column[p]) + (0.0 if p not in lying else -0.4 if lying[p][0] == net else 0.4)
            for p in members
        ]
        ends[net] = (min(places), max(places))
    row = _rows(ends, levels)
    return Placement(column, row, ends, lying, _cost(column, row, ends, lying))


def _rows(ends: dict[str, tuple[float, float]], levels: dict[str, int]) -> dict[str, int]:
    """Return the row of each net: those of a level share one where their wires do not overlap."""
    row: dict[str, int] = {}
    base = 0
    for level in sorted(set(levels.values())):
        tracks: list[float] = []
        nets = sorted((n for n in ends if levels[n] == level), key=lambda n: (n != GROUND, ends[n]))
        for net in nets:
            low, high = ends[net]
            k = next((k for k, end in enumerate(tracks) if end < low - 0.1), len(tracks))
            tracks[k : k + 1] = [high]
            row[net] = base + k
        base += len(tracks)
    return row


def _cost(
    column: dict[Part, int],
    row: dict[str, int],
    ends: dict[str, tuple[float, float]],
    lying: dict[Part, tuple[str, str]],
) -> float:
    """Return what a placement costs: lengths, crossings, upright inductors, windings apart."""
    names = {part.name: part for part in column}
    cost = sum(high - low for low, high in ends.values()) + _ROWS * max(row.values())
    last = max(column.values())
    for part, c in column.items():
        a, b = sorted((row[part.low], row[part.high]))
        if part in lying:
            cost += 20.0 * (a != b)
        else:
            cost += max(0, b - a - 1) + _STANDING * part.level
            cost += _CROSSING * sum(
                a < row[n] < b and low < c < high for n, (low, high) in ends.items()
            )
        for other in part.coupled:
            cost += 0.5 * _APART * max(0, abs(c - column[names[other]]) - 1)
        if part.letter in "vi":
            cost += _SOURCE * c
        elif part.letter == "r" and not part.level:
            cost += _LOAD * (last - c)
    return cost
