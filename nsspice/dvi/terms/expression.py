"""Expressions of unknowns, states, multipliers and the time, as the netlist's compiler takes them.

An expression is a tree of ``nsspice.netlist.expressions.node``: it is compiled to a tape of the
core, and its derivatives are exact.  Nothing is traced, and no text is evaluated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from ...netlist.expressions import evaluate as _evaluate
from ...netlist.expressions.derivative import derivative as _derivative
from ...netlist.expressions.node import Node, add, call, div, mul, neg, num, power, show, sub, var
from .errors import wrong

if TYPE_CHECKING:
    from .setvalued import SetValued

#: what may appear in an expression
Operand = Any
_NONE: Mapping[str, SetValued] = {}


class Expr:
    """A real-valued expression; ``+ - * / **`` and the functions of this module build new ones.

    Parameters
    ----------
    node : Node
        The tree.
    atoms : mapping of str to SetValued
        The set-valued terms in it by name; their values are variables of the tree.

    Examples
    --------
    >>> from nsspice.dvi import sin, states
    >>> x, v = states("x", "v")
    >>> force = -2.0 * x + sin(v)
    >>> force
    Expr(-2*x + sin(v))
    >>> force.derivative(v), force.value({"x": 1.0, "v": 0.0})
    (Expr(cos(v)), -2.0)
    """

    __slots__ = ("atoms", "node")

    def __init__(self, node: Node, atoms: Mapping[str, SetValued] = _NONE) -> None:
        self.node = node
        self.atoms = atoms

    def __repr__(self) -> str:
        return f"Expr({show(self.node)})"

    @property
    def names(self) -> frozenset[str]:
        """Names of the variables in it, ``time`` among them."""
        return names_of(self.node)

    def derivative(self, variable: Expr) -> Expr:
        """Return the exact derivative with respect to a variable.

        Examples
        --------
        >>> from nsspice.dvi import unknowns
        >>> (q,) = unknowns("q", 1)
        >>> (q**3).derivative(q)
        Expr(3*q[0]**2)
        """
        return Expr(_derivative(self.node, variable.name), self.atoms)

    @property
    def name(self) -> str:
        """Name of a variable.

        Raises
        ------
        UsageError
            NS6002 if it is a compound expression.
        """
        if self.node.op != "var":
            raise wrong(
                "NS6002", f"{show(self.node)} is not a variable", "name the variable itself"
            )
        return str(self.node.value)

    def value(self, values: Mapping[str, Any]) -> Any:
        """Return the value for given variables by name; arrays give arrays."""
        if any(getattr(value, "ndim", 0) for value in values.values()):
            return _evaluate.array(self.node, values)
        return _evaluate.scalar(self.node, values)

    def _binary(
        self, other: Operand, build: Callable[[Node, Node], Node], swapped: bool = False
    ) -> Any:
        if isinstance(other, np.ndarray) and other.ndim:
            return NotImplemented
        if isinstance(other, Expr):
            right, atoms = other.node, merged(self.atoms, other.atoms)
        elif isinstance(other, Real) or (isinstance(other, np.ndarray) and not other.ndim):
            right, atoms = num(_finite(float(other))), self.atoms
        else:
            return NotImplemented
        pair = (right, self.node) if swapped else (self.node, right)
        return Expr(build(*pair), atoms)

    def __add__(self, other: Operand) -> Any:
        return self._binary(other, lambda a, b: add((a, b)))

    def __radd__(self, other: Operand) -> Any:
        return self._binary(other, lambda a, b: add((a, b)), swapped=True)

    def __sub__(self, other: Operand) -> Any:
        return self._binary(other, sub)

    def __rsub__(self, other: Operand) -> Any:
        return self._binary(other, sub, swapped=True)

    def __mul__(self, other: Operand) -> Any:
        return self._binary(other, lambda a, b: mul((a, b)))

    def __rmul__(self, other: Operand) -> Any:
        return self._binary(other, lambda a, b: mul((a, b)), swapped=True)

    def __truediv__(self, other: Operand) -> Any:
        return self._binary(other, div)

    def __rtruediv__(self, other: Operand) -> Any:
        return self._binary(other, div, swapped=True)

    def __pow__(self, other: Operand) -> Any:
        return self._binary(other, power)

    def __rpow__(self, other: Operand) -> Any:
        return self._binary(other, power, swapped=True)

    def __neg__(self) -> Expr:
        return Expr(neg(self.node), self.atoms)

    def __pos__(self) -> Expr:
        return self

    def __abs__(self) -> Expr:
        return self._call("abs")

    def __bool__(self) -> bool:
        raise wrong(
            "NS6002",
            f"{show(self.node)} is not a condition: its value is not known while the model is "
            f"written",
            "use dvi.maximum, dvi.minimum or Sgn",
        )

    def _call(self, function: str) -> Expr:
        return Expr(call(function, self.node), self.atoms)

    # numpy's functions of arrays of expressions call methods of these names

    def sin(self) -> Expr:
        """Return the sine."""
        return self._call("sin")

    def cos(self) -> Expr:
        """Return the cosine."""
        return self._call("cos")

    def tan(self) -> Expr:
        """Return the tangent."""
        return self._call("tan")

    def exp(self) -> Expr:
        """Return the exponential."""
        return self._call("exp")

    def log(self) -> Expr:
        """Return the natural logarithm."""
        return self._call("ln")

    def sqrt(self) -> Expr:
        """Return the square root."""
        return self._call("sqrt")

    def sinh(self) -> Expr:
        """Return the hyperbolic sine."""
        return self._call("sinh")

    def cosh(self) -> Expr:
        """Return the hyperbolic cosine."""
        return self._call("cosh")

    def tanh(self) -> Expr:
        """Return the hyperbolic tangent."""
        return self._call("tanh")

    def arcsinh(self) -> Expr:
        """Return the inverse hyperbolic sine."""
        return self._call("asinh")

    def arctan(self) -> Expr:
        """Return the inverse tangent."""
        return self._call("atan")


def _finite(value: float) -> float:
    if not np.isfinite(value):
        raise wrong("NS6002", f"{value} appears in an expression", "give finite numbers")
    return value


def merged(*parts: Mapping[str, SetValued]) -> Mapping[str, SetValued]:
    """Return set-valued terms of several expressions together."""
    used = [part for part in parts if part]
    if len(used) < 2:
        return used[0] if used else _NONE
    return {name: atom for part in used for name, atom in part.items()}


def names_of(node: Node) -> frozenset[str]:
    """Return the names of the variables of a tree."""
    found: set[str] = set()
    seen: set[int] = set()
    todo = [node]
    while todo:
        here = todo.pop()
        if id(here) in seen:
            continue
        seen.add(id(here))
        if here.op == "var":
            found.add(str(here.value))
        todo.extend(here.args)
    return frozenset(found)


def as_expr(value: Operand) -> Expr:
    """Return a number or an expression as an expression."""
    if isinstance(value, Expr):
        return value
    if isinstance(value, np.ndarray) and value.shape in ((), (1,)):
        return as_expr(value.item())
    if isinstance(value, Real):
        return Expr(num(_finite(float(value))))
    raise wrong("NS6002", f"{value!r} is neither a number nor an expression", "")


def as_vector(value: Operand) -> list[Expr]:
    """Return numbers and expressions, one or several, as a list of expressions."""
    if hasattr(value, "toarray"):
        value = value.toarray()
    array = np.asarray(value, dtype=object)
    return [as_expr(item) for item in array.ravel()]


def _lifted(name: str, text: str) -> Callable[[Operand], Any]:
    def function(x: Operand) -> Any:
        if isinstance(x, np.ndarray | list | tuple):
            array = np.asarray(x, dtype=object)
            return np.array([function(item) for item in array.ravel()], dtype=object).reshape(
                array.shape
            )
        return as_expr(x)._call(name)

    function.__name__ = function.__qualname__ = text
    function.__doc__ = f"Return ``{text}`` of an expression, or of each of an array of them."
    return function


sin = _lifted("sin", "sin")
cos = _lifted("cos", "cos")
tan = _lifted("tan", "tan")
exp = _lifted("exp", "exp")
log = _lifted("ln", "log")
sqrt = _lifted("sqrt", "sqrt")
sinh = _lifted("sinh", "sinh")
cosh = _lifted("cosh", "cosh")
tanh = _lifted("tanh", "tanh")
asinh = _lifted("asinh", "asinh")
atan = _lifted("atan", "atan")


def _folded(name: str, values: tuple[Operand, ...]) -> Expr:
    parts = [as_expr(value) for value in values]
    node = parts[0].node
    for part in parts[1:]:
        node = call(name, node, part.node)
    return Expr(node, merged(*(part.atoms for part in parts)))


def maximum(*values: Operand) -> Expr:
    """Return the largest of some expressions, which has kinks."""
    return _folded("max", values)


def minimum(*values: Operand) -> Expr:
    """Return the smallest of some expressions, which has kinks."""
    return _folded("min", values)


#: the time [s]
t = Expr(var("time"))
