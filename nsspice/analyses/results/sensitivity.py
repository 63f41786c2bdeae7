"""Derivatives of averages and measures by elements and parameters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from html import escape
from typing import Any

from ...lazy import need_library


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


class Sensitivities(list[Sensitivity]):
    """A list of sensitivities that is shown as a table.

    Examples
    --------
    >>> Sensitivities([Sensitivity("v(b)", "r1", 1e3, 0.5, -2.5e-4)])
    signal  element  value  average  derivative
      v(b)       r1   1000      0.5    -0.00025
    """

    def _cells(self) -> list[list[str]]:
        rows = [
            [s.signal, s.element, *(f"{x:.6g}" for x in (s.value, s.average, s.derivative))]
            for s in self
        ]
        return [["signal", "element", "value", "average", "derivative"], *rows]

    def __repr__(self) -> str:
        cells = self._cells()
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        lines = (zip(row, widths, strict=True) for row in cells)
        return "\n".join("  ".join(x.rjust(w) for x, w in line) for line in lines)

    def _repr_html_(self) -> str:
        head, *body = ("".join(f"<td>{escape(cell)}</td>" for cell in row) for row in self._cells())
        rows = "".join(f"<tr>{row}</tr>" for row in body)
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"

    def to_pandas(self) -> Any:
        """Return a DataFrame with all fields."""
        return need_library("pandas").DataFrame([asdict(s) for s in self])


def ranked(found: Iterable[Sensitivity], keys: Sequence[str]) -> Sensitivities:
    """Return sensitivities signal by signal, those with the largest effect first.

    What is equal up to rounding stays in the order in which it is given.
    """
    order = {key: k for k, key in enumerate(keys)}
    return Sensitivities(
        sorted(found, key=lambda s: (order[s.signal], -float(f"{abs(s.relative):.12g}")))
    )
