"""Set-valued terms of expressions: ``Sgn(v)``, the law of dry friction, relays and diodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...netlist.expressions.node import show, var
from .errors import wrong
from .expression import Expr, as_expr, merged


@dataclass(frozen=True, slots=True)
class SetValued:
    """A sign of an expression: ``low`` below zero, ``high`` above, all between at zero.

    Parameters
    ----------
    name : str
        Of its value, which is an unknown of the problem.
    argument : Expr
    low, high : float

    Its complementarity form is ``argument = l1 - l2``, ``0 <= l1`` orthogonal to ``high - value``,
    ``0 <= l2`` orthogonal to ``value - low``.
    """

    name: str
    argument: Expr
    low: float
    high: float


def Sgn(argument: Any, low: float = -1.0, high: float = 1.0) -> Any:
    """Return the set-valued sign of an expression, or of each of an array.

    Its value lies in ``Sgn_{low,high}(argument)``: low where the argument is negative, high where
    it is positive, anything between where it is zero.  It is a signal of the solution, named as
    written: ``sgn(v)``.

    Parameters
    ----------
    argument : Expr or array of Expr
    low, high : float
        ``low <= high``, so that the graph is monotone.

    Raises
    ------
    UsageError
        NS6002 if ``low > high``.

    Source: T. Roubal, *Non-smooth analysis in engineering and economics* (2015), (1.3), with the
    lower value first.

    Examples
    --------
    >>> from nsspice.dvi import states
    >>> v = states("v")
    >>> -9.81 * Sgn(v)
    Expr(-9.81*sgn(v))
    """
    if isinstance(argument, np.ndarray | list | tuple):
        items = np.asarray(argument, dtype=object)
        out = np.empty(items.shape, dtype=object)
        out.ravel()[:] = [Sgn(item, low, high) for item in items.ravel()]
        return out
    low, high = float(low), float(high)
    if not low <= high or not np.isfinite([low, high]).all():
        raise wrong("NS6002", f"Sgn from {low:g} to {high:g} is not monotone", "give low <= high")
    inner = as_expr(argument)
    bounds = "" if (low, high) == (-1.0, 1.0) else f",{low:g},{high:g}"
    name = f"sgn({show(inner.node)}{bounds})".replace(" ", "")
    atom = SetValued(name, inner, low, high)
    return Expr(var(name), merged(inner.atoms, {name: atom}))
