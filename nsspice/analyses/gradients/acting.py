"""What parameters do at the points of a run by steps, summed over all of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...problems.descriptor import Functional
from ...problems.tape import Tape
from ...solvers.along_run import Points, Turn
from ...solvers.moreau import function_values
from ...solvers.tangent import Tangent
from ..signals.curve import Floats
from .drivers import Driven
from .refusals import undone
from .variation import Parameter

#: Returns the smooth functions with another value of a parameter.
TapeAt = Callable[[Parameter, float], Tape]


class Acting:
    """The derivatives of functionals by drivers.

    Parameters
    ----------
    driven : Driven
    tangent : Tangent
    points : Points
    turns : sequence of Turn
    """

    def __init__(
        self,
        driven: Driven,
        tangent: Tangent,
        points: Points,
        turns: Sequence[Turn],
    ) -> None:
        self.driven, self.points, self.turns = driven, points, turns
        self._tape = None if tangent.system.smooth is None else tangent.system.smooth.tape
        record = tangent.record
        at = np.array([turn.step for turn in turns], dtype=np.intp)
        self._at = self._with_functions(points.z, points.lam, points.u, points.time)
        last = record.z[at, -1], record.lam[at, -1], record.u[at, -1], record.end[at]
        self._ends = self._with_functions(*last)
        self._by = np.array([turn.by for turn in turns]).reshape(at.size, points.flows.shape[2])

    def _with_functions(self, z: Floats, lam: Floats, u: Floats, t: Floats) -> dict[str, Floats]:
        tape = self._tape
        known = tape is not None and t.size
        f = function_values(tape, z, u, t) if tape is not None and known else np.zeros((t.size, 0))
        return {"z": z, "lam": lam, "u": u, "f": f}

    def __call__(self, driver: tuple[int, int | None, int | None, float]) -> Floats:
        """Return the derivatives by a driver of :class:`~.drivers.Driven`, shape (functionals,)."""
        stimulus, output, _, constant = driver
        kind, index = self.driven.rows[stimulus]
        what = Functional() if output is None else self.driven.outputs[output]
        points = self.points
        value = constant + _plain(what, self._at)
        rated = bool(what.dz or what.df)
        if kind == "row":
            total = points.flows[:, index].T @ value
            if rated:
                stored = _plain(Functional(z=what.dz, f=what.df), self._at)
                total = total + points.kept[:, index].T @ stored
            return np.asarray(total)
        if kind == "out":
            value = value + self._rate(what) if rated else value
            return np.asarray(points.outputs[:, index].T @ value)
        total = np.zeros(points.flows.shape[2])
        if kind == "slack":
            total = total + points.slacks[:, index].T @ value
        own = [
            j
            for j, turn in enumerate(self.turns)
            if (turn.guard.kind, turn.guard.place) == (kind, index)
        ]
        if own:
            total = total + (constant + _plain(what, self._ends))[own] @ self._by[own]
        return np.asarray(total)

    def _rate(self, what: Functional) -> Floats:
        """Return the rates in a functional at the points, shape (k,)."""
        if what.df:
            raise undone("it changes the charge of a junction whose current is measured", "it")
        found = np.zeros(self.points.time.size)
        for j, factor in what.dz:
            found += factor * self.points.rate[:, j]
        return found

    def by_functions(self, parameter: Parameter, tape_at: TapeAt) -> Floats:
        """Return what changes of the smooth functions themselves do, shape (functionals,)."""
        points = self.points
        slopes = []
        for step in parameter.steps:
            above, below = (tape_at(parameter, parameter.value + x) for x in (step, -step))
            if _same(above, below):
                return np.zeros(points.flows.shape[2])
            values = [function_values(t, points.z, points.u, points.time) for t in (above, below)]
            slopes.append((values[0] - values[1]) / (2.0 * step))
        by = (4.0 * slopes[1] - slopes[0]) / 3.0
        return np.asarray(np.einsum("kp,kpf->f", by, points.functions))


def _same(one: Tape, other: Tape) -> bool:
    arrays = ("ops", "args", "constants", "outputs")
    return all(np.array_equal(getattr(one, key), getattr(other, key)) for key in arrays)


def _plain(what: Functional, at: dict[str, Floats]) -> Floats:
    """Return a functional without its rates at points, shape (k,)."""
    found = np.zeros(at["z"].shape[0])
    for part, values in at.items():
        for j, factor in getattr(what, part):
            found += factor * values[:, j]
    return found
