"""Taylor models: polynomials of parameters with a proved bound on what is left.

A function f on the box :math:`[-1, 1]^n` is enclosed by a polynomial of degree d and a remainder,
:math:`|f(\\delta) - P(\\delta)| \\le \\rho`; sums, products and quotients of such pairs enclose
those of the functions (M. Berz, G. Hoffstätter, "Computation and application of Taylor polynomials
with interval remainder bounds", Reliable Computing 4 (1998) 83, doi:10.1023/A:1009958918582).
Dependence on the parameters is kept up to degree d, where intervals would lose it.

Coefficients are floating-point numbers.  What their rounding makes is added to the remainder: a sum
of k products is off by at most (k + 1) u times the sum of the magnitudes (N. Higham, *Accuracy and
Stability of Numerical Algorithms*, 2002, section 3.1).  Remainders are themselves computed with
less than a thousand operations, each off by u, which ``_UP`` covers.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
import numpy.typing as npt

from .csc import Floats

Ints = npt.NDArray[np.intp]

_UNIT = 2.0**-53
#: 1000 u and more: the rounding of remainders
_UP = 1.0 + 2.0**-42


class Unbounded(ArithmeticError):
    """A quotient whose denominator may vanish in the box, or a condition that holds in parts."""


class Space:
    """Polynomials of n variables up to a degree: which monomials there are, how they multiply.

    Parameters
    ----------
    variables, degree : int
    """

    def __init__(self, variables: int, degree: int) -> None:
        self.variables, self.degree = variables, degree
        powers = [
            tuple(chosen.count(v) for v in range(variables))
            for d in range(degree + 1)
            for chosen in combinations_with_replacement(range(variables), d)
        ]
        self.powers: Ints = np.array(powers, dtype=np.intp).reshape(-1, variables)
        self.size = len(powers)
        total = self.powers.sum(axis=1)
        #: (size, degree + 1), 1 where a monomial has the degree
        self.by_degree: Floats = (total[:, None] == np.arange(degree + 1)).astype(float)
        self.even = (self.powers % 2 == 0).all(axis=1)
        place = {p: k for k, p in enumerate(powers)}
        found = sorted(
            (place[tuple((self.powers[i] + self.powers[j]).tolist())], i, j)
            for i in range(self.size)
            for j in range(self.size)
            if total[i] + total[j] <= degree
        )
        target, self.left, self.right = (
            np.array(t, dtype=np.intp) for t in zip(*found, strict=True)
        )
        self.starts: Ints = np.searchsorted(target, np.arange(self.size))
        degrees = np.arange(degree + 1)
        #: 1 where a product of parts of two degrees is cut off
        self.cut: Floats = (degrees[:, None] + degrees > degree).astype(float)

    @cached_property
    def longest(self) -> int:
        """Terms of one coefficient of a product at most."""
        return int(np.diff(np.append(self.starts, self.left.size)).max())


@lru_cache(maxsize=32)
def space(variables: int, degree: int) -> Space:
    """Return the polynomials of so many variables up to a degree; each is made once."""
    return Space(variables, degree)


class Models:
    """An array of Taylor models.

    Parameters
    ----------
    home : Space
    coefficients : ndarray, shape (..., home.size)
    remainder : ndarray, shape (...)

    Examples
    --------
    >>> x = Models.variable(space(1, 4), 2.0, 0.2, 0)
    >>> low, high = (1.0 / x).range()
    >>> bool(low <= 1 / 2.2 and 1 / 1.8 <= high), bool(high - low < 0.107)
    (True, True)
    """

    __slots__ = ("coefficients", "home", "remainder")
    # numpy leaves mixed operations to this class
    __array_ufunc__ = None

    def __init__(self, home: Space, coefficients: Floats, remainder: Floats) -> None:
        self.home, self.coefficients, self.remainder = home, coefficients, remainder

    @classmethod
    def constant(cls, home: Space, values: npt.ArrayLike) -> Models:
        """Return functions that are constant."""
        given = np.asarray(values, dtype=float)
        coefficients = np.zeros((*given.shape, home.size))
        coefficients[..., 0] = given
        return cls(home, coefficients, np.zeros(given.shape))

    @classmethod
    def variable(cls, home: Space, middle: float, radius: float, number: int) -> Models:
        """Return ``middle + radius * delta[number]``."""
        found = cls.constant(home, middle)
        if radius:
            found.coefficients[1 + number] = radius
        return found

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        return self.remainder.shape

    @property
    def middle(self) -> Floats:
        """Values of the polynomials at the middle of the box."""
        return np.asarray(self.coefficients[..., 0])

    @property
    def nothing(self) -> npt.NDArray[np.bool_]:
        """Where a function is exactly zero."""
        return np.asarray(~self.coefficients.any(axis=-1) & (self.remainder == 0.0))

    def __getitem__(self, key: Any) -> Models:
        return Models(self.home, self.coefficients[key], self.remainder[key])

    def __setitem__(self, key: Any, value: Models) -> None:
        self.coefficients[key], self.remainder[key] = value.coefficients, value.remainder

    def copy(self) -> Models:
        """Return a copy that can be changed."""
        return Models(self.home, self.coefficients.copy(), self.remainder.copy())

    def _of(self, other: Models | npt.ArrayLike) -> Models:
        return other if isinstance(other, Models) else Models.constant(self.home, other)

    def size(self) -> Floats:
        """Return bounds of the magnitudes of the polynomials, without the remainders."""
        return np.asarray(np.abs(self.coefficients).sum(axis=-1) * _UP)

    def bound(self) -> Floats:
        """Return bounds of the magnitudes."""
        return np.asarray((self.size() + self.remainder) * _UP)

    def __neg__(self) -> Models:
        return Models(self.home, -self.coefficients, self.remainder)

    def __add__(self, other: Models | npt.ArrayLike) -> Models:
        b = self._of(other)
        total = self.coefficients + b.coefficients
        # an exact sum of nothing stays exact
        rounding = np.where(self.nothing | b.nothing, 0.0, _UNIT * np.abs(total).sum(axis=-1))
        return Models(self.home, total, (self.remainder + b.remainder + rounding) * _UP)

    __radd__ = __add__

    def __sub__(self, other: Models | npt.ArrayLike) -> Models:
        return self + (-self._of(other))

    def __rsub__(self, other: npt.ArrayLike) -> Models:
        return -self + other

    def _parts(self) -> Floats:
        return np.asarray(np.abs(self.coefficients) @ self.home.by_degree * _UP)

    def __mul__(self, other: Models | npt.ArrayLike) -> Models:
        b = self._of(other)
        home = self.home
        terms = self.coefficients[..., home.left] * b.coefficients[..., home.right]
        product = np.add.reduceat(terms, home.starts, axis=-1)
        cut = ((self._parts() @ home.cut) * b._parts()).sum(axis=-1)
        one, two = self.size(), b.size()
        rounding = (home.longest + 2) * _UNIT * one * two
        left = one * b.remainder + self.remainder * (two + b.remainder)
        return Models(home, product, (cut + left + _exactly(self, b, rounding)) * _UP)

    __rmul__ = __mul__

    def __matmul__(self, other: Models) -> Models:
        home = self.home
        inner = self.shape[-1]
        a, b = self.coefficients, other.coefficients
        product = np.zeros((*self.shape[:-1], *other.shape[1:], home.left.size))
        for k in range(inner):
            product += a[..., k, home.left][..., None, :] * b[k][..., home.right]
        total = np.add.reduceat(product, home.starts, axis=-1)
        cut = np.einsum("ikd,kjd->ij", self._parts() @ home.cut, other._parts())
        one, two = self.size(), other.size()
        rounding = (home.longest + inner + 2) * _UNIT * (one @ two)
        # what is exactly zero adds nothing
        left = one @ other.remainder + self.remainder @ (two + other.remainder)
        return Models(home, total, (cut + left + rounding) * _UP)

    def over(self, number: float) -> Models:
        """Return quotients by an exact number, whose reciprocal need not be exact."""
        found = self * (1.0 / number)
        found.remainder = (found.remainder + 2.0 * _UNIT * found.bound()) * _UP
        return found

    def inverse(self) -> Models:
        """Return reciprocals.

        Raises
        ------
        Unbounded
            If one may vanish.
        """
        middle = self.middle
        if not np.all(middle):
            raise Unbounded("a denominator vanishes")
        scaled = self * (1.0 / middle)
        rest = scaled - 1.0
        far = rest.bound()
        if not np.all(far < 1.0):
            raise Unbounded("a denominator may vanish")
        series = Models.constant(self.home, np.ones(self.shape))
        for _ in range(self.home.degree):
            series = 1.0 - rest * series
        series.remainder = (series.remainder + far ** (self.home.degree + 1) / (1.0 - far)) * _UP
        # scaled is exact up to the rounding it carries; so is the factor
        return series * (1.0 / middle)

    def power(self, exponent: float) -> Models:
        """Return powers of positive functions with an exponent that is not a whole number.

        Raises
        ------
        Unbounded
            If one may vanish.
        """
        middle = self.middle
        factor = np.asarray(1.0 / np.where(middle > 0.0, middle, 1.0))
        rest = self * factor - 1.0
        far = rest.bound()
        if not np.all((middle > 0.0) & (far < 1.0)):
            raise Unbounded("a power of what may vanish")
        degree, factors = self.home.degree, [1.0]
        for k in range(degree + 1):
            factors.append(factors[-1] * (exponent - k) / (k + 1))
        series = Models.constant(self.home, np.full(self.shape, factors[degree]))
        for k in range(degree - 1, -1, -1):
            series = series * rest + factors[k]
        # Lagrange's remainder of the binomial series
        left = abs(factors[-1]) * far ** (degree + 1) / (1.0 - far) ** (degree + 1)
        rounding = 8.0 * (degree + 2) * _UNIT / (1.0 - far)
        series.remainder = (series.remainder + left + rounding) * _UP
        found = series * (1.0 / factor) ** exponent
        found.remainder = (found.remainder + 8.0 * _UNIT * found.bound()) * _UP
        return found

    def __truediv__(self, other: Models | npt.ArrayLike) -> Models:
        return self * self._of(other).inverse()

    def __rtruediv__(self, other: npt.ArrayLike) -> Models:
        return self.inverse() * other

    def range(self) -> tuple[Floats, Floats]:
        """Return lower and upper bounds over the box."""
        c = self.coefficients
        even = np.where(self.home.even, c, 0.0)
        even[..., 0] = 0.0
        odd = np.where(self.home.even, 0.0, np.abs(c)).sum(axis=-1)
        slack = self.remainder + self.home.size * _UNIT * np.abs(c).sum(axis=-1)
        low = c[..., 0] + np.minimum(even, 0.0).sum(axis=-1) - (odd + slack) * _UP
        high = c[..., 0] + np.maximum(even, 0.0).sum(axis=-1) + (odd + slack) * _UP
        return low, high

    def at(self, delta: npt.ArrayLike) -> Floats:
        """Return values of the polynomials at points (k, n) of the box, shape (k, ...)."""
        points = np.asarray(delta, dtype=float)
        monomials = np.prod(points[:, None, :] ** self.home.powers, axis=-1)
        return np.asarray(np.tensordot(monomials, self.coefficients, axes=(1, -1)))


def _exactly(a: Models, b: Models, rounding: Floats) -> Floats:
    """Return the rounding of products: none where a factor is 0, 1 or -1."""
    plain = _unit(a) | _unit(b)
    return np.where(plain, 0.0, rounding)


def _unit(models: Models) -> npt.NDArray[np.bool_]:
    c = models.coefficients
    value = np.abs(c[..., 0])
    constant = (models.remainder == 0.0) & ~c[..., 1:].any(axis=-1)
    return np.asarray(constant & ((value == 0.0) | (value == 1.0)))


def combined(matrix: Floats, models: Models) -> Models:
    """Return combinations of models (k,) with numbers that are rounded, shape (rows,)."""
    total = matrix @ models.coefficients
    sizes = np.abs(matrix) @ models.bound()
    rounding = (models.shape[0] + 3) * _UNIT * sizes
    remainder = np.abs(matrix) @ models.remainder
    return Models(models.home, total, (remainder + rounding) * _UP)


def stacked(models: list[Models]) -> Models:
    """Return an array of models of one shape."""
    return Models(
        models[0].home,
        np.stack([m.coefficients for m in models]),
        np.stack([m.remainder for m in models]),
    )
