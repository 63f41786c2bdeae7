"""Currents that a loop of ideal elements leaves free, at recorded points of a run.

Where closed switches, conducting diodes and diodes without a voltage form a loop, a current around
it changes no law: an ideal diode across a closed ideal switch carries any part of its current.
Engines look at the elements that they hold closed; here all are looked at that have no voltage.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ...problems.csc import Floats
from ...problems.descriptor import DescriptorSystem

_ROWS = 200  #: unknowns and pairs up to which loops are sought
_MODES = 64  #: sets of elements without a voltage that are looked at


class FreeCurrents:
    """Counts recorded points at which a current is free.

    Parameters
    ----------
    system : DescriptorSystem

    Examples
    --------
    Two ideal diodes in parallel, fed by 1 A:

    >>> from nsspice.problems import Csc
    >>> one, none = Csc.from_dense(np.ones((1, 1))), Csc.zeros
    >>> both = Csc.from_dense(np.ones((1, 2)))
    >>> system = DescriptorSystem(none((1, 1)), one, both, Csc.from_dense(np.ones((2, 1))),
    ...     none((2, 2)), np.zeros(2), one)
    >>> free = FreeCurrents(system)
    >>> free.take(np.zeros((1, 1)), np.array([[1.0, 0.0]]), None)
    >>> free.points
    1
    """

    def __init__(self, system: DescriptorSystem) -> None:
        self.system, self.points = system, 0
        self._known: dict[bytes, bool] = {}
        self._around = np.zeros((0, 0))
        if system.m > 0 and system.n + system.m <= _ROWS:
            from ...problems.isolation import null_space

            laws = np.vstack([system.A.dense(), system.D.dense()])
            if null_space(laws[:, _undecided(laws)]).shape[1]:
                self._around = laws

    def take(self, z: Floats, lam: Floats, roles: npt.NDArray[np.uint8] | None) -> None:
        """Count those of some points, shapes (k, n), (k, m), at which a current is free."""
        if not self._around.size or not len(z):
            return
        from ...problems.regularity import index_sets

        on, off = index_sets(self.system, z, lam, roles)
        if roles is not None:
            on, off = on | (roles == 1), off | (roles == 2)
        for conducts, blocks in zip(on, off, strict=True):
            key = conducts.tobytes() + blocks.tobytes()
            if key not in self._known:
                if len(self._known) >= _MODES:
                    continue
                self._known[key] = self._free(conducts, blocks)
            self.points += self._known[key]

    def _free(self, on: npt.NDArray[np.bool_], off: npt.NDArray[np.bool_]) -> bool:
        """Return whether some currents of elements without a voltage may change.

        Those of diodes that have none may only grow.
        """
        from ...problems.isolation import null_space, rays

        closed = np.flatnonzero(~off)
        basis = null_space(self._around[:, closed])
        if basis.shape[1] == 0:
            return False
        return bool(rays(basis[~on[closed]]))


def _undecided(laws: Floats) -> npt.NDArray[np.intp]:
    """Return the columns that are left when those go, one by one, that are alone in a row.

    A current that is the only one in a law does not move, nor does the next one then.

    Examples
    --------
    >>> _undecided(np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 1.0]])).tolist()
    [1, 2]
    """
    there, left = laws != 0.0, np.arange(laws.shape[1])
    while left.size:
        mine = there[:, left]
        alone = mine[mine.sum(axis=1) == 1].any(axis=0)
        if not alone.any():
            break
        left = left[~alone]
    return left


__all__ = ["FreeCurrents"]
