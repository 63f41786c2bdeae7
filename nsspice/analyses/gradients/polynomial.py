"""Expressions of signals that are polynomials of second degree at most, in closed form."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...netlist.expressions.expression import Expression

#: of the terms of a polynomial at the points where it is compared with the expression: both are a
#: few operations
_ROUNDING = 64.0 * float(np.finfo(float).eps)


class NotPolynomial(Exception):
    """An expression is none, or of a higher degree; the text says so."""


@dataclass(frozen=True, slots=True)
class Polynomial:
    """``constant + sum b s + sum q s t`` with signals s and t.

    Parameters
    ----------
    constant : float
    linear : dict of str to float
    quadratic : dict of (str, str) to float
        Each pair once, in alphabetical order.

    Examples
    --------
    >>> Polynomial.of(Expression.parse("2*v(a)*i(r1) - v(b) + 1"), {}).quadratic
    {('i(r1)', 'v(a)'): 2.0}
    """

    constant: float
    linear: dict[str, float]
    quadratic: dict[tuple[str, str], float]

    @classmethod
    def of(cls, expression: Expression, constants: Mapping[str, float]) -> Polynomial:
        """Return an expression as a polynomial of its signals.

        Raises
        ------
        NotPolynomial
        """
        names = sorted(expression.variables() - set(constants))
        if "time" in names:
            raise NotPolynomial("an integral with the time in it is not differentiated")
        if expression.variables() & set(constants):
            raise NotPolynomial("an integral with another measure in it is not differentiated")
        at = dict.fromkeys(names, 0.0)
        slopes = {name: expression.derivative(name) for name in names}
        linear = {name: float(slope.evaluate(at)) for name, slope in slopes.items()}
        quadratic = {}
        for one, other in itertools.combinations_with_replacement(names, 2):
            second = float(slopes[one].derivative(other).evaluate(at))
            if second:
                quadratic[one, other] = 0.5 * second if one == other else second
        found = cls(float(expression.evaluate(at)), linear, quadratic)
        rng = np.random.default_rng(0)
        for scale in (1.0, -1e3, 1e-3):
            point = dict(zip(names, scale * rng.uniform(0.5, 1.5, len(names)), strict=True))
            value, size = found.at(point)
            if not abs(float(expression.evaluate(point)) - value) <= _ROUNDING * size:
                why = "only integrals of sums and products of two signals are differentiated"
                raise NotPolynomial(why)
        return found

    def at(self, point: Mapping[str, float]) -> tuple[float, float]:
        """Return the value at a point, and the sum of the sizes of its terms."""
        terms = [self.constant, *(f * point[s] for s, f in self.linear.items())]
        terms += [f * point[s] * point[t] for (s, t), f in self.quadratic.items()]
        return sum(terms), sum(map(abs, terms))

    def squared(self) -> Polynomial:
        """Return the square.

        Raises
        ------
        NotPolynomial
            If it has a higher degree.
        """
        if self.quadratic or any(name.startswith("p(") for name in self.linear):
            raise NotPolynomial("the root mean square of a product is not differentiated")
        quadratic: dict[tuple[str, str], float] = {}
        for (s, f), (t, g) in itertools.product(self.linear.items(), repeat=2):
            key = (min(s, t), max(s, t))
            quadratic[key] = quadratic.get(key, 0.0) + f * g
        linear = {s: 2.0 * self.constant * f for s, f in self.linear.items()}
        return Polynomial(self.constant**2, linear, quadratic)
