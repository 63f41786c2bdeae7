"""Signals that were not recorded, and expressions of signals, computed when they are asked for."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ...errors import NetlistError
from ...netlist.expressions.expression import Expression
from ..signals.signal_names import canonical

if TYPE_CHECKING:
    from collections.abc import Sequence

    from .solution import Floats, Solution

#: one signal; anything else is an expression
_SIGNAL = re.compile(r"[vip]\([^()]*\)")
#: what expressions are made of: a call, or an operator
_OPERATION = re.compile(r"[(+\-*/]")


class Rows(Protocol):
    """Computes an analysis once more, with other signals at the same output points."""

    def rows(self, names: Sequence[str]) -> Solution:
        """Return the analysis with these signals."""


def made_of(name: str) -> list[str]:
    """Return the signals of an expression, the name itself if it is a signal.

    Examples
    --------
    >>> made_of("V(a) - v(b)"), made_of("v(a,b)")
    (['v(a)', 'v(b)'], ['v(a,b)'])
    """
    expression = _expression(name)
    if expression is None:
        return [canonical(name)]
    return sorted({canonical(v) for v in expression.variables()} - {"time"})


def _expression(name: str) -> Expression | None:
    """Return a name that is more than one signal as an expression, None for any other."""
    if _SIGNAL.fullmatch(canonical(name)) or not _OPERATION.search(name):
        return None
    try:
        expression = Expression.parse(name)
    except NetlistError:
        return None
    variables = expression.variables()
    return expression if variables and canonical(name) not in variables else None


def derived(solution: Solution, name: str) -> Floats | None:
    """Return what a name stands for that is none of the recorded signals, None if nothing.

    Parameters
    ----------
    solution : Solution
    name : str
        ``i(r1)`` or ``p(r1)``, for which the analysis runs once more; or an expression of signals
        in the language of netlists, ``v(a)-v(b)``.
    """
    expression = _expression(name)
    if expression is None:
        key = canonical(name)
        if _SIGNAL.fullmatch(key):
            _record(solution, [key])
        return solution.signals.get(key)
    names = {v: canonical(v) for v in expression.variables()}
    _record(solution, [n for n in names.values() if n not in solution and _SIGNAL.fullmatch(n)])
    values = {v: solution[n] for v, n in names.items()}
    if any(np.iscomplexobj(value) for value in values.values()):
        return None  # expressions are real: vdb(out) - vdb(in)
    return np.array(np.broadcast_to(expression.evaluate(values), solution.axis.shape), float)


def _record(solution: Solution, names: Sequence[str]) -> None:
    """Run the analysis once more for signals that it has not recorded, and keep them."""
    if solution.more is None or not names:
        return
    try:
        found = solution.more.rows(names)
    except NetlistError:  # no such signal
        return
    if found.axis.shape == solution.axis.shape:
        solution.signals.update({name: found.signals[name] for name in names})
