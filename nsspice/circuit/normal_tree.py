"""The normal tree: which branch quantities are states, and which follow from them.

A normal tree spans the circuit graph with as many voltage sources and capacitors, and as few
inductors and current sources, as possible.  Capacitors in the tree and inductors outside it carry
the independent states.  Set-valued branches are between the two groups: in the tree their free
quantity is the slack (``u = w``, the voltage), outside it the current (``u = lam``).

The tree is grown greedily by kind: V, E and H, C, set-valued pairs (those that touch ground first),
R, L; within a kind in deck order, so that the result is always the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ..devices.device import Device, EdgeKind
from ..devices.stamper import Layout
from .independence import Basis, GraphBasis, LinearBasis
from .mna import MnaSystem
from .union_find import UnionFind
from .windings import Winding, followers, tied


class Branch(NamedTuple):
    """A branch of the circuit graph in numbers.

    ``a`` and ``b`` are node numbers, -1 for ground; ``number`` is the unknown current of V, E and L
    branches, the pair of P branches and -1 otherwise.
    """

    kind: EdgeKind
    device: Device
    a: int
    b: int
    number: int

    @property
    def voltage(self) -> dict[int, float]:
        """Its voltage as factors of node voltages."""
        ends = ((self.a, 1.0), (self.b, -1.0)) if self.a != self.b else ()
        return {node: sign for node, sign in ends if node >= 0}


@dataclass(frozen=True, slots=True)
class NormalTree:
    """A normal tree of one island.

    Parameters
    ----------
    branches : tuple of Branch
        In deck order.
    in_tree : tuple of bool
        One for each branch.
    redundant : tuple of Branch
        Voltage sources and shorts that close a loop of their own kind: their current is not
        determined and is taken as zero.
    roots : tuple of int
        One voltage of each part without a path to ground: its topmost node's, taken as zero.
    """

    branches: tuple[Branch, ...]
    in_tree: tuple[bool, ...]
    redundant: tuple[Branch, ...]
    roots: tuple[int, ...]

    def chosen(self, kind: EdgeKind, in_tree: bool) -> list[Branch]:
        """Return the branches of a kind inside or outside the tree, in deck order."""
        pairs = zip(self.branches, self.in_tree, strict=True)
        return [branch for branch, inside in pairs if branch.kind == kind and inside == in_tree]


def branches_of(mna: MnaSystem) -> list[Branch]:
    """Return the graph of an assembled island, swept values included."""
    layout = mna.layout
    result: list[Branch] = []
    for device in mna.devices:
        pairs = iter(layout.pairs.get(device.name, ()))
        for edge in device.branches(layout.conditions.values):
            index = -1
            if edge.kind == "P":
                index = next(pairs)
            elif edge.kind in ("V", "E", "L"):
                index = layout.branches[device.name]
            a, b = layout.nodes[edge.a], layout.nodes[edge.b]
            result.append(Branch(edge.kind, device, a, b, index))
    return result


def normal_tree(mna: MnaSystem, windings: Sequence[Winding] = ()) -> NormalTree:
    """Return the normal tree of an assembled island.

    Parameters
    ----------
    mna : MnaSystem
    windings : sequence of Winding
        States of perfectly coupled windings: the voltages of the other windings follow from them.
    """
    branches = branches_of(mna)
    layout = mna.layout
    # nodes inside elements are numbered among the branches
    nodes = sorted(index for index in layout.nodes.values() if index >= 0)
    count = nodes[-1] + 1 if nodes else 0
    basis: Basis = LinearBasis() if windings else GraphBasis(count)
    in_tree = [False] * len(branches)
    follow = tied(windings)

    def grow(kind: EdgeKind, grounded: bool | None = None) -> list[int]:
        """Add all branches of a kind whose voltage is independent; return the others."""
        closing = []
        for k, branch in enumerate(branches):
            touches = branch.a < 0 or branch.b < 0
            if branch.kind != kind or grounded not in (None, touches):
                continue
            if branch.device.name not in follow and basis.add(branch.voltage):
                in_tree[k] = True
            else:
                closing.append(k)
        return closing

    for form in _transformer_forms(windings, layout):
        basis.add(form)
    redundant = [branches[k] for k in grow("V")]
    grow("E")
    grow("C")
    grow("P", True)
    grow("P", False)
    grow("R")
    grow("L")
    # a controlled current that crosses into a floating part may fix its potential: not tied then
    parts = UnionFind(count + 1)
    for branch in branches:
        if branch.kind not in ("G", "I"):
            parts.union(branch.a + 1, branch.b + 1)
    steered = {
        parts.find(node + 1)
        for branch in branches
        if branch.kind == "G" and parts.find(branch.a + 1) != parts.find(branch.b + 1)
        for node in (branch.a, branch.b)
    }
    # the voltage of the topmost node of a part, and KCL of the whole part
    part = {node: parts.find(node + 1) for node in nodes}
    part[-1] = parts.find(0)
    above = {k: layout.nodes[layout.before(name)] for name, k in layout.nodes.items() if k >= 0}
    tops = [node for node in nodes if part[above[node]] != part[node]]
    roots = [
        node
        for node in tops
        if parts.find(node + 1) not in ({0} | steered) and basis.add({node: 1.0})
    ]
    return NormalTree(tuple(branches), tuple(in_tree), tuple(redundant), tuple(roots))


def _transformer_forms(windings: Sequence[Winding], layout: Layout) -> list[dict[int, float]]:
    """Return the relations between the voltages of perfectly coupled windings.

    All voltages are ``N rho`` with one rate for each pivot, and N is unit lower triangular on the
    pivots: solving for the rates leaves one relation for each other winding.
    """
    forms: list[dict[int, float]] = []
    for follower, factors in followers(windings):
        form: dict[int, float] = {}
        for winding, factor in [(follower, 1.0), *((pivot, -f) for pivot, f in factors)]:
            for end, sign in zip(winding.ends, (factor, -factor), strict=True):
                node = layout.nodes[end]
                if node >= 0:
                    form[node] = form.get(node, 0.0) + sign
        forms.append(form)
    return forms
