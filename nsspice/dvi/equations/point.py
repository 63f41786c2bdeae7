"""A solution of a static problem: values, residual, multipliers, regularity."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..terms.errors import wrong
from ..terms.expression import Expr, as_vector

if TYPE_CHECKING:
    from ...problems.regularity import Regularity


@dataclass(frozen=True, eq=False)
class Point:
    """A solution of a static problem.

    Parameters
    ----------
    values : dict of str to float
        Unknowns and set values by name.
    multipliers : dict of str to float
        Of the constraints of K: ``q[0].low``, ``q[0].face2``.
    residual : float
        Relative residual of equations, signs and products.
    judge : callable or None
        Computes ``regularity``; None where it is not judged.

    Examples
    --------
    >>> from nsspice.dvi import VI, Cone, unknowns
    >>> q = unknowns("q", 2)
    >>> s = VI(q - [1.0, -1.0], within={q: Cone(0)}).solve()
    >>> s[q].tolist(), s.multipliers["q[1].low"]
    ([1.0, 0.0], 1.0)
    """

    values: Mapping[str, float]
    multipliers: Mapping[str, float]
    residual: float
    judge: Callable[[], Regularity] | None = None

    @cached_property
    def regularity(self) -> Regularity | None:
        """Strong metric regularity at the solution, with its modulus, judged when asked for.

        It takes a decomposition of the whole Jacobian, which is most of the work of a large LCP.
        """
        return None if self.judge is None else self.judge()

    def __getitem__(self, key: Any) -> Any:
        """Return the value of a variable, of an expression, or of each of a vector of them."""
        if isinstance(key, str):
            if key not in self.values:
                raise wrong("NS6001", f"there is no unknown {key}", f"known: {list(self.values)}")
            return self.values[key]
        if isinstance(key, Expr):
            return float(key.value(self.values))
        return np.array([self[item] for item in as_vector(key)])

    def __repr__(self) -> str:
        shown = ", ".join(f"{name}={value:.9g}" for name, value in self.values.items())
        return f"Point({shown}; residual {self.residual:.1e})"
