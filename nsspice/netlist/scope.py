"""Names of one instance: parameters, functions, models, subcircuits, nodes.

Scopes nest as the definitions do: a subcircuit sees its own names first, then those of the block in
which it is *defined*.  Parameters are evaluated when asked for, so their order does not matter.
"""

from __future__ import annotations

import math
import re
from itertools import pairwise

from ..errors import Span
from .body import Body, Subcircuit
from .deck import Model, Param
from .evaluate import fold, scalar
from .expression import Expression
from .expression_parser import resolve, voltage
from .findings import Unreadable, suggest
from .functions import CONSTANTS
from .node import Node, TooLarge, num, var
from .template import Formula, FunctionTemplate, ModelTemplate, ParamText, Value

#: depth of a bound expression with all functions put in
_MAX_DEPTH = 150
_SIGNALS = {"time"}


class Scope:
    """One instance of a subcircuit, or the deck itself.

    Parameters
    ----------
    parent : Scope or None
        Scope of the block that holds the definition.
    prefix : str
        Path of the instance with a final dot; empty for the deck.
    nodes : dict of str to str
        Actual nodes of the formal ones.
    globals_ : set of str
        Nodes that no instance renames, shared by all scopes.
    """

    def __init__(
        self,
        parent: Scope | None,
        prefix: str,
        nodes: dict[str, str],
        globals_: set[str],
        temperature: float = 27.0,
    ) -> None:
        self.parent = parent
        self.prefix = prefix
        self.temperature: float = parent.temperature if parent else temperature
        self.params: dict[str, tuple[Formula, Span]] = {}
        self.values: dict[str, float] = {}
        self.fixed: dict[str, float] = {}
        self.functions: dict[str, FunctionTemplate] = {}
        self.models: dict[str, ModelTemplate] = {}
        self.subcircuits: dict[str, Subcircuit] = {}
        self.used_temper = False
        self._failed: dict[str, Unreadable] = {}
        self._nodes = nodes
        self._globals = globals_
        self._made: dict[str, Model] = {}
        self._depth = 0

    def declare(self, body: Body) -> None:
        """Add the declarations of a body."""
        self.params.update(body.params)
        self.functions.update(body.functions)
        self.models.update(body.models)
        self.subcircuits.update(body.subcircuits)
        if body.params or body.functions:
            self.values.clear()
            self._failed.clear()

    # -- names -------------------------------------------------------------------------------

    def node(self, local: str) -> str:
        """Return the full name of a node."""
        if not self.prefix:
            return "0" if local == "gnd" else local
        full = self._nodes.get(local)
        if full is None:
            if local in ("0", "gnd"):
                full = "0"
            else:
                full = local if local in self._globals else self.prefix + local
            self._nodes[local] = full
        return full

    def signal(self, name: str) -> Node:
        """Return a signal with the full names of its nodes or element."""
        if not self.prefix or name[1:2] != "(":
            return var(name)
        if name[0] == "i":
            return var(f"i({self.prefix}{name[2:-1]})")
        return voltage(*[self.node(part) for part in name[2:-1].split(",")])

    def add_globals(self, names: list[str]) -> None:
        """Let all scopes share nodes of these names."""
        self._globals.update(names)

    def child(self, home: Scope, name: str, nodes: dict[str, str]) -> Scope:
        """Return the scope of an instance of a definition that stands in ``home``."""
        return Scope(home, f"{self.prefix}{name}.", nodes, self._globals)

    def subcircuit(self, name: str) -> tuple[Subcircuit, Scope] | None:
        """Return a definition and the scope that holds it."""
        scope: Scope | None = self
        while scope is not None:
            if name in scope.subcircuits:
                return scope.subcircuits[name], scope
            scope = scope.parent
        return None

    def known(self, kind: str) -> list[str]:
        """Return all names in sight of one kind (an attribute), for suggestions."""
        result: list[str] = []
        scope: Scope | None = self
        while scope is not None:
            result.extend(getattr(scope, kind))
            scope = scope.parent
        return result

    # -- parameters --------------------------------------------------------------------------

    def parameter(self, name: str) -> float | None:
        """Return a parameter's value, None if nobody defines it.

        Raises
        ------
        Unreadable
            If the definition cannot be evaluated, or leads back to itself.
        """
        scope: Scope | None = self
        while scope is not None:
            if name in scope.fixed:
                return scope.fixed[name]
            if name in scope.values:
                return scope.values[name]
            if name in scope.params:
                return scope._evaluated(name)
            scope = scope.parent
        return None

    def _evaluated(self, name: str) -> float:
        """Evaluate a parameter of this scope after all those it needs, without recursion."""
        if name in self._failed:  # once reported, not once more under another name
            raise self._failed[name]
        if self._depth > 20:  # parameters within functions within parameters ...
            _, where = self.params[name]
            message = f"parameter {name}: functions and parameters lead back to each other"
            raise Unreadable("NS1030", message, where)
        self._depth += 1
        stack = [name]
        path: dict[str, None] = {}  # the chain of names being evaluated, in order
        try:
            while stack:
                current = stack[-1]
                if current in self.values:
                    stack.pop()
                    continue
                formula, where = self.params[current]
                missing = []
                if current not in path:
                    path[current] = None
                    missing = [
                        n for n in _names(formula.node)
                        if n in self.params and n not in self.values and n not in self.fixed
                    ]  # fmt: skip
                for other in missing:
                    if other in path:
                        chain = [*list(path)[list(path).index(other) :], other]
                        message = f"parameters form a loop: {' -> '.join(chain[:30])}"
                        raise Unreadable("NS1030", message, where, "break it with a number")
                if missing:
                    stack.extend(missing)
                    continue
                self.values[current] = self.number(formula)
                path.pop(current, None)
                stack.pop()
            return self.values[name]
        except Unreadable as found:
            self._failed.update(dict.fromkeys([name, *path], found))
            raise
        finally:
            self._depth -= 1

    # -- expressions -------------------------------------------------------------------------

    def bind(self, formula: Formula, own_current: bool = False) -> Node:
        """Return a tree with all names looked up, functions put in and constants folded."""
        try:
            return self._bind(formula.node, {}, formula, own_current, (), 0)
        except TooLarge:
            message = f"expression is too deep or too large: {formula.text[:60]}"
            raise Unreadable("NS1023", message, formula.span, "split it into steps") from None

    def _bind(
        self,
        node: Node,
        formals: dict[str, Node],
        formula: Formula,
        own: bool,
        active: tuple[str, ...],
        depth: int,
    ) -> Node:
        op = node.op
        if op == "num":
            return node
        if op == "name":
            word = str(node.value)
            return formals[word] if word in formals else self._word(word, formula, own)
        if op == "var":
            return self.signal(str(node.value))
        if depth > _MAX_DEPTH:
            raise TooLarge
        if op == "if":  # the branch not taken may hold what has no value, as 1/0
            condition = self._bind(node.args[0], formals, formula, own, active, depth + 1)
            if condition.op == "num":
                branch = node.args[1 if condition.value != 0.0 else 2]
                return self._bind(branch, formals, formula, own, active, depth + 1)
        args = []
        for arg in node.args:
            args.append(self._bind(arg, formals, formula, own, active, depth + 1))
        if op == "call" and str(node.value)[0] == "?":
            return self._function(str(node.value)[1:], args, formula, own, active, depth)
        made = Node(op, tuple(args), node.value)
        _check_table(made, formula)
        return fold(made)

    def _word(self, word: str, formula: Formula, own: bool) -> Node:
        """Return what an identifier stands for."""
        value = self.parameter(word)
        if value is not None:
            return num(value)
        if word in _SIGNALS or word == "temper" or (own and word == "i"):
            return var(word)
        if word in CONSTANTS:
            return num(CONSTANTS[word])
        where = self._place(word, formula)
        if word in ("hertz", "freq", "frequency", "omega", "w"):
            hint = "there is no .ac analysis here" if word != "w" else ""
        else:
            hint = ""
        known = [*self.known("params"), *self.known("fixed"), "time", "temper"]
        hint = hint or suggest(word, known) or f"define it with .param {word}=..."
        raise Unreadable("NS1021", f"parameter {word[:60]} is not defined", where, hint)

    @staticmethod
    def _place(word: str, formula: Formula) -> Span:
        """Return where a name stands in an expression."""
        pattern = re.compile(rf"(?<![\w.]){re.escape(word)}(?![\w.])")
        found = pattern.search(formula.line.text, formula.start, formula.end)
        return formula.line.span(*found.span()) if found else formula.span

    def _function(
        self,
        name: str,
        args: list[Node],
        formula: Formula,
        own: bool,
        active: tuple[str, ...],
        depth: int,
    ) -> Node:
        """Put the body of a user function in place of its call."""
        scope: Scope | None = self
        while scope is not None and name not in scope.functions:
            scope = scope.parent
        if scope is None:
            made = resolve(name, args, self.known("functions"), self._place(name, formula))
            _check_table(made, formula)
            return fold(made)
        function = scope.functions[name]
        if name in active:
            chain = " -> ".join([*active[active.index(name) :], name])
            message = f"functions form a loop: {chain}"
            raise Unreadable("NS1031", message, function.span, "a function cannot call itself")
        if len(args) != len(function.formals):
            message = f"{name} needs {len(function.formals)} arguments, not {len(args)}"
            raise Unreadable("NS1022", message, formula.span)
        formals = dict(zip(function.formals, args, strict=True))
        inner = (*active, name)
        return scope._bind(function.body.node, formals, function.body, own, inner, depth + 1)

    def number(self, value: Value) -> float:
        """Return the number an expression gives.

        Raises
        ------
        Unreadable
            If it holds signals, or has no finite value.
        """
        if isinstance(value, float):
            return value
        tree = self.bind(value)
        if tree.op != "num":
            signals = sorted(Expression(tree).variables())
            if signals == ["temper"]:
                self._root().used_temper = True
                tree = num(scalar(tree, {"temper": self.temperature}))
            else:
                signals = [s for s in signals if s != "temper"]
                message = f"a number is needed here, and {signals[0]} changes during the run"
                hint = "a B, E or G source may depend on signals"
                raise Unreadable("NS1025", message, value.span, hint)
        number = float(tree.value)
        if not math.isfinite(number):
            message = f"{value.text[:60]} has no finite value"
            hint = "look for a division by zero, a logarithm or a root of a negative number"
            raise Unreadable("NS1024", message, value.span, hint)
        return number

    def expression(self, value: Value, own_current: bool = False) -> float | Expression:
        """Return a number, or an expression if signals are involved."""
        if isinstance(value, float):
            return value
        tree = self.bind(value, own_current)
        if tree.op != "num":
            found = Expression(tree, value.span, "" if value.made else value.text)
            if found.variables() != {"temper"}:
                return found
        return self.number(value)

    def _root(self) -> Scope:
        scope = self
        while scope.parent is not None:
            scope = scope.parent
        return scope

    # -- parameters of elements and models ---------------------------------------------------

    def param(self, name: str, given: ParamText) -> Param:
        """Return an evaluated ``name=value``; a word that is no parameter stays a word."""
        value = given.value
        if isinstance(value, Formula):
            return Param(name, self.expression(value, own_current=True), given.span)
        if isinstance(value, str) and given.word:
            number = self.parameter(value)
            if number is not None:
                return Param(name, number, given.span)
        return Param(name, value, given.span)

    def model(self, name: str) -> Model | None:
        """Return a model in sight, evaluated once per scope."""
        scope: Scope | None = self
        while scope is not None:
            if name in scope._made:
                return scope._made[name]
            if name in scope.models:
                card = scope.models[name]
                params = {key: scope.param(key, text) for key, text in card.params.items()}
                made = Model(name, card.type, params, card.span)
                scope._made[name] = made
                return made
            scope = scope.parent
        return None


def _names(node: Node) -> list[str]:
    """Return the identifiers of a tree in order."""
    found: dict[str, None] = {}
    stack = [node]
    while stack:
        current = stack.pop()
        if current.op == "name":
            found[str(current.value)] = None
        stack.extend(current.args)
    return list(found)


def _check_table(node: Node, formula: Formula) -> None:
    """Refuse a table whose x go down: it is no function."""
    if node.op != "call" or node.value != "pwl":
        return
    xs = node.args[1::2]
    if all(x.op == "num" for x in xs) and any(
        float(b.value) < float(a.value) for a, b in pairwise(xs)
    ):
        message = "the x values of a table must not decrease"
        raise Unreadable("NS1024", message, formula.span, "sort the pairs by x")
