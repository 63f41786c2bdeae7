"""Expressions of circuit signals as instructions of a tape.

A tape gives the values of ``Expression.evaluate``; the solver evaluates it, with derivatives, in
the compiled core.  An expression that is linear in its signals is recognised, so that it costs no
more than the controlled sources it stands for.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

from ..netlist.expressions.functions import ARITY
from ..netlist.expressions.node import Node
from ..problems.tape import OPS, TapeBuilder
from .waves import wave_signal

#: constant and factors of signals
Form = tuple[float, dict[str, float]]
#: gives the register of a signal by its canonical name
Signal = Callable[[str], int]

#: functions that are one instruction of the same name
_SAME = (frozenset(OPS) & frozenset(ARITY)) - {"inv", "min", "max"}


class Compiler:
    """Writes expressions on a tape.

    Parameters
    ----------
    builder : TapeBuilder
    signal : callable
        Register of ``v(a)``, ``v(a,b)``, ``i(v1)``, ``i``, ``time``, ``temper``.

    Examples
    --------
    >>> from nsspice.netlist.expressions.expression import Expression
    >>> builder = TapeBuilder()
    >>> compiler = Compiler(builder, lambda name: builder.unknown(0))
    >>> compiler.compile(Expression.parse("exp(v(a)) + v(a)").node)
    2
    """

    def __init__(self, builder: TapeBuilder, signal: Signal) -> None:
        self.builder = builder
        self.signal = signal
        #: registers by the identity of a tree, which is kept so that no other takes its place
        self._known: dict[int, tuple[Node, int]] = {}

    def compile(self, node: Node) -> int:
        """Return the register of a tree; shared subtrees are written once."""
        found = self._known.get(id(node))
        if found is None:
            found = self._known[id(node)] = node, self._compile(node)
        return found[1]

    def _compile(self, node: Node) -> int:
        op, args = node.op, node.args
        write = self.builder.op
        if op == "num":
            return self.builder.constant(float(node.value))
        if op in ("var", "name"):
            return self.signal(str(node.value))
        if op == "add":
            return self._chain(args, "add", "sub", "neg")
        if op == "mul":
            return self._chain(args, "mul", "div", "inv")
        if op == "call":
            return self._call(str(node.value), args)
        registers = [self.compile(arg) for arg in args]
        if op in ("and", "or"):
            return self._fold(op, registers)
        return write(op, *registers)  # neg inv not pow if and the comparisons have the same names

    def _chain(self, args: tuple[Node, ...], plain: str, inverse: str, marker: str) -> int:
        """Return a sum or a product; a ``neg`` term is subtracted, an ``inv`` factor divided by."""
        total = self.compile(args[0])
        for arg in args[1:]:
            if arg.op == marker:
                total = self.builder.op(inverse, total, self.compile(arg.args[0]))
            else:
                total = self.builder.op(plain, total, self.compile(arg))
        return total

    def _fold(self, name: str, registers: list[int]) -> int:
        """Return an instruction of two arguments applied to more."""
        if len(registers) == 1:
            return registers[0]
        total = registers[0]
        for register in registers[1:]:
            total = self.builder.op(name, total, register)
        return total

    def _call(self, function: str, args: tuple[Node, ...]) -> int:
        """Return the value of a function of ``netlist.functions``."""
        write = self.builder.op
        if function == "pwl":
            return self._broken_line(args)
        registers = [self.compile(arg) for arg in args]
        if function in _SAME:
            return write(function, *registers)
        if function in ("min", "max"):
            return self._fold(function, registers)
        if function == "inv":  # a logical inverter
            return write("sub", self.builder.constant(1.0), write("buf", registers[0]))
        if function == "limit":
            x, one, other = registers
            low, high = write("min", one, other), write("max", one, other)
            return write("min", write("max", x, low), high)
        assert function == "steps"
        zero = self.builder.constant(0.0)
        x, total = registers[0], zero
        for k in range(len(registers) - 3, 0, -2):
            total = write("if", write("le", x, registers[k + 2]), registers[k + 1], total)
        return write("if", write("gt", x, registers[1]), total, zero)

    def _broken_line(self, args: tuple[Node, ...]) -> int:
        """Return a table: one instruction, or conditionals where points jump or move."""
        write = self.builder.op
        x, points = self.compile(args[0]), args[1:]
        if all(p.op == "num" for p in points):
            values = tuple(float(p.value) for p in points)
            if len(values) == 2:
                return self.builder.constant(values[1])
            if all(b > a for a, b in pairwise(values[::2])):
                return write("table", x, constants=(len(values) / 2, *values))
        registers = [self.compile(p) for p in points]
        total = registers[-1]
        for k in range(len(registers) - 4, -1, -2):
            x0, y0, x1, y1 = registers[k : k + 4]
            run = write("sub", x1, x0)
            slope = write("div", write("sub", y1, y0), run)
            inside = write("add", y0, write("mul", write("sub", x, x0), slope))
            # where two points share their x the upper one counts
            rises = write("gt", run, self.builder.constant(0.0))
            total = write("if", write("le", x, x1), write("if", rises, inside, y1), total)
        return write("if", write("gt", x, registers[0]), total, registers[1])


def linear_form(node: Node, timed: bool = False) -> Form | None:
    """Return a tree as a constant plus multiples of signals, None if it is not of that form.

    ``time`` is not a signal that linear elements have, unless they are ``timed``: then sines of it
    and their arcs are signals, too, named by :func:`~nsspice.devices.waves.wave_signal`.

    Examples
    --------
    >>> from nsspice.netlist.expressions.expression import Expression
    >>> linear_form(Expression.parse("2*(v(a) - i(v1)/4) + 1").node)
    (1.0, {'v(a)': 2.0, 'i(v1)': -0.5})
    >>> linear_form(Expression.parse("v(a)*v(b)").node) is None
    True
    >>> linear_form(Expression.parse("3*cos(2*time)").node, timed=True)
    (0.0, {'sin(2.0,90.0)': 3.0})
    >>> linear_form(Expression.parse("asin(sin(2*time))").node, timed=True)
    (0.0, {'tri(2.0,0.0)': 1.0})
    """
    op, args = node.op, node.args
    if op == "num":
        return float(node.value), {}
    if op == "var":
        name = str(node.value)
        foreign = name == "temper" or (name == "time" and not timed)
        return None if foreign else (0.0, {name: 1.0})
    if op == "neg":
        return _scaled(linear_form(args[0], timed), -1.0)
    if op == "add":
        constant, factors = 0.0, dict[str, float]()
        for arg in args:
            term = linear_form(arg, timed)
            if term is None:
                return None
            constant += term[0]
            for name, value in term[1].items():
                factors[name] = factors.get(name, 0.0) + value
        return constant, factors
    if op in ("mul", "inv"):
        return _product(args if op == "mul" else (node,), timed)
    if op == "call" and timed and node.value in ("sin", "cos"):
        return _sine(args[0], 90.0 if node.value == "cos" else 0.0)
    if op == "call" and timed and node.value in ("asin", "acos"):
        return _arc(str(node.value), args[0])
    return None


def _sine(argument: Node, ahead: float, kind: str = "sin") -> Form | None:
    """Return a sine of what grows with the time, so many degrees ahead, or the arc of one."""
    form = linear_form(argument, timed=True)
    if form is None or set(form[1]) - {"time"}:
        return None
    rate, phase = form[1].get("time", 0.0), math.degrees(form[0]) + ahead
    if not (math.isfinite(rate) and math.isfinite(phase)):
        return None
    if rate == 0.0:
        value = math.sin(math.radians(phase))
        return (value if kind == "sin" else math.asin(value)), {}
    if rate < 0.0:  # sin(x) = sin(180 - x)
        rate, phase = -rate, 180.0 - phase
    return 0.0, {wave_signal(rate, phase, kind): 1.0}


def _arc(function: str, argument: Node) -> Form | None:
    """Return ``asin`` or ``acos`` of a sine or a cosine of the time, a triangle."""
    if argument.op != "call" or argument.value not in ("sin", "cos"):
        return None
    form = _sine(argument.args[0], 90.0 if argument.value == "cos" else 0.0, "tri")
    if form is None or function == "asin":
        return form
    return 0.5 * math.pi - form[0], dict.fromkeys(form[1], -1.0)


def _product(args: tuple[Node, ...], timed: bool) -> Form | None:
    """Return a product in which at most one factor, not a divisor, varies."""
    total: Form = (1.0, {})
    for arg in args:
        divides = arg.op == "inv"
        factor = linear_form(arg.args[0] if divides else arg, timed)
        if factor is None or (factor[1] and (divides or total[1])):
            return None
        if divides:
            if factor[0] == 0.0:
                return None
            total = (total[0] / factor[0], {n: v / factor[0] for n, v in total[1].items()})
        elif factor[1]:
            total = (total[0] * factor[0], {n: total[0] * v for n, v in factor[1].items()})
        else:
            total = (total[0] * factor[0], {n: v * factor[0] for n, v in total[1].items()})
    return total


def _scaled(form: Form | None, factor: float) -> Form | None:
    if form is None:
        return None
    return form[0] * factor, {name: value * factor for name, value in form[1].items()}
