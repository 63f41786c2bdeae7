"""What acts along a recorded run, and what functionals take of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from ..problems.csc import Floats
from .tangent import Bools, Guard, Slopes, Tangent


@dataclass(frozen=True, slots=True)
class Points:
    """Points of a run, and the derivatives of f functionals by what acts there.

    Parameters
    ----------
    z, rate, lam, u, time : ndarray, shapes (k, n), (k, n), (k, m), (k, sources), (k,)
        The points.
    flows, kept : ndarray, shape (k, n, f)
        By a source in each equation, and by a source of charge (flux) in it.
    slacks : ndarray, shape (k, m, f)
        By a source in the slack of each pair; 0 where the pair is open.
    functions : ndarray, shape (k, p, f)
        By each smooth function.
    outputs : ndarray, shape (k, o, f)
        By each output.
    """

    z: Floats
    rate: Floats
    lam: Floats
    u: Floats
    time: Floats
    flows: Floats
    kept: Floats
    slacks: Floats
    functions: Floats
    outputs: Floats

    @classmethod
    def joined(cls, parts: Sequence[Points]) -> Points:
        """Return the points of several parts."""
        names = [field.name for field in fields(cls)]
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def combined(self, factors: Floats) -> Points:
        """Return the derivatives of other functionals: combinations (f, g) of these."""
        weighted = ("flows", "kept", "slacks", "functions", "outputs")
        return Points(
            *(
                getattr(self, field.name) @ factors
                if field.name in weighted
                else getattr(self, field.name)
                for field in fields(self)
            )
        )


@dataclass(frozen=True, slots=True)
class Goal:
    """What functionals take of the outputs along a run.

    Parameters
    ----------
    places : ndarray, shape (k, s, o, f)
        Derivatives by the outputs at all places.
    begins : mapping of int to ndarray, shape (o, f)
        The same at the begin of some steps, after what happens there.
    shifts : ndarray, shape (k, f)
        By a shift of the begin of each step [1/s], all else held: windows and weights.
    edges : ndarray of bool, shape (k,)
        Where a source has an ideal edge at the begin of a step.
    """

    places: Floats
    begins: Mapping[int, Floats]
    shifts: Floats
    edges: npt.NDArray[np.bool_]

    def widened(self, more: int) -> Goal:
        """Return the goal with more functionals that take nothing of the outputs."""

        def wide(values: Floats) -> Floats:
            return np.concatenate([values, np.zeros((*values.shape[:-1], more))], axis=-1)

        begins = {k: wide(values) for k, values in self.begins.items()}
        return Goal(wide(self.places), begins, wide(self.shifts), self.edges)


@dataclass(frozen=True, slots=True)
class Turn:
    """A guard that ends a mode: its point, and derivatives (f,) by a source in the guard."""

    step: int
    guard: Guard
    by: Floats


def at_rest(
    tangent: Tangent, point: tuple[Floats, Floats, Floats], active: Bools, charges: Floats
) -> Points:
    """Return what acts at a static solution with which a run begins.

    Parameters
    ----------
    tangent : Tangent
    point : (ndarray (n,), ndarray (m,), ndarray (sources,))
        Unknowns, multipliers and sources.
    active : ndarray of bool, shape (m,)
        The pairs that conduct.
    charges : ndarray, shape (r, f)
        Derivatives by what is stored there.
    """
    z, lam, u = (np.asarray(v, dtype=np.float64)[np.newaxis] for v in point)
    n, stored = tangent.system.n, tangent.stored
    slopes = tangent.slopes(z, u, np.zeros(1))
    resting = Slopes(
        np.zeros_like(slopes.C), slopes.G, slopes.by_unknown, slopes.by_source, slopes.by_time
    )
    inverse = tangent.inverse(resting, active[np.newaxis], np.ones(1))[0]
    eta = inverse[:n].T @ (slopes.C[0, stored].T @ charges)
    kept = np.zeros((n, charges.shape[1]))
    kept[stored] = -charges
    flows = eta[:n]
    none = np.zeros((1, 0, charges.shape[1]))
    functions = -tangent.F.T @ flows - tangent.Q.T @ kept
    slacks = np.where(active[:, np.newaxis], -eta[n:], 0.0)
    return Points(
        z, np.zeros_like(z), lam, u, np.zeros(1), flows[np.newaxis], kept[np.newaxis],
        slacks[np.newaxis], functions[np.newaxis], none,
    )  # fmt: skip
