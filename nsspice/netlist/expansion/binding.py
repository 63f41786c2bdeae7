"""Looking up the names of an expression: parameters become numbers, functions their bodies."""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING

from ...errors import Span, suggest
from ..elements.template import Formula
from ..expressions.evaluate import fold
from ..expressions.expression_parser import resolve, unknown_function
from ..expressions.functions import ARITY, CONSTANTS
from ..expressions.node import Node, TooLarge, add, mul, num, var
from ..findings import Unreadable
from .draws import NAMES

if TYPE_CHECKING:
    from .scope import Scope

#: depth of an expression with all functions put in
_MAX_DEPTH = 150
#: functions that call each other twice need time that doubles with each of them
_MAX_CALLS = 50_000
NOTHING: Mapping[str, Node] = {}
#: Boltzmann's constant over the charge of an electron [V/K]
_BOLTZMANN = 1.380649e-23 / 1.602176634e-19
_NO_AC = {"hertz", "freq", "frequency", "omega"}


def bind(
    scope: Scope, formula: Formula, own_current: bool, local: Mapping[str, Node] = NOTHING
) -> Node:
    """Return a tree with all names looked up, functions put in and constants folded.

    Parameters
    ----------
    scope : Scope
        Where names are looked up first.
    formula : Formula
        The expression.
    own_current : bool
        Whether a bare ``i`` is the current of the element that the expression belongs to.
    local : mapping of str to Node
        Names that go before all others: ``x`` of a charge or a flux.

    Raises
    ------
    Unreadable
        For names that nobody defines, and for expressions that grow beyond all bounds.
    """
    try:
        return _Binder(own_current).bind(scope, formula.node, dict(local), formula, (), 0)
    except TooLarge:
        message = f"expression is too deep or too large: {formula.text[:60]}"
        raise Unreadable("NS1023", message, formula.span, "split it into steps") from None


class _Binder:
    """Binds one expression; counts the functions put in."""

    def __init__(self, own_current: bool) -> None:
        self._own_current = own_current
        self._calls = 0

    def bind(
        self,
        scope: Scope,
        node: Node,
        formals: dict[str, Node],
        formula: Formula,
        active: tuple[str, ...],
        depth: int,
    ) -> Node:
        """Bind one node; ``formals`` are the arguments of the function whose body this is."""
        op = node.op
        if op == "num":
            return node
        if op == "name":
            word = str(node.value)
            return formals[word] if word in formals else self._word(scope, word, formula)
        if op == "var":
            return scope.signal(str(node.value))
        if depth > _MAX_DEPTH:
            raise TooLarge
        if op == "if":  # the branch not taken may hold what has no value, as 1/0
            condition = self.bind(scope, node.args[0], formals, formula, active, depth + 1)
            if condition.op == "num":
                branch = node.args[1 if condition.value != 0.0 else 2]
                return self.bind(scope, branch, formals, formula, active, depth + 1)
        called = str(node.value)[1:] if op == "call" and str(node.value)[0] == "?" else ""
        known = called in ARITY or called in NAMES
        if called and not known and called not in (own := scope.known("functions")):
            # before its arguments: those of p(r1) are not parameters
            raise unknown_function(called, own, _place(called, formula))
        args = []
        for arg in node.args:
            args.append(self.bind(scope, arg, formals, formula, active, depth + 1))
        if called:
            return self._call(scope, called, args, formula, active, depth)
        made = Node(op, tuple(args), node.value)
        _check_table(made, formula)
        return fold(made)

    def _word(self, scope: Scope, word: str, formula: Formula) -> Node:
        """Return what an identifier stands for."""
        value = scope.parameter(word)
        if value is not None:
            return num(value)
        if word in ("time", "temper") or (self._own_current and word == "i"):
            return var(word)
        if word == "temp":  # PSpice's and LTspice's name
            return var("temper")
        if word in CONSTANTS:
            return num(CONSTANTS[word])
        if word == "vt":  # PSpice's thermal voltage
            return mul((num(_BOLTZMANN), add((var("temper"), num(273.15)))))
        known = [*scope.known("params"), *scope.known("fixed"), "time", "temper"]
        hint = suggest(word, known) or f"define it with .param {word[:60]}=..."
        if word in _NO_AC:
            hint = "only .op, .dc, .tran, .ac, .pss and .loop are computed"
        message = f"parameter {word[:60]} is not defined"
        raise Unreadable("NS1021", message, _place(word, formula), hint, word)

    def _call(
        self,
        scope: Scope,
        name: str,
        args: list[Node],
        formula: Formula,
        active: tuple[str, ...],
        depth: int,
    ) -> Node:
        """Put the body of a .func in place of its call, or resolve a built-in function."""
        home: Scope | None = scope
        while home is not None and name not in home.functions:
            home = home.parent
        if home is None:
            drawn = None
            if name in NAMES and scope.draws is not None and all(arg.op == "num" for arg in args):
                drawn = scope.draws.draw(name, [float(arg.value) for arg in args])
            if drawn is not None:
                return num(drawn)
            made = resolve(name, args, scope.known("functions"), _place(name, formula))
            _check_table(made, formula)
            return fold(made)
        function = home.functions[name]
        if name in active:
            chain = " -> ".join([*active[active.index(name) :], name])
            message = f"functions form a loop: {chain}"
            raise Unreadable("NS1031", message, function.span, "a function cannot call itself")
        if len(args) != len(function.formals):
            message = f"{name} needs {len(function.formals)} arguments, not {len(args)}"
            raise Unreadable("NS1022", message, _place(name, formula))
        self._calls += 1
        if self._calls > _MAX_CALLS:
            raise TooLarge
        formals = dict(zip(function.formals, args, strict=True))
        body = function.body
        return self.bind(home, body.node, formals, body, (*active, name), depth + 1)


def names(node: Node) -> list[str]:
    """Return the identifiers of a tree that has not been bound, each once."""
    found: dict[str, None] = {}
    stack = [node]
    while stack:
        current = stack.pop()
        if current.op == "name":
            found[str(current.value)] = None
        stack.extend(current.args)
    return list(found)


def _place(word: str, formula: Formula) -> Span:
    """Return where a name is in an expression."""
    pattern = re.compile(rf"(?<![\w.]){re.escape(word)}(?![\w.])")
    found = pattern.search(formula.line.text, formula.start, formula.end)
    return formula.line.span(*found.span()) if found else formula.span


def _check_table(node: Node, formula: Formula) -> None:
    """Refuse a table whose x go down: it is not a function."""
    if node.op != "call" or node.value != "pwl":
        return
    xs = node.args[1::2]
    if all(x.op == "num" for x in xs) and any(
        float(b.value) < float(a.value) for a, b in pairwise(xs)
    ):
        message = "the x values of a table must not decrease"
        raise Unreadable("NS1024", message, formula.span, "sort the pairs by x")
