"""Jumps of charges and fluxes: impulses that carry them must exist, and have the right signs.

A jump changes charges by impulses of current, through sources, closed switches and diodes, and
fluxes by impulses of voltage, across open switches, current sources and diodes.  With its state at
t+ an ideal diode obeys

    impulse of current >= 0,  only where v = Vfwd after it,
    impulse of voltage <= 0,  only where i = 0 after it,

which together with Kirchhoff's laws is the complementarity problem that such a jump solves (for
passive networks: of all admissible jumps that of least energy).  Impulses are not among the rows: a
nonnegative least-squares problem finds the best ones, and what it leaves is the violation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from .diodes import line_of
from .flat_deck import Element, FlatDeck, number
from .storage import Store
from .switching import states, thresholds_of
from .written import Rows, Violation

#: signals within this share of their range of a corner may be on either piece
NEAR = 1e-6
#: contents that change by less than this share of their range do not jump
MOVED = 1e-9


@dataclass(frozen=True)
class Part:
    """What an element may carry at one row: signs of its impulses, 0 for none, None for either."""

    element: Element
    current: tuple[bool, bool]
    voltage: tuple[bool, bool]


NONE, FREE, FORWARD, BACKWARD = (False, False), (True, True), (True, False), (False, True)


def jumps(deck: FlatDeck, rows: Rows, caps: list[Store], coils: list[Store]) -> list[Violation]:
    """Return how far the changes of charges and fluxes at all jumps are from admissible ones."""
    out: list[Violation] = []
    parts = _Parts(deck, rows)
    for k in np.flatnonzero(~rows.moves):
        for law, stores in (("jump of charge", caps), ("jump of flux", coils)):
            changes = [float(s.content[k + 1] - s.content[k]) for s in stores]
            out += _judge(parts, law, stores, changes, int(k) + 1)
    return out


def start(deck: FlatDeck, rows: Rows, caps: list[Store], coils: list[Store]) -> list[Violation]:
    """Return how far the first row is from the initial values that the elements give.

    Values that contradict one another, or the sources, are changed by impulses as in a jump.
    """
    if not deck.uic or deck.initial:
        return []
    parts = _Parts(deck, rows)
    out: list[Violation] = []
    for law, stores in (("initial charge", caps), ("initial flux", coils)):
        changes = [float(s.content[0]) - s.initial for s in stores]
        out += _judge(parts, law, stores, changes, 0)
    return out


def _judge(
    parts: _Parts, law: str, stores: list[Store], changes: list[float], row: int
) -> list[Violation]:
    moved = [abs(c) > MOVED * s.scale for c, s in zip(changes, stores, strict=True)]
    if not any(moved):
        return []
    here = [parts.at(e, row) for e in parts.deck.elements if e.letter != "k"]
    solve = _charges if "charge" in law else _fluxes
    name, size = solve(parts.deck, here, stores, changes)
    return [Violation(law, name, float(parts.rows.time[row]), size)]


class _Parts:
    """Tells what each element may carry."""

    def __init__(self, deck: FlatDeck, rows: Rows) -> None:
        self.deck, self.rows = deck, rows
        self.states = {e.name: states(e, rows) for e in deck.elements if e.letter in "sw"}

    def at(self, e: Element, row: int) -> Part:
        letter = e.letter
        if letter in "veh" or (letter == "b" and "v" in e.settings):
            return Part(e, FREE, NONE if letter == "v" else FREE)
        if letter in "igfb":
            return Part(e, FREE if letter == "f" else NONE, FREE)
        if letter == "r":
            shorted = e.words[:1] and number(e.words[0]) == 0.0
            return Part(e, FREE if shorted else NONE, NONE)
        if letter in "cl":
            return Part(e, NONE, NONE)
        if letter in "sw":
            return self._switch(e, row)
        if letter == "d":
            return self._diode(e, row)
        return Part(e, FREE, FREE)

    def _switch(self, e: Element, row: int) -> Part:
        law, known = thresholds_of(e), self.states[e.name]
        if law is None or known is None:
            return Part(e, FREE, FREE)
        current = FREE if law.ron == 0.0 and known[row] >= 0 else NONE
        voltage = FREE if np.isinf(law.roff) and known[row] <= 0 else NONE
        return Part(e, current, voltage)

    def _diode(self, e: Element, row: int) -> Part:
        line, currents = line_of(e), self.rows.current(e.name)
        if line is None or currents is None:
            return Part(e, FREE, FREE)
        volts = self.rows.voltage(*e.nodes)
        near_v, near_i = (
            NEAR * self.rows.scale_of(volts, "v"),
            NEAR * self.rows.scale_of(currents, "i"),
        )
        v, i = float(volts[row]), float(currents[row])
        forward = line.ron == 0.0 and v >= line.vfwd - near_v
        backward = line.rrev == 0.0 and v <= -line.vrev + near_v
        blocked = line.conductance == 0.0 and np.isinf(line.vrev) and i <= near_i
        return Part(e, (forward, backward), BACKWARD if blocked else NONE)


def _charges(
    deck: FlatDeck, parts: list[Part], stores: list[Store], changes: list[float]
) -> tuple[str, float]:
    """Return the node whose charge is changed most by no impulse, and by which share."""
    index = {n: k for k, n in enumerate(deck.nodes)}
    total, scale = np.zeros(len(index)), np.zeros(len(index))
    for store, change in zip(stores, changes, strict=True):
        for node, sign in zip(store.element.nodes, (1.0, -1.0), strict=True):
            if node != "0":
                total[index[node]] += sign * change
                scale[index[node]] += store.scale
    columns: list[np.ndarray] = []
    for part in parts:
        for allowed, sign in zip(part.current, (1.0, -1.0), strict=True):
            if allowed:
                # a device of three terminals may take any charge at each
                nodes = part.element.nodes
                for some in [nodes] if len(nodes) == 2 else [[n] for n in nodes]:
                    column = np.zeros(len(index))
                    for node, direction in zip(some, (sign, -sign), strict=False):
                        if node != "0":
                            column[index[node]] += direction
                    columns.append(column)
    # nodes without capacitors hold no charge: what flows in flows out
    scale[scale == 0.0] = scale[scale > 0.0].min()
    return _least(deck.nodes, columns, -total, scale)


def _fluxes(
    deck: FlatDeck, parts: list[Part], stores: list[Store], changes: list[float]
) -> tuple[str, float]:
    """Return the inductor whose flux is changed most by no impulse, and by which share."""
    group = _tied(deck, parts)
    roots = sorted(set(group.values()) - {group["0"]})
    index = {n: k for k, n in enumerate(roots)}
    blocked = [p for p in parts if p.element.letter == "d" and p.voltage == BACKWARD]
    count = len(stores) + len(blocked)
    matrix = np.zeros((count, len(roots)))
    ends = [s.element.nodes for s in stores] + [p.element.nodes for p in blocked]
    for k, (a, b) in enumerate(ends):
        for node, sign in ((a, 1.0), (b, -1.0)):
            if group[node] in index:
                matrix[k, index[group[node]]] += sign
    slacks = np.zeros((count, len(blocked)))
    slacks[len(stores) :] = np.eye(len(blocked))
    columns = [*matrix.T, *(-matrix.T), *slacks.T]
    scales = [s.scale for s in stores]
    scale = np.array(scales + [min(scales)] * len(blocked))
    names = [s.element.name for s in stores] + [p.element.name for p in blocked]
    return _least(names, columns, np.array(changes + [0.0] * len(blocked)), scale)


def _tied(deck: FlatDeck, parts: list[Part]) -> dict[str, str]:
    """Return a name for each group of nodes between which there is no impulse of voltage."""
    parent = {n: n for n in ["0", *deck.nodes]}

    def root(node: str) -> str:
        while parent[node] != node:
            node = parent[node]
        return node

    for part in parts:
        if part.voltage == NONE and part.element.letter != "l":
            first, second = part.element.nodes[:2]
            parent[root(first)] = root(second)
    return {n: root(n) for n in parent}


def _least(
    names: list[str], columns: list[np.ndarray], target: np.ndarray, scale: np.ndarray
) -> tuple[str, float]:
    """Return the name and size of the largest residual of nonnegative least squares."""
    rest = target / scale
    if columns:
        matrix = np.array(columns).T / scale[:, None]
        largest = np.abs(matrix).max(axis=0)
        matrix = matrix[:, largest > 0] / largest[largest > 0]
        if matrix.size:
            rest = rest - matrix @ nnls(matrix, rest)[0]
    worst = int(np.argmax(np.abs(rest)))
    return names[worst], float(abs(rest[worst]))
