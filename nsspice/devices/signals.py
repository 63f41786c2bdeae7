"""What an expression reads, and its register on the tape of a system."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..netlist.expressions.expression import Expression
from .behaviour import Compiler
from .stamper import Stamper, Written

if TYPE_CHECKING:
    from .carrier import Carrier


def voltages(expression: Expression) -> list[str]:
    """Return the nodes whose voltages an expression reads, ground left out.

    Examples
    --------
    >>> voltages(Expression.parse("v(b,a) + i(v1)"))
    ['a', 'b']
    """
    names = {n for v in expression.variables() if v[:2] == "v(" for n in v[2:-1].split(",")}
    return sorted(names - {"0"})


def currents(expression: Expression) -> list[str]:
    """Return the elements whose currents an expression reads.

    Examples
    --------
    >>> currents(Expression.parse("v(b,a) + i(v1)"))
    ['v1']
    """
    return sorted(v[2:-1] for v in expression.variables() if v[:2] == "i(")


def shown(expression: Expression, length: int = 50) -> str:
    """Return an expression for a listing, shortened.

    Examples
    --------
    >>> shown(Expression.parse("v(a)  * 2"))
    '{v(a) * 2}'
    """
    text = " ".join(expression.text.split())
    return "{" + (text if len(text) <= length else text[: length - 3] + "...") + "}"


def own_current(stamper: Stamper, branch: int, parallel: float) -> int:
    """Return the register of the current of one of some equal elements in parallel.

    Parameters
    ----------
    stamper : Stamper
    branch : int
        Unknown current of all of them together.
    parallel : float
        Their number.
    """
    tape = stamper.tape
    own = tape.unknown(branch)
    return own if parallel == 1.0 else tape.op("div", own, tape.constant(parallel))


def register_of(
    stamper: Stamper,
    expression: Expression,
    sources: Mapping[str, Carrier],
    own: int | None = None,
    extra: Mapping[str, int] | None = None,
) -> int:
    """Return the register of an expression.

    Parameters
    ----------
    stamper : Stamper
    expression : Expression
    sources : mapping of str to Carrier
        Elements whose currents it reads.
    own : int, optional
        Register of the element's own current ``i``.
    extra : mapping of str to int, optional
        Registers of signals that only this law has.
    """
    tape, layout = stamper.tape, stamper.layout

    def signal(name: str) -> int:
        if extra is not None and name in extra:
            return extra[name]
        if name == "time":
            # a DC solution is that of the time 0; sweeps count their points by the time
            dc = layout.conditions.analysis == "dc"
            return tape.constant(0.0) if dc else tape.time()
        if name == "temper":
            return tape.constant(layout.conditions.temperature)
        if name == "i":
            assert own is not None
            return own
        if name[0] == "v":
            return stamper.voltage_register(*name[2:-1].split(","))
        element = name[2:-1]
        return stamper.register(element, sources[element].current(layout))

    register = Compiler(tape, signal).compile(expression.node)
    signals = {name: signal(name) for name in sorted(expression.variables())}
    layout.readings.append(Written(expression, register, signals))
    return register
