"""Taylor models enclose what exact fractions give; ranges of polynomials what points attain."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nsspice.problems.polynomial_range import largest
from nsspice.problems.taylor import Models, Unbounded, space

HOME = space(2, 3)
numbers = st.floats(-3.0, 3.0, allow_nan=False).map(lambda x: round(x, 3))
places = st.tuples(*(st.integers(-8, 8).map(lambda k: Fraction(k, 8)) for _ in range(2)))


def formula(a, b, c, x, y):
    """An expression with all operations, of fractions or of models."""
    top = a * x * y - b * x + c
    return (top * top + y) / (x * x + 7) - y / (x + 5)


def value(model: Models, at) -> tuple[Fraction, Fraction]:
    """Polynomial and remainder at a place, in exact arithmetic."""
    total = Fraction(0)
    for coefficient, powers in zip(model.coefficients.tolist(), HOME.powers.tolist(), strict=True):
        term = Fraction(coefficient)
        for variable, power in zip(at, powers, strict=True):
            term *= variable**power
        total += term
    return total, Fraction(float(model.remainder))


@given(numbers, numbers, numbers, places)
@settings(max_examples=60, deadline=None)
def test_a_model_encloses_the_function_in_exact_arithmetic(a, b, c, at):
    x = Models.variable(HOME, 0.5, 0.25, 0)
    y = Models.variable(HOME, -1.0, 0.5, 1)
    model = formula(a, b, c, x, y)
    exact = formula(
        *map(Fraction, (a, b, c)),
        Fraction(1, 2) + Fraction(1, 4) * at[0],
        Fraction(-1) + Fraction(1, 2) * at[1],
    )
    polynomial, remainder = value(model, at)
    assert abs(polynomial - exact) <= remainder
    low, high = model.range()
    assert Fraction(float(low)) <= exact <= Fraction(float(high))


@given(numbers, numbers, numbers, places)
@settings(max_examples=40, deadline=None)
def test_the_largest_value_is_bounded_and_attained(a, b, c, at):
    x = Models.variable(HOME, 0.5, 0.25, 0)
    y = Models.variable(HOME, -1.0, 0.5, 1)
    model = formula(a, b, c, x, y)
    bound, attained = largest(model)
    polynomial, remainder = value(model, at)
    assert polynomial + remainder <= Fraction(bound)
    assert attained <= bound


@pytest.mark.parametrize("exponent", [0.5, 1.5, -0.5])
def test_roots_are_enclosed(exponent):
    root = Models.variable(HOME, 2.0, 0.5, 0).power(exponent)
    for place in (-1.0, -0.7, 0.0, 0.3, 1.0):
        polynomial, remainder = value(root, (Fraction(place), Fraction(0)))
        low, high = polynomial - remainder, polynomial + remainder
        x = Fraction(2) + Fraction(1, 2) * Fraction(place)
        # squares are exact: x^2e lies between those of the ends
        assert low > 0
        assert low * low <= x ** int(2 * exponent) <= high * high


def test_products_of_matrices_agree_with_those_of_their_entries():
    rng = np.random.default_rng(4)
    a = Models(HOME, rng.normal(size=(3, 2, HOME.size)), rng.random((3, 2)) * 1e-3)
    b = Models(HOME, rng.normal(size=(2, 4, HOME.size)), rng.random((2, 4)) * 1e-3)
    whole = a @ b
    for i in range(3):
        for j in range(4):
            entry = a[i, 0] * b[0, j] + a[i, 1] * b[1, j]
            # sums of the same products in another order: the rounding of 2 x 20 terms
            assert np.allclose(whole[i, j].coefficients, entry.coefficients, rtol=0, atol=1e-13)
            assert whole[i, j].remainder == pytest.approx(float(entry.remainder), rel=1e-9)


def test_a_denominator_that_may_vanish_is_refused():
    with pytest.raises(Unbounded):
        Models.variable(HOME, 0.5, 0.6, 0).inverse()


def test_what_is_exactly_zero_stays_so():
    x = Models.variable(HOME, 3.0, 0.5, 0)
    nothing = x - x
    assert bool(nothing.nothing)
    assert bool((nothing * x).nothing)
