"""The certificate of a run: how well the computed rows satisfy the laws of the circuit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

#: A run whose scale-relative residuals stay below this passes.
TOLERANCE = 1e-8


@dataclass(frozen=True, slots=True)
class Certificate:
    """Worst residuals over all checked steps of all islands.

    Parameters
    ----------
    laws : float
        Kirchhoff's laws and the element equations, relative to the largest term of their kind.
    complementarity : float
        Signs and products of the set-valued elements, relative to their scale.
    checks : int
        Number of steps at which both were evaluated.
    undetermined : int
        Number of steps in which the laws leave some voltage or current open (a floating part,
        diodes in parallel); the value nearest to the step before was taken.

    Examples
    --------
    >>> Certificate(1e-14, 0.0, 3).passed
    True
    """

    laws: float
    complementarity: float
    checks: int
    undetermined: int = 0

    @property
    def passed(self) -> bool:
        """True if both residuals are below the tolerance (nan is not)."""
        return self.laws <= TOLERANCE and self.complementarity <= TOLERANCE

    @classmethod
    def of(cls, statistics: Iterable[Mapping[str, Any]]) -> Certificate:
        """Return the worst over the solvers' statistics."""
        laws, complementarity, checks, undetermined = 0.0, 0.0, 0, 0
        for stats in statistics:
            laws = _worst(laws, float(stats["residual_rows"]))
            complementarity = _worst(complementarity, float(stats["residual_complementarity"]))
            checks += int(stats["checks"])
            undetermined += int(stats.get("undetermined", 0))
        return cls(laws, complementarity, checks, undetermined)

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        return {
            "laws": self.laws,
            "complementarity": self.complementarity,
            "checks": self.checks,
            "undetermined": self.undetermined,
            "passed": self.passed,
        }


def _worst(a: float, b: float) -> float:
    return b if b != b or b > a else a  # nan wins
