"""Is a network passive?  Then each of its steps is a monotone problem.

What only observes (controlled sources that drive the gates of switches) takes no part in that: its
unknowns appear in no law of the rest, and are left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .csc import Csc, Floats

if TYPE_CHECKING:
    from .descriptor import DescriptorSystem

MOST_ROWS = 120  #: of a matrix whose eigenvalues may be asked for


def passive(system: DescriptorSystem, observers: bool = True) -> bool:
    """Return True if the arrays show that the network is passive.

    Parameters
    ----------
    system : DescriptorSystem
    observers : bool
        True if what only observes may be of any kind: the steps are monotone problems all the same,
        but it may take derivatives of what it sees.

    Examples
    --------
    >>> from nsspice.problems import DescriptorSystem
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> def resistor(g):
    ...     G = Csc.from_triplets((1, 1), [0], [0], [g])
    ...     return DescriptorSystem(one, G, none((1, 0)), none((0, 1)), none((0, 0)),
    ...         np.zeros(0), none((1, 0)), row_kind=np.zeros(1, np.uint8))
    >>> passive(resistor(1.0)), passive(resistor(-1.0))
    (True, False)
    """
    if system.smooth is not None:
        return True  # judged by Newton's method, not here
    if not (system.A.transposes(system.B) and _semidefinite(system.D)):
        return False
    return _semidefinite(system.G) or (observers and _semidefinite(_acting(system)))


def observing(system: DescriptorSystem) -> Csc:
    """Return the part of G that ``passive`` leaves out: the laws of what only observes.

    A controlled source that follows a source gives energy as the source itself would, and these
    laws say how much: of two states ``a'Mb + b'Ma``.

    Examples
    --------
    >>> from nsspice.problems import DescriptorSystem
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> observing(DescriptorSystem(one, one, none((1, 0)), none((0, 1)), none((0, 0)),
    ...     np.zeros(0), none((1, 0)), row_kind=np.zeros(1, np.uint8))).data.size
    0
    """
    G = system.G
    if _semidefinite(G):
        return Csc.zeros(G.shape)
    acting = _acting(system)
    both = np.concatenate([G.data, -acting.data])
    rows = np.concatenate([G.indices, acting.indices])
    columns = np.concatenate([G.columns, acting.columns])
    return Csc.from_triplets(G.shape, rows, columns, both)


def _acting(system: DescriptorSystem) -> Csc:
    """Return G without the rows and columns of what only observes.

    An unknown that appears in one law alone, and in no pair, follows from that law: both can go.
    So go the current of a controlled source with the current law of its node, then the voltage of
    that node with the law of the source, and everything seen only by that source.  The law of a
    node where nothing but the source ends, such as a gate, says that it carries no current: there
    go that law and that current as well, wherever the other end of the source is.
    """
    n = system.n
    laws: list[set[int]] = [set() for _ in range(n)]
    unknowns: list[set[int]] = [set() for _ in range(n)]
    for matrix in (system.G, system.E):
        for row, column in zip(matrix.indices.tolist(), matrix.columns.tolist(), strict=True):
            laws[column].add(row)
            unknowns[row].add(column)
    acted, sensed = set(system.A.indices.tolist()), set(system.B.columns.tolist())
    rows, columns = set(range(n)), set(range(n))
    waiting = list(range(n))
    while waiting:
        j = waiting.pop()
        if j not in columns or j in sensed or len(laws[j]) != 1:
            continue
        (i,) = laws[j]
        if i == j or i in acted:  # a node with its own conductance acts upon itself
            continue
        gone = {(i, j)}
        if unknowns[j] == {i} and j in rows and i in columns and not (j in acted or i in sensed):
            gone.add((j, i))
        for row, column in gone:
            rows.discard(row)
            columns.discard(column)
            for k in unknowns[row]:
                laws[k].discard(row)
                waiting.append(k)
            for k in laws[column]:
                unknowns[k].discard(column)
    if rows != columns or len(rows) == n:
        return system.G
    G = system.G
    kept = [
        i in rows and j in rows for i, j in zip(G.indices.tolist(), G.columns.tolist(), strict=True)
    ]
    return Csc.from_triplets(G.shape, G.indices[kept], G.columns[kept], G.data[kept])


def _semidefinite_full(full: Floats) -> bool:
    """Return True if the symmetric part is positive semidefinite, by dominance or eigenvalues."""
    with np.errstate(over="ignore"):  # conductances at the end of the range of numbers
        both = full + full.T
    diagonal = both.diagonal()
    columns = np.abs(both).sum(axis=0)
    # as diagonal >= (1 - 1e-12) times the others, |diagonal| being in both sums
    if (diagonal + np.abs(diagonal) >= columns * (1.0 - 1e-12)).all():
        return True
    values = np.linalg.eigvalsh(both)
    return bool(values[0] >= -1e-12 * max(abs(values[0]), abs(values[-1])))


def _semidefinite(matrix: Csc) -> bool:
    """Return the same for a sparse matrix; a large one is judged by dominance alone."""
    if matrix.data.size == 0:
        return True
    n = matrix.shape[0]
    if n <= MOST_ROWS:
        return _semidefinite_full(matrix.dense())
    rows = np.concatenate([matrix.indices, matrix.columns])
    cols = np.concatenate([matrix.columns, matrix.indices])
    both = Csc.from_triplets((n, n), rows, cols, np.concatenate([matrix.data, matrix.data]))
    on = both.indices == both.columns
    diagonal = np.zeros(n)
    diagonal[both.indices[on]] = both.data[on]
    others = np.bincount(both.indices[~on], np.abs(both.data[~on]), minlength=n)
    return bool(np.all(diagonal >= others * (1.0 - 1e-12)))
