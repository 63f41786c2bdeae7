"""A MOSFET as a switch: a channel that its gate opens and closes, and a body diode of any law.

    v_gs > Vto:  v_ds = Ron i_ch,  i_ch of either sign        v_gs < Vto:  i_ch = 0

(signs turned round for PMOS).  The gate draws no current.  ``body=`` names the diode's model card;
without it the body diode is ideal.  With a body of its own, a fourth node, there are two diodes,
from the body to drain and source.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from ...netlist.expressions.expression import Expression
from ...problems.descriptor import Functional, Switch
from ..device import NO_VALUES, Context, Edge
from ..diodes.diode_branch import Body, Leg, Voltage
from ..diodes.named_leg import named_leg
from ..effect import Effect
from ..heat.switching_loss import SWITCH_LOSSES
from ..parameter import Parameter, Table, inert
from ..stamper import Layout, Stamper
from ..switches.switch import SwitchLaw
from ..valve import Valve
from .mosfet import MULTIPLE, RATINGS, TEMPERATURES, Flow, Mosfet

if TYPE_CHECKING:
    from ...errors import Span
    from ...netlist.deck import Element, Model, Param
    from ...netlist.findings import Findings

_LAW = (
    Parameter("vto", "threshold, negative for PMOS", "V", 0.0, aliases=("vt", "vth", "vt0")),
    Parameter("vh", "hysteresis: half the width", "V", 0.0),
    Parameter("ron", "resistance of the channel while it conducts", "Ohm", 0.0),
    Parameter("roff", "resistance of the channel while it does not", "Ohm", math.inf),
)
_NAMES = frozenset(p.name for p in _LAW)
_IDLE = tuple(
    inert(name, "size of the channel, or initial voltage (nothing is stored)")
    for name in ("w", "l", "ad", "as", "pd", "ps", "nrd", "nrs", "ic", "icvgs", "icvbs")
)
_EFFECTS = {
    "vto": ("threshold", "V"),
    "vh": ("hysteresis", "V"),
    "ron": ("on-resistance", "Ohm"),
    "roff": ("off-resistance", "Ohm"),
}


class MosfetSwitch(Mosfet):
    """A switch with a body diode."""

    INSTANCE = Table(MULTIPLE, *_LAW, *TEMPERATURES, *_IDLE)
    MODEL = Table(
        Parameter("ideal", "an ideal switch"),
        *_LAW,
        *SWITCH_LOSSES,
        inert("level", "model level"),
        *RATINGS,
    )
    NOISE = ()
    __slots__ = ("late", "law", "legs", "smooth", "sources", "stores_energy")

    def __init__(
        self, element: Element, n: bool, law: SwitchLaw, legs: dict[str, Leg], parallel: float
    ) -> None:
        super().__init__(element, n, parallel)
        self.law = law
        #: body diodes by the terminal to which they lead
        self.legs = legs
        self.smooth = any(leg.smooth for leg in legs.values())
        self.stores_energy = any(leg.body.stores_energy for leg in legs.values())
        self.late = any(leg.drop is not None for leg in legs.values())
        self.sources = {}
        d, g, s = self.corners
        # the gate is sensed as the control of a switch is
        self.controls = (g, s)
        apart = self.body != s
        self.nodes = (d, s, self.body) if apart else (d, s)
        if apart:
            self.terminals = ("d", "g", "s", "b")
        given = dict(law.given)
        self.effects = (
            Effect(f"switching {'NMOS' if n else 'PMOS'}"),
            *(
                Effect(name, k, given[k], unit)
                for k, (name, unit) in _EFFECTS.items()
                if k in given
            ),
            *(
                Effect(f"body diode: {effect.name}", effect.parameter, effect.value, effect.unit)
                for effect in (legs["d"].effects if legs else ())
            ),
        )

    @classmethod
    def of(cls, element: Element, model: Model, context: Context) -> MosfetSwitch | None:
        """Return the transistor of an element line, or None after reporting why not."""
        findings = context.findings
        given = cls.INSTANCE.read(without_body(element.params), element.name, findings)
        card = context.cards.get(id(model))
        if card is None:
            params = without_body(model.params)
            card = cls.MODEL.read(params, f"model {model.name}", findings)
            context.cards[id(model)] = card
        diode = element.models.get("body") or model.models.get("body")
        owner = f"model {model.name}" if given.keys().isdisjoint(_NAMES) else element.name
        law = switch_law({**card, **given}, model.type == "nmos", owner, element, findings)
        body = given.get("temp"), given.get("dtemp", 0.0)
        return (
            None
            if law is None
            else cls.made(
                element, model.type == "nmos", law, diode, given.get("m", 1.0), body, context
            )
        )

    @classmethod
    def made(
        cls,
        element: Element,
        n: bool,
        law: SwitchLaw,
        diode: Model | None,
        parallel: float,
        temperature: tuple[float | None, float],
        context: Context,
    ) -> MosfetSwitch | None:
        """Return a switch with a body diode of a card, or None after reporting what is wrong."""
        if not parallel > 0.0:
            message = f"m of {element.name} must be positive"
            context.findings.error("NS2005", message, element.params["m"].span)
            return None
        leg = named_leg(element, "body", diode, parallel, temperature, context)
        if leg is None:
            return None
        apart = len(element.nodes) > 3 and element.nodes[3] != element.nodes[2]
        return cls(element, n, law, {"d": leg, "s": leg} if apart else {"d": leg}, parallel)

    @property
    def pair_count(self) -> int:
        """Number of complementarity pairs."""
        diodes = sum(leg.body.pair_count for leg in self.legs.values())
        return int(self.law.has_pair) + diodes

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Return the drops in series with the diodes."""
        return tuple(leg.drop for leg in self.legs.values() if leg.drop is not None)

    @property
    def control_nodes(self) -> tuple[str, ...]:
        """Return gate and source, and what drops of the diodes sense."""
        return (*self.controls, *super().control_nodes)

    def control_span(self, name: str) -> Span:
        """Return the place where the gate, or a sensed signal, is named."""
        if name in self.controls:
            return self.node_spans[1 if name == self.controls[0] else 2]
        return super().control_span(name)

    @property
    def _places(self) -> Iterator[tuple[str, str, str, str, Leg]]:
        """Yield terminal, name, anode, cathode and law of each body diode."""
        d, _, s = self.corners
        for terminal, leg in self.legs.items():
            node = d if terminal == "d" else s
            a, k = (self.body, node) if self.n else (node, self.body)
            yield terminal, f"{self.name}.b{terminal}", a, k, leg

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return the branches of the channel and of the diodes."""
        found = [Edge("P", *self.ends)] if self.law.has_pair else []
        if self.law.conductance:
            found.append(Edge("R", *self.ends))
        found += [Edge(kind, a, k) for _, _, a, k, leg in self._places for kind in leg.body.kinds]
        return tuple(found)

    def bodies(self) -> Iterator[tuple[str, Body]]:
        """Yield the laws of the body diodes."""
        return ((name, leg.body) for _, name, _, _, leg in self._places)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the currents of diodes with a drop."""
        for _, name, _, _, leg in self._places:
            leg.allocate(stamper, name)

    def stamp(self, stamper: Stamper) -> None:
        """Write the channel, its control and the diodes."""
        law, layout, name = self.law, stamper.layout, self.name
        pairs: tuple[int, ...] = ()
        if law.conductance:
            stamper.conductance(*self.ends, law.conductance * self.parallel)
        if law.has_pair:
            pair = stamper.pair(name, name, *self.ends, 0.0, law.series / self.parallel)
            g, s = self.controls if self.n else self.controls[::-1]
            closed = law.active_below  # the gate is down before the first evaluation
            stamper.switches.append(
                Switch(
                    pair, layout.voltage(g, s), law.on_above, law.off_below, closed,
                    law.active_below,
                )
            )  # fmt: skip
            pairs = (pair,)
        layout.pairs[f"{name}.channel"] = pairs
        for _, leg_name, a, k, leg in self._places:
            leg.stamp(stamper, leg_name, name, a, k, self.sources)
            pairs += layout.pairs.get(leg_name, ())
        layout.pairs[name] = pairs

    def flows(self, layout: Layout) -> Iterator[Flow]:
        """Yield the currents of the channel and of the diodes."""
        pairs = layout.pairs[f"{self.name}.channel"]
        z = layout.voltage(*self.ends, self.law.conductance * self.parallel)
        channel = Functional(
            z=z if self.law.conductance else (), lam=tuple((p, 1.0) for p in pairs)
        )
        yield Flow(channel, "d", "s")
        body = "b" if "b" in self.terminals else "s"
        for terminal, name, a, k, leg in self._places:
            begin, end = (body, terminal) if self.n else (terminal, body)
            yield Flow(leg.current(layout, name, a, k), begin, end)

    def valves(self, layout: Layout) -> Iterator[Valve]:
        """Yield the channel and the forward pairs of the diodes."""
        for pair in layout.pairs.get(f"{self.name}.channel", ()):
            yield Valve("switch", pair, self.parallel)
        for _, name, _, _, leg in self._places:
            yield from leg.valves(layout, name)

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charges of smooth diodes from which a run with ``uic`` starts."""
        return [
            share
            for _, name, a, k, leg in self._places
            for share in layout.voltage(*leg.charge(layout, name, a, k, voltage(a) - voltage(k)))
        ]


def without_body(params: Mapping[str, Param]) -> dict[str, Param]:
    """Return the parameters but the one that names the body diode's card."""
    return {key: param for key, param in params.items() if key != "body"}


def switch_law(
    given: Mapping[str, float], n: bool, owner: str, element: Element, findings: Findings
) -> SwitchLaw | None:
    """Return the law of the channel, or None after reporting what is wrong.

    Parameters
    ----------
    given : mapping of str to float
        ``vto``, ``vh``, ``ron`` and ``roff``.
    n : bool
        n-channel: the control is the voltage from gate to source, else from source to gate.
    owner : str
        ``model m`` or ``m1``.
    element : Element
    findings : Findings
    """
    ron, roff, width = given.get("ron", 0.0), given.get("roff", math.inf), given.get("vh", 0.0)
    if not 0.0 <= ron < roff:
        message = f"{owner}: ron={ron:g} Ohm must be between 0 and roff={roff:g} Ohm"
        findings.error("NS2005", message, element.span)
        return None
    if width < 0.0:
        message = f"{owner}: vh={width:g} V is half the width of a hysteresis: at least 0"
        findings.error("NS2005", message, element.span)
        return None
    threshold = given.get("vto", 0.0) if n else -given.get("vto", 0.0)
    shown = tuple((key, value) for key, value in given.items() if key in _NAMES)
    return SwitchLaw(ron, roff, threshold + width, threshold - width, False, shown)
