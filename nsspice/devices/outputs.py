"""Outputs as linear combinations: multiples and sums."""

from __future__ import annotations

from ..problems.descriptor import Functional


def scaled(functional: Functional, factor: float) -> Functional:
    """Return a multiple of an output.

    Examples
    --------
    >>> scaled(Functional(z=((0, 2.0),)), 3.0).z
    ((0, 6.0),)
    """

    def times(terms: tuple[tuple[int, float], ...]) -> tuple[tuple[int, float], ...]:
        return tuple((index, value * factor) for index, value in terms)

    return Functional(
        times(functional.z),
        times(functional.lam),
        times(functional.dz),
        times(functional.u),
        times(functional.f),
        times(functional.df),
    )


def plus(one: Functional, two: Functional) -> Functional:
    """Return the sum of two outputs; terms are listed one after the other.

    Examples
    --------
    >>> plus(Functional(z=((0, 2.0),)), Functional(z=((1, 1.0),), u=((0, 3.0),)))
    Functional(z=((0, 2.0), (1, 1.0)), lam=(), dz=(), u=((0, 3.0),), f=(), df=())
    """
    return Functional(
        one.z + two.z,
        one.lam + two.lam,
        one.dz + two.dz,
        one.u + two.u,
        one.f + two.f,
        one.df + two.df,
    )
