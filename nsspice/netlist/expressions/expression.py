"""Expressions of circuit signals: ``v(a)*i(v1)``, evaluated and differentiated exactly.

Examples
--------
>>> power = Expression.parse("v(a)**2 / 50")
>>> power.evaluate({"v(a)": 10.0})
2.0
>>> power.derivative("v(a)").evaluate({"v(a)": 10.0})
0.4
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ...errors import Diagnostic, NetlistError, Span
from . import evaluate as _evaluate
from .derivative import derivative as _derivative
from .functions import JUMPING_FUNCTIONS, JUMPING_OPERATORS
from .node import MAX_DEPTH, Node, TooLarge, num, show


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression of signals.

    Parameters
    ----------
    node : Node
        The tree; ``nsspice.netlist.expressions.node`` lists its operations.
    span : Span or None
        Where it is in the netlist.
    source : str
        As the user wrote it; empty for derived expressions.
    """

    node: Node
    span: Span | None = None
    source: str = ""

    @classmethod
    def parse(cls, text: str, span: Span | None = None) -> Expression:
        """Read an expression without parameters.

        Parameters
        ----------
        text : str
            Such as ``2*v(out) + i(v1)``.
        span : Span, optional
            Place for messages.

        Raises
        ------
        NetlistError
            If it cannot be read, or holds an unknown name.

        Examples
        --------
        >>> sorted(Expression.parse("v(OUT, in)*TIME").variables())
        ['time', 'v(out,in)']
        """
        from ..findings import Unreadable
        from .expression_parser import free_expression

        try:
            return cls(free_expression(text, span), span, text)
        except Unreadable as found:
            raise NetlistError(
                Diagnostic(found.code, found.message, found.span, found.hint)
            ) from None

    @property
    def text(self) -> str:
        """The expression as text: the user's own, or one that parses back to the same values."""
        return self.source or show(self.node)

    def variables(self) -> frozenset[str]:
        """Return the signals it depends on, by canonical names.

        Returns
        -------
        frozenset of str
            ``v(a)``, ``v(a,b)``, ``i(v1)``, ``time``, ``temper``, and ``i`` for an element's own
            current.
        """
        return frozenset(str(n.value) for n in self._nodes() if n.op in ("var", "name"))

    def jumps(self) -> bool:
        """Return whether some function in it jumps: a condition, a comparison, a step, rounding.

        Examples
        --------
        >>> Expression.parse("5*u(v(a) - 1)").jumps(), Expression.parse("max(v(a), 1)").jumps()
        (True, False)
        """
        return any(
            n.op in JUMPING_OPERATORS or (n.op == "call" and n.value in JUMPING_FUNCTIONS)
            for n in self._nodes()
        )

    def _nodes(self) -> Iterator[Node]:
        """Yield every node, shared ones once."""
        seen: set[int] = set()
        todo = [self.node]
        while todo:
            node = todo.pop()
            yield node
            for arg in node.args:
                if id(arg) not in seen:
                    seen.add(id(arg))
                    todo.append(arg)

    def evaluate(self, values: Mapping[str, Any]) -> Any:
        """Return the value for given signals.

        Parameters
        ----------
        values : mapping of str to float or numpy array
            One entry for each of ``variables()`` [V, A, s, degrees Celsius]; others are ignored.

        Returns
        -------
        float or numpy array
            An array if one of the values is one.  Outside the domain of a function nan, beyond the
            range of doubles inf; nothing is raised.

        Raises
        ------
        KeyError
            If a signal has no value.

        Examples
        --------
        >>> import numpy as np
        >>> Expression.parse("max(v(a), 1)").evaluate({"v(a)": np.array([0.0, 2.0])})
        array([1., 2.])
        """
        # only its own: results of a thousand measures may be there as well
        own = (values[name] for name in self.variables() if name in values)
        if any(getattr(value, "ndim", 0) for value in own):
            return _evaluate.array(self.node, values)
        return _evaluate.scalar(self.node, values)

    def derivative(self, variable: str) -> Expression:
        """Return the exact derivative with respect to one signal.

        Examples
        --------
        >>> Expression.parse("sin(v(a))*3").derivative("v(a)").text
        'cos(v(a))*3'
        """
        try:
            return Expression(_derivative(self.node, variable), self.span)
        except TooLarge:
            raise NetlistError(self._too_large()) from None

    def substitute(self, values: Mapping[str, float]) -> Expression:
        """Return the expression with some signals replaced by numbers, constants folded.

        Examples
        --------
        >>> Expression.parse("v(a)*temper*2").substitute({"temper": 3.0}).text
        'v(a)*3*2'
        """

        def replace(node: Node) -> Node:
            value = values.get(str(node.value))
            return node if value is None else num(value)

        return Expression(_evaluate.rebuild(self.node, replace), self.span)

    def _too_large(self) -> Diagnostic:
        message = f"expression is nested deeper than {MAX_DEPTH} or too large: {self.text[:60]}"
        return Diagnostic("NS1023", message, self.span, "split it into several elements")
