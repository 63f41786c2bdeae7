"""Perfectly coupled windings: fewer states than inductors.

With a perfect coupling the inductance matrix of a group of windings is singular.  It is factorised
as ``N diag(d) N'`` with as many columns as its rank; the states are then combinations ``N' i`` of
the currents, such as the magnetising current ``i1 + 2 i2`` of a transformer, and the voltages
across all windings are ``N rho``.  The windings without a column of their own follow the others
like controlled voltage sources.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..devices.passive.coupling import Coupling
from ..devices.passive.inductor import Inductor
from ..problems.csc import Floats
from .mna import MnaSystem
from .union_find import UnionFind

#: relative size below which a pivot of the scaled inductance matrix counts as zero
RANK = 1e-11


@dataclass(frozen=True, slots=True)
class Winding:
    """A state of a group of perfectly coupled windings.

    Parameters
    ----------
    pivot : Inductor
        Its factor in the combination is 1.
    members : tuple of (Inductor, float)
        The combination of currents.
    inductance : float
        [H], as seen from the pivot.
    """

    pivot: Inductor
    members: tuple[tuple[Inductor, float], ...]
    inductance: float

    @property
    def name(self) -> str:
        """Name of the state, ``i[l1]+2*i[l2]``."""
        text = f"i[{self.pivot.name}]"
        for inductor, factor in self.members:
            if inductor is not self.pivot:
                times = "" if abs(factor) == 1.0 else f"{abs(factor):.6g}*"
                text += f"{'-' if factor < 0 else '+'}{times}i[{inductor.name}]"
        return text


def tight_windings(mna: MnaSystem) -> list[Winding]:
    """Return the states of all groups of windings whose inductance matrix is singular.

    Parameters
    ----------
    mna : MnaSystem
    """
    layout = mna.layout
    couplings = [d for d in mna.devices if isinstance(d, Coupling)]
    if not couplings:
        return []
    index: dict[str, int] = {}
    inductors: list[Inductor] = []
    for coupling in couplings:
        for inductor in coupling.inductors:
            if inductor.name not in index:
                index[inductor.name] = len(inductors)
                inductors.append(inductor)
    sets = UnionFind(len(inductors))
    for coupling in couplings:
        for inductor in coupling.inductors[1:]:
            sets.union(index[coupling.inductors[0].name], index[inductor.name])
    groups: dict[int, list[int]] = {}
    for k in range(len(inductors)):
        groups.setdefault(sets.find(k), []).append(k)
    matrices = {root: np.eye(len(members)) for root, members in groups.items()}
    place = {k: j for members in groups.values() for j, k in enumerate(members)}
    for coupling in couplings:
        for one in coupling.inductors:
            for two in coupling.inductors:
                if one is not two:
                    i, j = index[one.name], index[two.name]
                    matrices[sets.find(i)][place[i], place[j]] += coupling.coefficient
    result: list[Winding] = []
    for root, members in groups.items():
        own = [inductors[k] for k in members]
        scale = np.sqrt([inductor.inductance(layout) for inductor in own])
        columns = _factor(matrices[root])
        if len(columns) < len(own):
            result += [_winding(own, scale, pivot, depth, c) for pivot, depth, c in columns]
    return result


def tied(windings: Sequence[Winding]) -> frozenset[str]:
    """Return the names of the windings whose voltage follows from the others'."""
    members = {inductor.name for w in windings for inductor, _ in w.members}
    return frozenset(members - {w.pivot.name for w in windings})


def followers(
    windings: Sequence[Winding],
) -> list[tuple[Inductor, list[tuple[Inductor, float]]]]:
    """Return each winding without a state and its voltage as a combination of the pivots' ones."""
    pivots = [w.pivot for w in windings]
    names = [pivot.name for pivot in pivots]
    # row j: how the voltage across pivot j follows from the rates
    square = np.zeros((len(pivots), len(pivots)))
    rest: dict[str, Floats] = {}
    inductors: dict[str, Inductor] = {}
    for k, winding in enumerate(windings):
        for inductor, factor in winding.members:
            if inductor.name in names:
                square[names.index(inductor.name), k] = factor
            else:
                inductors[inductor.name] = inductor
                rest.setdefault(inductor.name, np.zeros(len(pivots)))[k] = factor
    result: list[tuple[Inductor, list[tuple[Inductor, float]]]] = []
    for name, row in rest.items():
        factors = np.linalg.solve(square.T, row)
        pairs = zip(pivots, factors, strict=True)
        result.append((inductors[name], [(p, float(f)) for p, f in pairs if abs(f) > 1e-12]))
    return result


def _factor(matrix: Floats) -> list[tuple[int, float, Floats]]:
    """Return pivots, depths and columns of ``matrix = sum depth column column'``."""
    rest = matrix.copy()
    columns: list[tuple[int, float, Floats]] = []
    while True:
        diagonal = np.diag(rest)
        largest = float(diagonal.max())
        if largest < RANK:
            return columns
        pivot = int(np.flatnonzero(diagonal >= largest * (1.0 - 1e-9))[0])
        depth = float(rest[pivot, pivot])
        column = rest[:, pivot] / depth
        columns.append((pivot, depth, column))
        rest = rest - depth * np.outer(column, column)
        rest[pivot, :] = 0.0
        rest[:, pivot] = 0.0


def _winding(
    own: Sequence[Inductor], scale: Floats, pivot: int, depth: float, column: Floats
) -> Winding:
    """Return a column in the windings' own currents instead of scaled ones."""
    factors = np.where(np.abs(column) < 1e-12, 0.0, column) * scale / scale[pivot]
    members = tuple((one, float(f)) for one, f in zip(own, factors, strict=True) if f != 0.0)
    return Winding(own[pivot], members, depth * float(scale[pivot]) ** 2)
