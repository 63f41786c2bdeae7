"""Set-valued two-terminal laws as monotone piecewise-linear curves in the (i, v) plane.

A curve is a chain of straight pieces: a ray, segments between vertices, a ray.  Horizontal and
vertical pieces are allowed, so ideal diodes and Zener diodes are ordinary curves.  A diode-like
curve, whose conductance grows in both directions from its flattest piece, is a sum of parallel
branches: one conductance and, for each vertex, one complementarity pair.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class PairLaw:
    """One complementarity pair of a decomposed curve.

    The pair carries ``lam >= 0`` from a to b (``forward``) or from b to a, and opens with the slack
    ``w = offset - (+-)(va - vb) + resistance * lam``.

    Parameters
    ----------
    forward : bool
    offset : float
        Voltage at which the pair starts to conduct [V], counted in its own direction.
    resistance : float
        Series resistance [Ohm].
    """

    forward: bool
    offset: float
    resistance: float


@dataclass(frozen=True, slots=True)
class Decomposition:
    """A curve as parallel branches: conductance [S] in parallel with pairs."""

    conductance: float
    pairs: tuple[PairLaw, ...]


@dataclass(frozen=True, slots=True)
class Characteristic:
    """A monotone piecewise-linear curve.

    Parameters
    ----------
    vertices : tuple of (float, float)
        Corners ``(i, v)`` [A, V] in ascending order; two may coincide.
    directions : tuple of (float, float)
        ``(di, dv)``, both >= 0, of every piece from the lower left ray to the upper right ray; one
        more than there are vertices.

    Examples
    --------
    An ideal diode is the ray ``(0, v <= 0)`` followed by the ray ``(i >= 0, 0)``:

    >>> ideal = diode_curve()
    >>> ideal.vertices, ideal.directions
    (((0.0, 0.0),), ((0.0, 1.0), (1.0, 0.0)))
    >>> ideal.contains(3.0, 0.0), ideal.contains(1.0, -1.0)
    (True, False)
    """

    vertices: tuple[Point, ...]
    directions: tuple[Point, ...]

    def __post_init__(self) -> None:
        if len(self.directions) != len(self.vertices) + 1:
            raise ValueError("a curve with k vertices has k + 1 pieces")
        if any(di < 0 or dv < 0 or di + dv <= 0 for di, dv in self.directions):
            raise ValueError("the pieces of a monotone curve run upwards")

    def contains(self, i: float, v: float, tolerance: float = 0.0) -> bool:
        """Return whether the point lies on the curve, within a distance in i and v."""
        for k, (di, dv) in enumerate(self.directions):
            low = self.vertices[k - 1] if k else None
            high = self.vertices[k] if k < len(self.vertices) else None
            anchor = high or low or (0.0, 0.0)
            off = abs((i - anchor[0]) * dv - (v - anchor[1]) * di) / math.hypot(di, dv)
            above = low is None or (i >= low[0] - tolerance and v >= low[1] - tolerance)
            below = high is None or (i <= high[0] + tolerance and v <= high[1] + tolerance)
            if off <= tolerance and above and below:
                return True
        return False

    def decompose(self) -> Decomposition:
        """Return the curve as a conductance in parallel with one pair per vertex.

        Raises
        ------
        ValueError
            If the conductance does not grow in both directions from one piece, or if that piece is
            not part of a line through the origin.

        Examples
        --------
        >>> diode_curve(vfwd=0.7, ron=0.1, vrev=5.0).decompose().pairs[0]
        PairLaw(forward=True, offset=0.7, resistance=0.1)
        """
        slopes = [math.inf if dv == 0 else di / dv for di, dv in self.directions]
        middle = slopes.index(min(slopes))
        left, right = slopes[: middle + 1], slopes[middle:]
        if left != sorted(left, reverse=True) or right != sorted(right):
            raise ValueError("the conductance must grow in both directions from the flattest piece")
        for i, v in self.vertices[max(middle - 1, 0) : middle + 1]:
            di, dv = self.directions[middle]
            if not math.isclose(i * dv, v * di, rel_tol=1e-12, abs_tol=0.0):
                raise ValueError("the flattest piece must lie on a line through the origin")
        pairs: list[PairLaw] = []
        for k in range(middle, len(self.vertices)):
            self._append(pairs, True, self.vertices[k][1], k, k + 1)
        for k in range(middle - 1, -1, -1):
            self._append(pairs, False, -self.vertices[k][1], k + 1, k)
        return Decomposition(slopes[middle], tuple(pairs))

    def _append(
        self, pairs: list[PairLaw], forward: bool, offset: float, inner: int, outer: int
    ) -> None:
        """Add the pair that turns the inner piece into the steeper outer one."""
        (i0, v0), (i1, v1) = self.directions[inner], self.directions[outer]
        # 1 / (i1/v1 - i0/v0), written so that a vertical or a horizontal piece stays exact
        step = i1 * v0 - i0 * v1
        if step > 0:
            pairs.append(PairLaw(forward, offset + 0.0, v0 * v1 / step))


def diode_curve(
    vfwd: float = 0.0,
    ron: float = 0.0,
    roff: float = math.inf,
    vrev: float | None = None,
    rrev: float = 0.0,
) -> Characteristic:
    """Return the curve of a diode with given piecewise-linear effects.

    Parameters
    ----------
    vfwd : float
        Forward drop [V].
    ron, roff : float
        Slope of the conducting and of the blocking piece [Ohm].
    vrev : float or None
        Breakdown voltage [V, positive], None for none.
    rrev : float
        Slope in breakdown [Ohm].

    Examples
    --------
    >>> diode_curve(vfwd=0.7, roff=1e3).decompose()
    Decomposition(conductance=0.001, pairs=(PairLaw(forward=True, offset=0.7, resistance=0.0),))
    """
    off = (0.0, 1.0) if math.isinf(roff) else (1.0, roff)
    leak = 0.0 if math.isinf(roff) else 1.0 / roff
    vertices: list[Point] = [(leak * vfwd, vfwd)]
    directions: list[Point] = [off, (1.0, ron)]
    if vrev is not None:
        vertices.insert(0, (-leak * vrev, -vrev))
        directions.insert(0, (1.0, rrev))
    return Characteristic(tuple(vertices), tuple(directions))
