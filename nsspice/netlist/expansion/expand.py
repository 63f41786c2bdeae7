"""From bodies to flat elements: instances unfolded, parameters and node names put in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from ...element_kinds import KINDS
from ...errors import Span, suggest
from ..deck import Delay, Element, Param, Sampled, Source
from ..elements.template import CodeTemplate, Formula, InstanceTemplate, SourceTemplate, Template
from ..expressions.expression import Expression
from ..expressions.expression_parser import voltage
from ..expressions.node import Node, num, var
from ..findings import Findings, Unreadable
from ..text.lines import Line
from ..text.script import Command
from ..text.structure import build
from .binding import NOTHING
from .body import Body, BodyReader, Choice, Subcircuit
from .coded import Coded
from .scope import Scope

#: elements of an expanded deck; more would not fit into memory anyway
MAX_ELEMENTS = 1_000_000
#: equal instances of one X line
MAX_MULTIPLE = 100
#: subcircuits within subcircuits
MAX_NESTING = 50
#: elements whose expressions may have derivatives and integrals in time
_REMEMBERING = frozenset("begfh")
#: model types whose standard values are a usable device
_TYPES = frozenset(["d", "njf", "pjf", "nmos", "npn", "pmos", "pnp", "vdmos"])

#: a model card for each letter that needs one
_CARDS = {
    "d": "D(ideal)",
    "s": "SW(VT=0.5)",
    "w": "CSW(IT=1m)",
    "q": "NPN(IS=1e-15 BF=100)",
    "m": "NMOS(VTO=2 KP=1)",
    "j": "NJF(VTO=-2 BETA=1m)",
    "z": "NIGBT(Ron=10m)",
    "k": "CORE(MS=4e5 A=26 K=18 C=0.1 AREA=1 PATH=10)",
}


class Expander:
    """Unfolds a deck.

    Parameters
    ----------
    findings : Findings
        Receives what is wrong.
    bodies : BodyReader
        Reads the bodies of subcircuits when they are first used.
    """

    def __init__(self, findings: Findings, bodies: BodyReader) -> None:
        self.elements: list[Element] = []
        self.sampled: list[Sampled] = []
        self.delays: list[Delay] = []
        self.places: dict[str, Span] = {}
        self.cards: list[tuple[str, Line, Scope]] = []
        #: voltages at the operating point of what integrates
        self.initial: dict[str, Param] = {}
        #: names that elements with errors would have declared
        self.doubtful = findings.doubtful
        self._findings = findings
        self._bodies = bodies
        self._instances = 0
        self._controlled: list[tuple[Element, tuple[Span, ...], str]] = []
        self.coded = Coded(findings, self.initial)

    def choose(self, scope: Scope, body: Body) -> list[Template | InstanceTemplate | CodeTemplate]:
        """Declare a body's names, decide its conditionals, return what has to be built."""
        scope.declare(body)
        self.cards += [(card, line, scope) for card, line in body.cards]
        if not any(isinstance(item, Choice) for item in body.items):
            return body.items  # type: ignore[return-value]
        result: list[Template | InstanceTemplate | CodeTemplate] = []
        for item in body.items:
            if not isinstance(item, Choice):
                result.append(item)
                continue
            for branch in item.branches:
                try:
                    if branch.condition is None or scope.number(branch.condition) != 0.0:
                        if branch.body is None:
                            branch.body = self._bodies.read(branch.block)
                        result += self.choose(scope, branch.body)
                        break
                except Unreadable as found:
                    self._findings.record(found)
                    for other in item.branches:
                        self._bodies.doubt(*other.block.entries)
                    break
        return result

    def expand(
        self,
        scope: Scope,
        items: list[Template | InstanceTemplate | CodeTemplate],
        active: tuple[Subcircuit, ...] = (),
    ) -> None:
        """Build all elements of a scope, depth first."""
        self.coded.look_over(scope, items)
        for item in items:
            try:
                if isinstance(item, Template):
                    self._element(scope, item)
                elif isinstance(item, CodeTemplate):
                    self._code_model(scope, item)
                else:
                    self._instance(scope, item, active)
            except Unreadable as found:
                self._findings.record(found)
                self.doubtful.add(scope.prefix + item.name)
                self.doubtful.update(scope.node(node) for node in item.nodes)

    def _claim(self, name: str, local: str, span: Span) -> None:
        """Register a full name; a second element of that name is an error."""
        before = self.places.get(name)
        if before is not None:
            message = f"{local} is defined twice: here and on line {before.line}"
            if before.file != span.file:
                message += f" of {before.file}"
            raise Unreadable("NS1006", message, span, "rename one of them")
        self.places[name] = span

    # -- elements ----------------------------------------------------------------------------

    def _element(self, scope: Scope, item: Template) -> None:
        """Build one element."""
        name = scope.prefix + item.name
        self._claim(name, item.name, item.span)
        if item.transfer is not None:
            self._transfer(scope, item, item.transfer)
            return
        given = item.value
        nodes, controls = item.nodes, item.controls
        if scope.prefix:
            nodes = tuple([scope.node(node) for node in nodes])
        value: float | Expression | None
        model = scope.model(item.model) if item.model else None
        if given is None and model is None and item.letter in "rcl":
            given = scope.parameter(item.model)  # R1 a b rload
        if given is None or isinstance(given, float):
            value = given
        else:
            if item.letter in _REMEMBERING:
                given = self._without_memory(scope, item.name, given)
            thermal = bool(item.quantity)
            value = scope.expression(given, item.letter in "lr", thermal, _own(item, nodes))
        if scope.prefix:
            if item.control_kind == "node":
                controls = tuple([scope.node(node) for node in controls])
            elif controls:
                controls = tuple([scope.prefix + control for control in controls])
        params = {}
        for key, text in item.params.items():
            params[key] = scope.param(key, text)
        element = Element(
            name,
            item.letter,
            nodes,
            item.span,
            controls,
            value,
            item.quantity if isinstance(value, Expression) else self._plain(item),
            model,
            self._source(scope, item.source) if item.source else None,
            params,
            dict(item.flags),
            item.node_spans,
            scope.named_models(item.params) if KINDS[item.letter].has_cards else {},
        )
        if item.model and model is None and (item.value is not None or value is None):
            raise self._no_model(scope, item)
        for part in self._parts_of(element):
            if part.name != name:
                self._claim(part.name, part.name[len(scope.prefix) :], part.span)
            if len(self.elements) >= MAX_ELEMENTS:
                raise _too_many(item.span)
            self.elements.append(part)
        if item.control_kind == "element":
            spans = item.node_spans[len(nodes) :]
            self._controlled.append((element, spans, scope.prefix))

    def _parts_of(self, element: Element) -> Iterable[Element]:
        """Return an element without its parasitics, and these."""
        if not element.params:
            return (element,)
        from ..elements.parasitics import taken_apart

        return taken_apart(element, self._findings)

    def _without_memory(self, scope: Scope, name: str, given: Formula) -> Formula:
        """Return an expression whose derivatives and integrals are elements of their own."""
        from .memory import has_memory, without_memory

        if not has_memory(given.node):
            return given
        given, memory = without_memory(name, given, scope)
        for part in memory.elements:
            self._claim(part.name, part.name[len(scope.prefix) :], part.span)
        self.elements += memory.elements
        self.initial.update(memory.initial)
        self.delays += memory.delays
        return given

    def _transfer(self, scope: Scope, item: Template, function: Formula) -> None:
        """Build the states of a transfer function."""
        from .transfer import NoRational, rational, sampled_coefficients, taken_apart

        assert item.value is not None
        drive = item.value.node if isinstance(item.value, Formula) else num(item.value)
        if isinstance(item.value, Formula):
            drive = scope.bind(item.value)
        of = "z" if item.sampled else "s"
        tree = scope.bind(function, local={of: var(of)})
        try:
            top, bottom = rational(tree, of)
        except NoRational as why:
            message = f"{item.name}: {why}"
            hint = f"only quotients of polynomials of {of} are simulated"
            raise Unreadable("NS1002", message, function.span, hint) from None
        nodes = tuple(scope.node(node) for node in item.nodes)
        if item.sampled:
            from .sampled import sampled_parts

            coefficients = sampled_coefficients(item.name, top, bottom, function.span)
            parts, clocked = sampled_parts(scope, item, nodes, drive, coefficients)
            self._claim(parts[1].name, f"{item.name}.in", item.span)
            self.elements += parts
            self.sampled.append(clocked)
            return
        whole = Element(scope.prefix + item.name, item.letter, nodes, item.span)
        for part in taken_apart(whole, drive, top, bottom, function.span):
            if part.name != whole.name:
                self._claim(part.name, part.name[len(scope.prefix) :], part.span)
            self.elements.append(part)

    @staticmethod
    def _plain(item: Template) -> str:
        """Return the quantity of a source whose expression turned out to be a number."""
        return item.quantity if item.letter in "bcefghilr" else ""

    @staticmethod
    def _no_model(scope: Scope, item: Template) -> Unreadable:
        """Return the finding for an unknown model name."""
        if item.letter in "rcl":
            message = f"{item.name}: {item.model} is neither a value nor the name of a model"
            hint = suggest(item.model, [*scope.known("models"), *scope.known("params")])
            return Unreadable("NS1060", message, item.model_span, hint, item.model)
        hint = suggest(item.model, scope.known("models")) or _card(item)
        if item.model in _TYPES:  # LTspice has a model of standard values for each type
            hint = f"add .model {item.model} {item.model} for SPICE's standard values"
        return Unreadable("NS1060", f"{item.name}: there is no model {item.model}",
                          item.model_span, hint, item.model)  # fmt: skip

    @staticmethod
    def _source(scope: Scope, given: SourceTemplate) -> Source:
        """Evaluate the value of an independent source."""
        ac = None
        if given.ac is not None:
            ac = (scope.number(given.ac[0]), scope.number(given.ac[1]))
        values = [scope.number(value) for value in given.values]
        options = {key: scope.number(value) for key, value in given.options.items()}
        if given.kind == "pwl" and (given.relative or given.repeats):
            from .repetition import Repetition, written_out

            parts = [
                Repetition(r.first, r.last, scope.number(r.count), r.span) for r in given.repeats
            ]
            values, repeat = written_out(values, given.relative, parts)
            if repeat is not None:
                options["r"] = repeat
        return Source(
            None if given.dc is None else scope.number(given.dc),
            ac,
            given.kind,
            tuple(values),
            options,
            given.span,
        )

    def _code_model(self, scope: Scope, item: CodeTemplate) -> None:
        """Unfold an A line."""
        self._claim(scope.prefix + item.name, item.name, item.span)
        given = {key: scope.param(key, text).value for key, text in item.params.items()}
        numbers = {key: value for key, value in given.items() if isinstance(value, float)}
        names = {node: f"port{k}" for k, node in enumerate(item.nodes)}
        nodes = {name: scope.node(node) for node, name in names.items()}
        inner = scope.child(scope, item.name, nodes)
        texts = self.coded.lines(item.renamed(names), scope, inner, numbers)
        where = item.span
        lines = [Command(text, where.file, where.line, where.text) for text in texts]
        body = self._bodies.read(build(lines, self._findings))
        before = len(self.elements)
        self.expand(inner, self.choose(inner, body))
        self.coded.names.update(element.name for element in self.elements[before:])

    # -- instances ---------------------------------------------------------------------------

    def _instance(
        self, scope: Scope, item: InstanceTemplate, active: tuple[Subcircuit, ...]
    ) -> None:
        """Unfold one X line."""
        self._claim(scope.prefix + item.name, item.name, item.span)
        count = self._multiple(scope, item)
        if count != 1:
            single = {key: text for key, text in item.params.items() if key != "m"}
            for k in range(count):
                name = item.name if k == 0 else f"{item.name}#{k + 1}"
                if k == 0:
                    del self.places[scope.prefix + name]
                self._instance(scope, replace(item, name=name, params=single), active)
            return
        found = scope.subcircuit(item.subcircuit)
        if found is None:
            hint = suggest(item.subcircuit, scope.known("subcircuits"))
            hint = hint or f"add .subckt {item.subcircuit} ... .ends, or .include its file"
            message = f"{item.name}: there is no subcircuit {item.subcircuit}"
            raise Unreadable("NS1040", message, item.subcircuit_span, hint, item.subcircuit)
        target, home = found
        header = target.header
        if target in active:
            chain = [s.header.name for s in active[active.index(target) :]] + [header.name]
            message = f"subcircuit {header.name} contains itself: {' -> '.join(chain)}"
            raise Unreadable("NS1042", message, item.span, "remove one of these X lines")
        if len(active) >= MAX_NESTING:
            message = f"subcircuits are nested deeper than {MAX_NESTING}"
            raise Unreadable("NS1042", message, item.span)
        if len(item.nodes) != len(header.nodes):
            message = (
                f"{item.name}: {header.name} has {len(header.nodes)} nodes, not {len(item.nodes)}"
            )
            hint = f"its nodes are {' '.join(header.nodes)}" if header.nodes else ""
            raise Unreadable("NS1041", message, item.span, hint)
        self._instances += 1
        if not active and self._size(item, [scope]) > MAX_ELEMENTS:
            raise _too_many(item.span)
        if self._instances > MAX_ELEMENTS:
            raise _too_many(item.span)
        if target.body is None:
            target.body = self._bodies.read(target.block)
        actual = [scope.node(node) for node in item.nodes]
        nodes = dict(zip(header.nodes, actual, strict=True))
        outside = nodes.pop("0", "0")
        if outside != "0":
            self._findings.warning(
                "NS1045",
                f"{item.name}: {header.name} has ground among its nodes: {outside} is not used",
                item.span,
                f"connect {outside} to ground, or rename the node in .subckt {header.name}",
            )
        inner = scope.child(home, item.name, nodes)
        self._pass(scope, inner, item, target)
        self.expand(inner, self.choose(inner, target.body), (*active, target))

    def _multiple(self, scope: Scope, item: InstanceTemplate) -> int:
        """Return how many equal instances stand for an X line: its m=, unless that is declared."""
        given = item.params.get("m")
        found = scope.subcircuit(item.subcircuit)
        if given is None or found is None or "m" in found[0].header.params:
            return 1
        value = scope.param("m", given).value
        if isinstance(value, float) and value == int(value) and 1 <= value <= MAX_MULTIPLE:
            return int(value)
        message = f"{item.name}: m= of an X line must be a whole number from 1 to {MAX_MULTIPLE}"
        raise Unreadable("NS1014", message, given.span, "write the instance several times")

    def _pass(self, scope: Scope, inner: Scope, item: InstanceTemplate, target: Subcircuit) -> None:
        """Give an instance its parameters: the X line's values, then the defaults."""
        header = target.header
        inner.params.update(header.params)
        for name, given in item.params.items():
            if name not in header.params:
                if name == "m":
                    continue
                hint = suggest(name, header.params)
                known = ", ".join(header.params)
                hint = hint or (f"known: {known}" if known else "declare it on the .subckt line")
                message = f"{item.name}: {header.name} has no parameter {name}"
                raise Unreadable("NS1014", message, given.span, hint)
            value = scope.param(name, given).value
            if not isinstance(value, float):
                shown = getattr(value, "text", value)
                message = f"{item.name}: {name}={shown} is not a number"
                raise Unreadable("NS1010", message, given.span)
            inner.fixed[name] = value

    def _size(self, item: InstanceTemplate, scopes: list[Scope]) -> int:
        """Return how many elements an instance has at least, without building them.

        Doubling at each of 40 levels is seen here in 40 steps and not after a million elements.
        """
        known: dict[int, int] = {}

        def size(target: Subcircuit, home: tuple[dict[str, Subcircuit], ...], depth: int) -> int:
            if id(target) in known or depth > MAX_NESTING:
                return known.get(id(target), 1)
            known[id(target)] = 1  # a loop is reported where it is unfolded
            if target.body is None:
                target.body = self._bodies.read(target.block)
            names = (target.body.subcircuits, *home)
            total = 1
            for inner in target.body.items:
                if isinstance(inner, InstanceTemplate):
                    for table in names:
                        if inner.subcircuit in table:
                            at = names[names.index(table) :]
                            total += size(table[inner.subcircuit], at, depth + 1)
                            break
                elif isinstance(inner, Template):
                    total += 1
            known[id(target)] = total
            return total

        found = scopes[0].subcircuit(item.subcircuit)
        assert found is not None
        return size(found[0], (found[1].subcircuits,), 0)

    # -- checks of the whole -----------------------------------------------------------------

    def check_controls(self) -> None:
        """Report elements that name a source or an inductor that does not exist."""
        for element, spans, prefix in self._controlled:
            for control, span in zip(element.controls, spans, strict=False):
                if control in self.places or self._findings.is_doubtful(control):
                    continue
                local = control[len(prefix) :]
                names = [n[len(prefix) :] for n in self.places if n.startswith(prefix)]
                near = suggest(local, (n for n in names if "." not in n))
                message = f"{element.name}: there is no element {local}"
                self._findings.error("NS1070", message, span, near)


def _own(item: Template, nodes: tuple[str, ...]) -> Mapping[str, Node]:
    """Return what ``x`` means: the voltage across a charge, the current of a flux."""
    if item.quantity == "q":
        return {"x": voltage(*nodes)}
    return {"x": var("i")} if item.quantity == "flux" else NOTHING


def _card(item: Template) -> str:
    """Return the hint for a missing model: a whole card, to be adapted."""
    card = _CARDS.get(item.letter, "TYPE(parameter=value)")
    return f"add .model {item.model} {card}"


def _too_many(span: Span) -> Unreadable:
    message = f"the deck expands to more than {MAX_ELEMENTS} elements"
    return Unreadable("NS1043", message, span, "look for subcircuits that multiply each other")
