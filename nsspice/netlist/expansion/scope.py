"""Names of one instance: parameters, functions, models, subcircuits, nodes.

Scopes nest as the definitions do: a subcircuit sees its own names first, then those of the block in
which it is *defined*.  Parameters are evaluated when asked for, so their order does not matter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from ...errors import Span, suggest
from ..deck import Grid, Model, Param
from ..elements.template import Formula, FunctionTemplate, GridText, ModelTemplate, ParamText, Value
from ..expressions.evaluate import scalar
from ..expressions.expression import Expression
from ..expressions.expression_parser import voltage
from ..expressions.node import Node, var
from ..findings import Unreadable
from ..text.numbers import as_float
from .binding import NOTHING, bind, names
from .body import Body, Subcircuit
from .draws import Draws

#: types of cards whose parameters may name other cards
_NAMING = frozenset({"nigbt", "nmos", "npn", "pigbt", "pmos", "pnp"})


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
    temperature : float
        [degrees Celsius]
    draws : Draws, optional
        Random numbers.
    """

    def __init__(
        self,
        parent: Scope | None,
        prefix: str,
        nodes: dict[str, str],
        globals_: set[str],
        temperature: float = 27.0,
        draws: Draws | None = None,
    ) -> None:
        self.parent = parent
        self.prefix = prefix
        self.temperature: float = parent.temperature if parent else temperature
        self.draws: Draws | None = parent.draws if parent else draws
        self.params: dict[str, tuple[Formula, Span]] = {}
        self.values: dict[str, float] = {}
        self.fixed: dict[str, float] = {}
        #: fixed values that something has asked for
        self.asked: set[str] = set()
        self.functions: dict[str, FunctionTemplate] = {}
        self.models: dict[str, ModelTemplate] = {}
        self.subcircuits: dict[str, Subcircuit] = {}
        self.used_temper = False
        #: gives the cards of standard parts; of the deck's own scope
        self.parts: Callable[[str], ModelTemplate | None] | None = None
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
        """Return the scope of an instance of a definition that is in ``home``."""
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
                scope.asked.add(name)
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
            message = f"parameter {name}: functions and parameters refer to each other in a loop"
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
                        n for n in names(formula.node)
                        if n in self.params and n not in self.values and n not in self.fixed
                    ]  # fmt: skip
                for other in missing:
                    if other in path:
                        chain = [*list(path)[list(path).index(other) :], other]
                        message = f"parameters form a loop: {' -> '.join(chain[:30])}"
                        raise Unreadable(
                            "NS1030", message, where, "replace one of them by a number"
                        )
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

    def bind(
        self, formula: Formula, own_current: bool = False, local: Mapping[str, Node] = NOTHING
    ) -> Node:
        """Return a tree with all names looked up, functions put in and constants folded."""
        return bind(self, formula, own_current, local)

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
        signals = Expression(tree).variables()
        if "temper" in signals:
            self._root().used_temper = True
        changing = sorted(signals - {"temper"})
        if changing:
            message = f"a number is needed here, but {changing[0]} changes during the run"
            hint = "a B, E or G source may depend on signals"
            raise Unreadable("NS1025", message, value.span, hint)
        number = scalar(tree, {"temper": self.temperature})
        if not math.isfinite(number):
            message = f"{value.text[:60]} has no finite value"
            hint = "look for a division by zero, a logarithm or a root of a negative number"
            raise Unreadable("NS1024", message, value.span, hint)
        return number

    def expression(
        self,
        value: Value,
        own_current: bool = False,
        thermal: bool = False,
        local: Mapping[str, Node] = NOTHING,
    ) -> float | Expression:
        """Return a number, or an expression if signals are involved.

        With ``thermal`` the temperature counts as a signal, which a sweep changes.
        """
        if isinstance(value, float):
            return value
        tree = self.bind(value, own_current, local)
        if local and tree.op == "num":
            return as_float(tree.value)
        if tree.op != "num":
            found = Expression(tree, value.span, "" if value.made else value.text)
            if found.variables() - (set() if thermal else {"temper"}):
                return found
        return self.number(value)

    def _root(self) -> Scope:
        scope = self
        while scope.parent is not None:
            scope = scope.parent
        return scope

    # -- parameters of elements and models ---------------------------------------------------

    def param(self, name: str, given: ParamText) -> Param:
        """Return an evaluated ``name=value``; a word that is not a parameter stays a word."""
        value = given.value
        if isinstance(value, Formula):
            return Param(name, self.expression(value, own_current=True), given.span)
        if isinstance(value, GridText):
            lists = {k: tuple(map(self.number, v)) for k, v in value.lists.items()}
            return Param(name, Grid(lists), given.span)
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
                kind = card.type
                if card.base:
                    base = scope.model(card.base) if card.base != name else None
                    if base is None:
                        message = f"model {name}: there is no model {card.base}"
                        hint = suggest(card.base, self.known("models"))
                        raise Unreadable("NS1060", message, card.span, hint, card.base)
                    params, kind = {**base.params, **params}, kind or base.type
                made = Model(name, kind, params, card.span)
                scope._made[name] = made
                if card.type in _NAMING:
                    made.models.update(scope.named_models(card.params))
                return made
            if scope.parent is None:
                return scope.standard(name)
            scope = scope.parent
        return None

    def standard(self, name: str) -> Model | None:
        """Return the card of a standard part, which the deck does not bring itself."""
        if self.parts is None or (card := self.parts(name)) is None:
            return None
        self.models[name] = card
        return self.model(name)

    @property
    def made(self) -> list[str]:
        """Names of its models that something uses."""
        return list(self._made)

    def named_models(self, params: Mapping[str, ParamText]) -> dict[str, Model]:
        """Return the model cards that parameters of a transistor name.

        Raises
        ------
        Unreadable
            If there is no such card.
        """
        found: dict[str, Model] = {}
        for key in ("de", "dc", "body"):
            text = params.get(key)
            if text is None:
                continue
            model = self.model(text.value) if isinstance(text.value, str) else None
            if model is None:
                shown = text.word or text.value if isinstance(text.value, str) else key
                hint = suggest(str(text.value), self.known("models")) or "name a .model of type d"
                message = f"{key}: there is no model {shown}"
                raise Unreadable("NS1060", message, text.span, hint, str(text.value))
            found[key] = model
        return found
