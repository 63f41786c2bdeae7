r"""On which branch an island with positive feedback begins: one on which a circuit would rest.

A limiter whose output comes back to its input with a gain above one has three solutions: both
limits, and one in between.  A real limiter lags behind its input, however little,

.. math::

    \tau y' = \min(\max(b(z), f), c) - y,

and leaves the solution in between at once.  With the matrix M of a step, a mode in which the pairs
of the set a are active can be one of rest only if :math:`\det M_{aa}` has the sign that it has
where every limiter is at a limit, the loops being cut (the eigenvalues of
:math:`1 - \partial b / \partial y` are those of decay).  If it has not, the limiters are followed
from limit to limit, :math:`y \leftarrow \min(\max(b(z), f), c)`, until they rest.

During a run nothing has to be chosen: a mode is followed until it ends, and there the branch in
between ends as well.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...circuit import MnaSystem
from ...devices.expressions.expression_nodes import asked
from ...devices.expressions.piecewise import Limiter
from ...problems.csc import Csc, weighted_sum
from ...problems.one_solution import may_have_several
from ...solvers.moreau import MoreauStepper
from ...solvers.stepper import UnsolvedStep
from ..request.pinned import hold
from ..signals.curve import Floats

#: a limiter that has not come to rest after so many turns oscillates: nothing is chosen
_TURNS = 60
#: limits of more limiters than this are not looked at
_MOST = 60
_SAME = 1e-9
#: a multiplier that says no more than that its pair is active
_TRACE = 1e-6
_Guess = tuple[Floats, Floats]


def at_rest(mna: MnaSystem, charges: Floats | None, step: float | None) -> _Guess | None:
    """Return a first point near which an island rests; None where the one that is found does.

    Parameters
    ----------
    mna : MnaSystem
    charges : ndarray, shape (n,), or None
        From which a run with ``uic`` begins; None for the DC solution.
    step : float or None
        Solver step [s], None where nothing is stored.

    Returns
    -------
    (ndarray (n,), ndarray (m,)) or None
        Unknowns and multipliers.
    """
    system = mna.system
    limiters = _limiters(mna)
    if not limiters or len(limiters) > _MOST or system.smooth is not None or system.passive:
        return None
    storage = () if charges is None or step is None else ((system.E, 1.0 / step),)
    K = weighted_sum([(system.G, 1.0), *storage])
    if not may_have_several(system, K):
        return None
    search = _Search(mna, limiters, charges, step)
    try:
        first = search.solve({})
        if search.may_rest(K, first):
            return None
        for side in (0.0, 1.0, -1.0):
            found = search.follow(side)
            if found is not None and search.may_rest(K, found):
                return found
        return None
    except (UnsolvedStep, np.linalg.LinAlgError):
        return None


def _limiters(mna: MnaSystem) -> list[Limiter]:
    """Return the limiters whose limits act on their own voltage, not on what a charge follows."""
    acting = set(zip(mna.system.A.indices.tolist(), mna.system.A.columns.tolist(), strict=True))
    found = []
    for node in mna.layout.inner:
        name = node.signal[2:-1]
        pairs = (k for k, pair in enumerate(mna.pairs) if pair.rpartition(".")[0] == name)
        if isinstance(node, Limiter) and any((mna.layout.nodes[name], k) in acting for k in pairs):
            found.append(node)
    return found


class _Search:
    """Solutions with limiters held at some voltages."""

    def __init__(
        self,
        mna: MnaSystem,
        limiters: Sequence[Limiter],
        charges: Floats | None,
        step: float | None,
    ) -> None:
        self.mna, self.limiters, self.charges, self.step = mna, limiters, charges, step
        self.places = [mna.layout.nodes[node.signal[2:-1]] for node in limiters]

    def solve(self, held: dict[int, float]) -> _Guess:
        """Return unknowns and multipliers with some voltages held."""
        # nodes inside elements have ground before them
        terms = [(((place, 1.0),), value) for place, value in held.items()]
        system = hold(self.mna.system, terms) if held else self.mna.system
        stepper = MoreauStepper(system, ())
        if self.charges is None or self.step is None:
            stepper.start_dc(0.0)
        else:
            charges = np.concatenate([self.charges, np.zeros(len(held))])
            stepper.start_charges(0.0, charges, self.step)
        z, lam = stepper.state
        return z[: self.mna.system.n], lam

    def may_rest(self, K: Csc, found: _Guess) -> bool:
        """Return whether the determinant of a mode has the sign of that with all loops cut."""
        system, names = self.mna.system, self.mna.pairs
        M = system.D.dense() + system.B.dense() @ np.linalg.solve(K.dense(), system.A.dense())
        limits = [self._limits_of(node) for node in self.limiters]
        own = {name for pair in limits for name in pair}
        active = [k for k in range(system.m) if found[1][k] > 0.0]
        # either limit of a limiter cuts its loop
        cut = [names.index(next(name for name in pair if name in names)) for pair in limits]
        cut += [k for k in active if names[k] not in own]
        signs = [np.linalg.slogdet(M[np.ix_(rows, rows)])[0] for rows in (active, cut)]
        return bool(signs[0] * signs[1] >= 0.0)

    def _limits_of(self, node: Limiter) -> tuple[str, str]:
        return node.signal[2:-1] + ".floor", node.signal[2:-1] + ".ceiling"

    def follow(self, side: float) -> _Guess | None:
        """Return where limiters come to rest from 0 or from their limits; None if they do not."""
        layout = self.mna.layout
        values = [_limit(node, side) if side else 0.0 for node in self.limiters]
        for _ in range(_TURNS):
            z, lam = self.solve(dict(zip(self.places, values, strict=True)))
            z = z.copy()
            moved = 0.0
            for k, node in enumerate(self.limiters):
                value = asked(layout, node, z)
                z[self.places[k]] = value
                moved = max(moved, abs(value - values[k]) / max(abs(value), abs(values[k]), 1e-300))
                values[k] = value
            if moved <= _SAME:
                return z, self._with_limits(z, lam)
        return None

    def _with_limits(self, z: Floats, lam: Floats) -> Floats:
        """Return multipliers with a trace of those of limiters that are at a limit."""
        layout, names = self.mna.layout, self.mna.pairs
        found = lam.copy()
        for place, node in zip(self.places, self.limiters, strict=True):
            free = asked(layout, node._replace(floor=None, ceiling=None), z)
            beyond = free < z[place], free > z[place]
            for name, is_beyond in zip(self._limits_of(node), beyond, strict=True):
                if name in names:
                    found[names.index(name)] = _TRACE if is_beyond else 0.0
        return found


def _limit(node: Limiter, side: float) -> float:
    """Return a limit that is a number, 0 if there is none."""
    end = node.ceiling if side > 0.0 else node.floor
    return float(end.value) if end is not None and end.op == "num" else 0.0
