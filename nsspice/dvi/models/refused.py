"""What a run must not step across silently: poles in time, equations of a high index, a lost start.

An engine steps over a pole at an instant between its own, and finds something that satisfies each
of its steps where an unknown appears only in the second derivative of an equation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ...problems.intervals import bounds
from ...problems.tape import OPS, Tape
from ...solvers.moreau import function_values
from ..runs.resting import rate_of
from ..terms.errors import unsolved, wrong
from ..terms.expression import Expr
from .standard import tape_of

if TYPE_CHECKING:
    from ..equations.assembly import Model

Floats = npt.NDArray[np.float64]

_NAMES = list(OPS)
#: an instant is known to this part of the run
_FINE = 2.0**-40
#: gaps at which a function has values on both sides
_JUMPS = ("comparison", "condition", "jump", "staircase")
#: states that a run begins with may differ by so much from those that were given, as a part of the
#: largest ones of the run
_KEPT = 1e-9


def check_times(model: Model, begin: float, end: float) -> None:
    """Refuse a run over an instant at which a function of the time has no value.

    Raises
    ------
    NumericalError
        NS6020 with the instant.
    """
    for owner, expr in _expressions(model):
        for part in _of_time(expr):
            at = _first_gap(tape_of([part], []), begin, end)
            if at is not None:
                raise unsolved(
                    f"the equation of {owner} has no value at t = {at[0]:.9g}: {at[1]}",
                    "end the run before, or write the equation so that it has one",
                    time=at[0],
                )


def _expressions(model: Model) -> list[tuple[str, Expr]]:
    found = [(row.name, row.right) for row in model.rows]
    return [*found, *((pair.name, pair.slack) for pair in model.pairs)]


def _of_time(expr: Expr) -> list[Expr]:
    """Return the largest parts of an expression that depend on the time alone."""
    found: list[Expr] = []
    waiting = [expr.node]
    while waiting:
        node = waiting.pop()
        names = Expr(node).names
        if names == {"time"} and node.op not in ("var", "name"):
            found.append(Expr(node))
        elif "time" in names:
            waiting += node.args
    return found


def _first_gap(tape: Tape, begin: float, end: float) -> tuple[float, str] | None:
    """Return the first instant within an interval where a tape of the time has no value."""
    waiting = [(begin, end)]
    least = _FINE * (end - begin)
    while waiting:
        a, b = waiting.pop()
        found = next((text for text in bounds(tape, [], (a, b)).gaps if text), "")
        if not found or any(word in found for word in _JUMPS):
            continue  # a function may jump, as sources do
        if b - a <= least:
            return 0.5 * (a + b), found
        middle = 0.5 * (a + b)
        waiting += [(middle, b), (a, middle)]
    return None


def check_index(model: Model) -> None:
    """Refuse algebraic equations whose unknown appears in their second derivative only.

    Each equation, or its rate where it holds no algebraic unknown, is matched with an unknown
    (C. C. Pantelides, *The consistent initialization of differential-algebraic systems*, SIAM J.
    Sci. Stat. Comput. 9, 1988).

    Raises
    ------
    UsageError
        NS6005 with the unknown.
    """
    own = [row for row in model.rows if not row.state]
    if not own or model.mass:
        return
    algebraic = {row.name for row in own}
    algebraic |= {pair.name for pair in model.pairs if pair.multiplier}
    known = {row.name for row in own}
    patterns: list[set[str]] = []
    for row in own:
        right = row.right
        names = right.names | set(right.atoms)
        if not names & algebraic and not right.atoms:
            names = rate_of(model, right).names
        patterns.append(set(names) & known if not right.atoms else known)
    unmatched = _unmatched(patterns)
    if unmatched is not None:
        name = own[unmatched].name
        raise wrong(
            "NS6005",
            f"the equation of {name} is of index 3 or more: neither it nor its rate contains "
            "an unknown that it could determine",
            "replace it by its second derivative, with a start that satisfies it and its rate",
        )


def _unmatched(patterns: Sequence[set[str]]) -> int | None:
    """Return an equation for which no unknown is left, None if each has one of its own."""
    owner: dict[str, int] = {}

    def place(row: int, tried: set[str]) -> bool:
        for name in sorted(patterns[row] - tried):
            tried.add(name)
            if name not in owner or place(owner[name], tried):
                owner[name] = row
                return True
        return False

    for row in range(len(patterns)):
        if not place(row, set()):
            return row
    return None


def check_path(model: Model, times: Floats, signals: Mapping[str, Floats]) -> None:
    """Refuse a run on which a divisor changes its sign between two rows: it has crossed a pole.

    Raises
    ------
    NumericalError
        NS6020 with the instant.
    """
    names = list(signals)
    table = np.column_stack([*(signals[name] for name in names), np.zeros((len(times), 0))])
    known = {*names, "time"}
    for owner, expr in _expressions(model):
        if not expr.names <= known or len(times) < 2:
            continue
        tape = tape_of([expr], names)
        registers = _divisors(tape)
        if not registers:
            continue
        probe = Tape(tape.ops, tape.args, tape.constants, np.array(registers, dtype=np.int32))
        values = function_values(probe, table, np.zeros((len(times), 0)), times)
        crossed = values[1:] * values[:-1] < 0.0
        if np.any(crossed):
            k = int(np.argwhere(crossed)[0, 0])
            raise unsolved(
                f"the equation of {owner} is divided by 0 between t = {times[k]:.9g} and "
                f"{times[k + 1]:.9g}",
                "end the run before",
                time=float(times[k]),
            )


def _divisors(tape: Tape) -> list[int]:
    """Return the registers by which a tape divides and which are not the same everywhere."""
    found = []
    for op, args in zip(tape.ops.tolist(), tape.args.tolist(), strict=True):
        name = _NAMES[op]
        if name in ("inv", "div"):
            register = args[OPS[name] - 1]
            if _NAMES[int(tape.ops[register])] != "constant":
                found.append(register)
    return found


def check_kept(
    start: Mapping[str, float], times: Floats, signals: Mapping[str, Floats], jumped: bool
) -> None:
    """Refuse a run that begins with other states than those given, without a jump.

    Raises
    ------
    NumericalError
        NS6020 with the state.
    """
    if jumped or not len(times):
        return
    named = [name for name in start if name in signals]
    size = max((float(np.max(np.abs(signals[name]))) for name in named), default=0.0)
    size = max(size, *map(abs, start.values())) if start else size
    for name, value in start.items():
        first = float(signals[name][0]) if name in signals else value
        if not abs(first - value) <= _KEPT * size:
            raise unsolved(
                f"the run begins with {name} = {first:.9g} instead of {value:.9g}",
                "check that the start satisfies the conditions",
                time=float(times[0]),
            )


__all__ = ["check_index", "check_kept", "check_path", "check_times"]
