r"""A differential variational inequality in the standard form of the theorems.

.. math::

    \dot x = f(t, x, u), \qquad u \in \mathrm{SOL}(K, g(t, x, \cdot)), \qquad K = \prod K^i
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..csc import Floats
from ..intervals import INF, Bounds, Interval, bounds
from ..tape import Tape


@dataclass(frozen=True, slots=True)
class ConvexSet:
    """A closed convex set of some components of u, as far as theorems ask for it.

    Parameters
    ----------
    index : tuple of int
        Components of u.
    low, high : tuple of float
        Smallest box around it.
    interval : bool
        The set is that box: a product of intervals.
    polyhedral, cone : bool
        It is a polyhedron; a cone with its vertex at 0.
    empty : bool or None
        It has no point at all; None if that is not known.
    """

    index: tuple[int, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    interval: bool = True
    polyhedral: bool = True
    cone: bool = False
    empty: bool | None = False

    @property
    def bounded(self) -> bool:
        """True if it is compact."""
        return all(np.isfinite([*self.low, *self.high]))

    @classmethod
    def box(cls, k: int, low: float, high: float) -> ConvexSet:
        """Return an interval of one component.

        Examples
        --------
        >>> ConvexSet.box(0, 0.0, float("inf")).cone
        True
        """
        cone = low in (0.0, -INF) and high in (0.0, INF)
        return cls((k,), (low,), (high,), cone=cone)


@dataclass(frozen=True, eq=False)
class StandardDVI:
    """A problem in standard form.

    Parameters
    ----------
    n, m : int
        Number of states and of components of u.
    f, g : Tape
        Functions of ``z = (x, u)`` and the time, n and m of them.
    sets : tuple of ConvexSet
        K; every component of u is in one of them.
    states, unknowns : tuple of str
        Names for messages.
    time : (float, float)
        Interval of the time [s].
    region : tuple of (float, float)
        Bounds of the states, if the statements are about them while they stay within.

    Examples
    --------
    Dry friction: ``v' = -u`` with u in [-1, 1] and ``-v + N(u)`` at zero:

    >>> from nsspice.problems import TapeBuilder
    >>> f, g = TapeBuilder(), TapeBuilder()
    >>> _ = f.output(f.op("neg", f.unknown(1)))
    >>> _ = g.output(g.op("neg", g.unknown(0)))
    >>> problem = StandardDVI(1, 1, f.finish(), g.finish(), (ConvexSet.box(0, -1.0, 1.0),))
    >>> problem.block("g", "x")[0].tolist()
    [[-1.0]]
    """

    n: int
    m: int
    f: Tape
    g: Tape
    sets: tuple[ConvexSet, ...]
    states: tuple[str, ...] = ()
    unknowns: tuple[str, ...] = ()
    time: Interval = field(default=(0.0, INF))
    #: bounds of states, where the statements are asked for while they stay within
    region: tuple[Interval, ...] = ()

    @cached_property
    def box(self) -> list[Interval]:
        """All states, and the box around K."""
        found: list[Interval] = [(-INF, INF)] * (self.n + self.m)
        found[: self.n] = self.region or found[: self.n]
        for part in self.sets:
            for k, low, high in zip(part.index, part.low, part.high, strict=True):
                found[self.n + k] = (low, high)
        return found

    @cached_property
    def bounds_f(self) -> Bounds:
        """Bounds of f and its derivatives for all t, all x and u in K."""
        return bounds(self.f, self.box, self.time)

    @cached_property
    def bounds_g(self) -> Bounds:
        """Bounds of g and its derivatives."""
        return bounds(self.g, self.box, self.time)

    def block(self, function: str, by: str) -> tuple[Floats, Floats]:
        """Return lower and upper bounds of the derivatives of f or g by ``x``, ``u`` or ``t``.

        Those of a function that jumps or has a pole somewhere are infinite.
        """
        found = self.bounds_f if function == "f" else self.bounds_g
        columns = {
            "x": slice(0, self.n),
            "u": slice(self.n, self.n + self.m),
            "t": slice(self.n + self.m, None),
        }[by]
        return found.low[:, columns], found.high[:, columns]

    def fixed(self, function: str, by: str) -> Floats | None:
        """Return a constant block of derivatives, None where it varies."""
        low, high = self.block(function, by)
        return low if np.array_equal(low, high) and np.all(np.isfinite(low)) else None

    @property
    def autonomous(self) -> bool:
        """True if neither f nor g depends on the time."""
        return not (self.f.timed or self.g.timed)

    @property
    def compact(self) -> bool:
        """True if K is, and is not empty."""
        return all(part.bounded and part.empty is False for part in self.sets)

    @property
    def loose(self) -> str:
        """Why K is not known to be compact and not empty."""
        for part in self.sets:
            if not part.bounded:
                return f"the set of {self.name(part.index[0])} is unbounded"
            if part.empty is not False:
                word = "is" if part.empty else "may be"
                return f"the set of {self.name(part.index[0])} {word} empty"
        return ""

    def gap(self, function: str) -> str:
        """Return why f or g need not be continuous for all t, x and u in K; empty where it is."""
        found = self.bounds_f if function == "f" else self.bounds_g
        for k, text in enumerate(found.gaps):
            if text:
                owner = self.state(k) if function == "f" else self.name(k)
                return f"the equation of {owner} may meet {text}"
        return ""

    def name(self, k: int) -> str:
        """Return the name of a component of u."""
        return self.unknowns[k] if k < len(self.unknowns) else f"u[{k}]"

    def state(self, k: int) -> str:
        """Return the name of a state."""
        return self.states[k] if k < len(self.states) else f"x[{k}]"
