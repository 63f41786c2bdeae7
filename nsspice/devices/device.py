"""The base of all laws: what the circuit may ask of any element."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple

from ..errors import Span
from ..netlist.findings import Findings
from ..netlist.text.numbers import as_float
from ..problems.descriptor import Functional
from .carrier import Carrier
from .effect import Effect
from .parameter import Table
from .signals import currents, voltages
from .stamper import Conditions, Layout, Stamper

if TYPE_CHECKING:
    from ..netlist.deck import Element, Model
    from ..netlist.expressions.expression import Expression
    from .diodes.broken_junction import BrokenJunction
    from .diodes.diode_branch import Body, CurveBody
    from .diodes.junction_lines import Settings
    from .noise import Flicker, NoiseSource
    from .valve import Valve

EdgeKind = Literal["V", "E", "C", "P", "R", "L", "G", "I"]
NO_VALUES: Mapping[str, float] = {}


class Edge(NamedTuple):
    """A branch of the circuit graph.

    ``kind`` is V (independent voltage, 0-Ohm resistor), E (controlled voltage), C, P (one
    complementarity pair), R (conductance), L, G (controlled current) or I (independent current).
    """

    kind: EdgeKind
    a: str
    b: str


class Context:
    """What the laws need while they are built: where to report, and what was read already."""

    def __init__(self, findings: Findings) -> None:
        self.findings = findings
        #: laws of ``.model`` cards by identity, so that 20,000 diodes read their card once
        self.models: dict[int, object] = {}
        #: parameters of R, L and C cards
        self.cards: dict[int, dict[str, float]] = {}
        #: branches and effects of equal diodes
        self.diodes: dict[object, CurveBody] = {}
        #: sizes of MOSFETs whose lines give none, by parameter: DEFW, DEFL, DEFAD, DEFAS
        self.sizes: dict[str, float] = {}
        #: smooth MOSFETs are read as switches
        self.mosfet_switch = False
        #: how junctions become broken lines, None if they stay smooth
        self.lines: Settings | None = None
        #: temperatures of the deck, at which knots are counted
        self.conditions = Conditions()
        #: elements whose junctions are broken lines, by card and temperature
        self.broken: dict[object, tuple[BrokenJunction, list[str]]] = {}
        #: voltage from source to gate of a MOSFET that is on, by element, as far as it is known [V]
        self.drives: Mapping[str, float] = {}
        #: what was made of MOSFETs that are read as switches, with the elements
        self.switched: dict[str, list[Element]] = {}
        #: transistors with a substrate of which nothing is simulated
        self.idle_substrates: list[Element] = []
        #: elements whose model card is of another type than they need, by that and by the card
        self.wrong_types: dict[tuple[str, int], list[Element]] = {}

    def card(
        self, model: Model, check: Callable[[Model, Findings], dict[str, float] | None]
    ) -> dict[str, float] | None:
        """Return what a model card gives, read and checked once; None if it is wrong."""
        found = self.models.get(id(model))
        if found is None:
            read = check(model, self.findings)
            found = self.models[id(model)] = "wrong" if read is None else read
        return found if isinstance(found, dict) else None

    def tell(self) -> None:
        """Report what was noted of many elements, once for all of them."""
        for (needed, _), (first, *others) in self.wrong_types.items():
            assert first.model is not None
            who = f"{first.name} needs"
            if others:
                more = "element" if len(others) == 1 else "elements"
                who = f"{first.name} and {len(others)} more {more} need"
            self.findings.error(
                "NS2002",
                f"{who} a .model of type {needed}, but {first.model.name} is of type "
                f"{first.model.type}",
                first.span,
                f"the card is at {first.model.span}",
            )
        for text, (first, *others) in self.switched.items():
            more = f" and {len(others)} more" if others else ""
            self.findings.warning(
                "NS2059", f"{first.name}{more} read as a switch, {text}", first.span
            )
        for junction, names in self.broken.values():
            which, more = names[0], f" and {len(names) - 1} more" if len(names) > 1 else ""
            self.findings.warning("NS2065", f"{which}{more}: {junction.described()}", None)
        if not self.idle_substrates:
            return
        first, *others = self.idle_substrates
        what = f"the substrate of {first.name} carries no current: no effects are simulated"
        if others:
            more = f"{len(others)} more transistor{'s' if len(others) > 1 else ''}"
            what = (
                f"the substrates of {first.name} and {more} carry no current: none of their "
                f"effects are simulated"
            )
        self.findings.warning("NS2052", what, first.span)


class Device(Carrier):
    """One element with its law.

    Parameters
    ----------
    element : Element
        The line of the deck.

    Attributes
    ----------
    name, nodes, controls, span
        From the deck.
    effects : tuple of Effect
        What the deck called for.
    """

    #: parameters of the element line and of its model card
    INSTANCE: ClassVar[Table] = Table()
    MODEL: ClassVar[Table] = Table()
    #: bare words that the element line may have
    FLAGS: ClassVar[tuple[str, ...]] = ()
    #: what the element is called in messages
    KIND: ClassVar[str] = "element"

    stores_energy: bool = False
    #: the law has a smooth nonlinear part
    smooth: bool = False
    #: stamped after all others because it reads another element's current
    late: bool = False
    #: elements whose currents the expressions read, set by the circuit once all names are known
    sources: dict[str, Carrier]
    #: terminals whose currents have names of their own, the first one is that of the element
    terminals: tuple[str, ...] = ()
    #: shown among the default signals
    shows_current: bool = False
    #: kinds of noise that ``noise`` yields: thermal, shot, flicker; each law says it, if only none
    NOISE: ClassVar[tuple[str, ...]]

    __slots__ = ("controls", "effects", "ends", "letter", "name", "node_spans", "nodes", "span")

    def __init__(self, element: Element) -> None:
        self.name: str = element.name
        self.letter: str = element.letter
        self.nodes: tuple[str, ...] = element.nodes
        #: first and second terminal; a coupling has none
        ends = element.nodes if len(element.nodes) >= 2 else ("0", "0")
        self.ends: tuple[str, str] = (ends[0], ends[1])
        self.controls: tuple[str, ...] = element.controls
        self.span: Span = element.span
        self.node_spans: tuple[Span, ...] = element.node_spans
        self.effects: tuple[Effect, ...] = ()

    @classmethod
    @abstractmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the device of an element line, or None after reporting why not."""

    @property
    def pair_count(self) -> int:
        """Number of complementarity pairs."""
        return 0

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Expressions of the law; ``sources`` then takes the elements whose currents they read."""
        return ()

    @property
    def control_nodes(self) -> tuple[str, ...]:
        """Nodes that are sensed without current."""
        return tuple(node for found in self.expressions for node in voltages(found))

    @property
    def control_elements(self) -> tuple[str, ...]:
        """Elements whose current is sensed, or that are coupled."""
        return tuple(name for found in self.expressions for name in currents(found))

    def control_span(self, name: str) -> Span:
        """Return the place where a sensed node or element is named."""
        for found in self.expressions:
            if name in voltages(found) or name in currents(found):
                return found.span or self.span
        where = len(self.nodes) + self.controls.index(name)
        return self.node_spans[where] if where < len(self.node_spans) else self.span

    @property
    def kinked(self) -> bool:
        """Whether the element has an expression whose kinks pairs may stand for."""
        return False

    def written(self, pairs: bool) -> Device:
        """Return the element with the kinks of its expression as pairs, or on the tape."""
        return self

    def keep_current(self) -> None:
        """Make the current an unknown if the law has no other form that others could read."""

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return the branches of the element in the circuit graph."""
        return ()

    def inner_edges(self) -> tuple[Edge, ...]:
        """Return the branches at nodes inside the element, which no other one sees."""
        return ()

    def branches(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return all branches, one for each pair, nodes inside the element included."""
        return (*self.edges(values), *self.inner_edges())

    def allocate(self, stamper: Stamper) -> None:
        """Reserve unknowns and pairs; only for laws that stamp late."""

    @abstractmethod
    def stamp(self, stamper: Stamper) -> None:
        """Write the law into the system."""

    def terminal_current(self, layout: Layout, terminal: str) -> Functional:
        """Return the current into one of ``terminals`` as an output; the first one by default."""
        return self.current(layout)

    @property
    def powers(self) -> tuple[tuple[str, str, str], ...]:
        """Return a current and two nodes for each product that adds to the power."""
        return ((self.name, *self.ends),)

    def bodies(self) -> Iterator[tuple[str, Body]]:
        """Yield the laws of the diodes in the element, with their names."""
        return iter(())

    def noise(self, layout: Layout, flicker: Flicker) -> Iterator[NoiseSource]:
        """Yield the sources of noise; ideal elements have none."""
        return iter(())

    def valves(self, layout: Layout) -> Iterator[Valve]:
        """Yield the parts that turn on and off, whose switchings may cost energy."""
        return iter(())

    def initial_charges(
        self, layout: Layout, voltage: Callable[[str], float]
    ) -> list[tuple[int, float]]:
        """Return the charges [A s] and fluxes [V s] of smooth laws from which ``uic`` starts.

        Parameters
        ----------
        layout : Layout
        voltage : callable
            Initial voltage of a node [V].

        Returns
        -------
        list of (int, float)
            Row of a node or an inductor, and what is stored there.
        """
        return []

    def initial_energy(self, layout: Layout, voltage: Callable[[str], float]) -> float:
        """Return the energy [J] of what is not a smooth law from which ``uic`` starts."""
        return 0.0


#: what is written instead of a value that depends on signals
_INSTEAD = {
    "capacitance": "it may be a sum of common functions of its own voltage; otherwise write the "
    "charge: Q={expression of x}, where x is the voltage across it",
    "inductance": "it may be a sum of common functions of its own current; otherwise write the "
    "flux: "
    "Flux={expression of x}, where x is the current through it",
}


#: what is written instead of a value that other signals change
_CHANGED = {
    "capacitance": "write Q={C*x}, x the voltage across it, if the charge stays where C changes; "
    "if the voltage stays, use a capacitor in series with a switch",
    "inductance": "write Flux={L*x}, x the current through it, if the flux stays where L changes; "
    "if the current stays, use an inductor with a switch",
}


def own_signals(element: Element) -> dict[str, float]:
    """Return the names of the voltage across a capacitor, or of the current of an inductor.

    Each with its sign.
    """
    if element.letter != "c":
        return {"i": 1.0, f"i({element.name})": 1.0}
    return own_voltages(element.nodes)


def own_voltages(nodes: Sequence[str]) -> dict[str, float]:
    """Return the names of the voltage between the first two nodes of an element, with signs."""
    a, b, *_ = nodes
    own = {f"v({a},{b})": 1.0, f"v({b},{a})": -1.0}
    if b == "0":
        own[f"v({a})"] = 1.0
    if a == "0":
        own[f"v({b})"] = -1.0
    return own


def number(element: Element, what: str, findings: Findings) -> float | None:
    """Return the value of an element line, or None after reporting that it is missing."""
    value = element.value
    if isinstance(value, int | float):
        if math.isnan(value):
            findings.error("NS2005", f"the {what} of {element.name} is not a number", element.span)
            return None
        return as_float(value)
    if value is None:
        findings.error(
            "NS2004",
            f"{element.name} has no {what}",
            element.span,
            f"write the {what} after the nodes",
        )
    else:
        others = sorted(value.variables() - set(own_signals(element)))
        if what in _CHANGED and others:
            on = f"depends on {others[0]}"
            refuse_smooth(element, f"the {what} of {element.name} {on}", findings, _CHANGED[what])
            return None
        hint = _INSTEAD.get(what, "")
        refuse_smooth(element, f"the {what} of {element.name} depends on signals", findings, hint)
    return None


def refuse_smooth(element: Element, what: str, findings: Findings, hint: str = "") -> None:
    """Report a nonlinear law that is read but not simulated."""
    value = element.value
    findings.error(
        "NS2009",
        f"{what}: a nonlinear law that is not simulated",
        getattr(value, "span", None) or element.span,
        hint or "build it from a B source",
    )


def check_flags(device: type[Device], element: Element, findings: Findings) -> None:
    """Report bare words that the element line may not have, or that do nothing."""
    for word, span in element.flags.items():
        if word not in device.FLAGS:
            known = ", ".join(device.FLAGS)
            findings.error(
                "NS2003",
                f"{element.name} has the unknown word {word}",
                span,
                f"known: {known}" if known else "remove it",
            )
        elif word == "off":
            findings.warning(
                "NS2052",
                f"off of {element.name} is a starting hint that is not needed here",
                span,
            )


def check_model(element: Element, types: tuple[str, ...], context: Context, required: bool) -> bool:
    """Return whether the model card has one of the given types; report it otherwise."""
    needed = " or ".join(types)
    model = element.model
    if model is None:
        if required:
            context.findings.error(
                "NS2001",
                f"{element.name} needs a .model of type {needed}",
                element.span,
                f"add .model NAME {types[0]}(...) and write NAME after the nodes",
            )
        return not required
    if model.type not in types:
        context.wrong_types.setdefault((needed, id(model)), []).append(element)
        return False
    return True
