"""Derivatives of averages and measures by elements and parameters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """How the average of a signal, or a measure, depends on one element or parameter.

    Parameters
    ----------
    signal : str
        Or the name of a measure.
    element : str
        Or the name of a parameter.
    value : float
        Of the element [Ohm, H, F, V or A].
    average : float
        Of the signal [V or A], or the measure.
    derivative : float
        Of the average by the value.
    error : float or None
        Bound of the error of the derivative of a measure; None where it is exact.
    """

    signal: str
    element: str
    value: float
    average: float
    derivative: float
    error: float | None = None

    @property
    def relative(self) -> float:
        """Value times derivative: the change for a change of the value by 100 % [V or A]."""
        return self.value * self.derivative


def ranked(found: Iterable[Sensitivity], keys: Sequence[str]) -> list[Sensitivity]:
    """Return sensitivities signal by signal, those with the largest effect first.

    What is equal up to rounding stays in the order in which it is given.
    """
    order = {key: k for k, key in enumerate(keys)}
    return sorted(found, key=lambda s: (order[s.signal], -float(f"{abs(s.relative):.12g}")))
