"""IGBT ``Z c g e model`` as a switch with a forward drop: ``NIGBT(ideal Vto= Vce0= Ron= body=)``.

    v_ge > Vto:  0 <= i_c  _|_  Vce0 + Ron i_c - v_ce >= 0        v_ge < Vto:  i_c = 0

It is a switch in series with a diode that has the drop: the channel and the junction on the
collector's side (N. Mohan, T. M. Undeland, W. P. Robbins, *Power Electronics*, 3rd ed. (2003),
ch. 25).  The gate draws no current.  ``body=`` names the card of an antiparallel diode; without it
there is none, and a reverse voltage is blocked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar

from ...netlist.expressions.expression import Expression
from ...problems.descriptor import Functional, Switch
from ..device import NO_VALUES, Context, Device, Edge, check_flags, check_model
from ..diodes.characteristic import diode_curve
from ..diodes.diode_branch import Body, CurveBody, Leg, Voltage
from ..diodes.named_leg import named_leg
from ..effect import Effect
from ..heat.switching_loss import SWITCH_LOSSES
from ..mosfets.mosfet import MULTIPLE, RATINGS, TEMPERATURES
from ..outputs import plus, scaled
from ..parameter import Parameter, Table, inert
from ..stamper import Layout, Stamper
from ..valve import Valve

if TYPE_CHECKING:
    from ...errors import Span
    from ...netlist.deck import Element

_LAW = (
    Parameter("vto", "threshold, negative for PIGBT", "V", 0.0, aliases=("vt", "vth")),
    Parameter("vh", "hysteresis: half the width", "V", 0.0),
    Parameter("vce0", "forward drop", "V", 0.0),
    Parameter("ron", "resistance while it conducts", "Ohm", 0.0),
)
_NAMES = {
    "vto": ("threshold", "V"),
    "vh": ("hysteresis", "V"),
    "vce0": ("forward drop", "V"),
    "ron": ("on-resistance", "Ohm"),
}
#: a card with one of these is that of a switch
_SWITCHED = frozenset(["ideal", "vce0", "ron", "vh", "body"])


class Igbt(Device):
    """A switch in series with a drop, and an antiparallel diode."""

    KIND = "IGBT"
    FLAGS: ClassVar[tuple[str, ...]] = ("off",)
    INSTANCE = Table(MULTIPLE, inert("area", "size"), *_LAW, *TEMPERATURES)
    MODEL = Table(
        Parameter("ideal", "an ideal switch"),
        *_LAW,
        *SWITCH_LOSSES,
        inert("level", "level"),
        *RATINGS,
    )
    terminals: tuple[str, ...] = ("c", "g", "e")
    shows_current = True
    NOISE = ()
    __slots__ = ("drop", "given", "late", "leg", "n", "parallel", "smooth", "sources",
                 "stores_energy")  # fmt: skip

    def __init__(
        self, element: Element, n: bool, given: Mapping[str, float], leg: Leg | None, m: float
    ) -> None:
        super().__init__(element)
        c, g, e = element.nodes
        self.n, self.given, self.leg, self.parallel = n, given, leg, m
        self.controls = (g, e)
        self.nodes = self.ends = (c, e)
        curve = diode_curve(given.get("vce0", 0.0), given.get("ron", 0.0) / m)
        #: the drop, from the collector on
        self.drop = CurveBody(curve.decompose(), ())
        self.smooth = leg is not None and leg.smooth
        self.stores_energy = leg is not None and leg.body.stores_energy
        self.late = leg is not None and leg.drop is not None
        self.sources = {}
        self.effects = (
            Effect(f"switching {'N' if n else 'P'}IGBT"),
            *(Effect(name, k, given[k], unit) for k, (name, unit) in _NAMES.items() if k in given),
            *(
                Effect(f"antiparallel diode: {f.name}", f.parameter, f.value, f.unit)
                for f in (leg.effects if leg is not None else ())
            ),
        )

    @classmethod
    def read(cls, element: Element, context: Context) -> Igbt | None:
        """Return the transistor of an element line, or None after reporting why not."""
        findings = context.findings
        if not check_model(element, ("nigbt", "pigbt"), context, required=True):
            return None
        model = element.model
        assert model is not None
        check_flags(cls, element, findings)
        if _SWITCHED.isdisjoint(model.params):
            findings.error(
                "NS2008",
                f"model {model.name}: an IGBT is simulated as a switch with a drop",
                model.span,
                f"write .model {model.name} {model.type}(ideal Vto=5 Vce0=1 Ron=10m body=DIODE)",
            )
            return None
        given, card = (
            table.read({k: p for k, p in params.items() if k != "body"}, owner, findings)
            for table, params, owner in (
                (cls.INSTANCE, element.params, element.name),
                (cls.MODEL, model.params, f"model {model.name}"),
            )
        )
        m = given.get("m", 1.0)
        values = {k: v for k, v in {**card, **given}.items() if k in _NAMES}
        if not _fits(element, values, m, context):
            return None
        diode = element.models.get("body") or model.models.get("body")
        leg: Leg | None = None
        if diode is not None:
            temperature = given.get("temp"), given.get("dtemp", 0.0)
            leg = named_leg(element, "body", diode, m, temperature, context)
            if leg is None:
                return None
        return cls(element, model.type == "nigbt", values, leg, m)

    @property
    def pair_count(self) -> int:
        """Number of complementarity pairs."""
        return 2 + (0 if self.leg is None else self.leg.body.pair_count)

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Return the drop in series with the diode."""
        return () if self.leg is None or self.leg.drop is None else (self.leg.drop,)

    @property
    def control_nodes(self) -> tuple[str, ...]:
        """Return gate and emitter, and what the diode's drop senses."""
        return (*self.controls, *super().control_nodes)

    def control_span(self, name: str) -> Span:
        """Return the place where the gate, or a sensed signal, is named."""
        if name in self.controls:
            return self.node_spans[1 if name == self.controls[0] else 2]
        return super().control_span(name)

    @property
    def _forward(self) -> tuple[str, str]:
        """Ends of the transistor in the direction of its current."""
        return self.ends if self.n else (self.ends[1], self.ends[0])

    @property
    def _inner(self) -> str:
        """Name of the node between drop and channel."""
        return f"{self.name}#channel"

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return the branches of the transistor and of its diode."""
        kinds = () if self.leg is None else self.leg.body.kinds
        return (Edge("P", *self.ends), *(Edge(kind, *self.ends) for kind in kinds))

    def branches(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return drop and channel in series, and the diode."""
        (_, *diode) = self.edges(values)
        a, k = self._forward
        return (Edge("P", a, self._inner), Edge("P", self._inner, k), *diode)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current of a diode with a drop."""
        if self.leg is not None:
            self.leg.allocate(stamper, f"{self.name}.diode")

    def stamp(self, stamper: Stamper) -> None:
        """Write drop, switch and diode."""
        layout, name = stamper.layout, self.name
        a, k = self._forward
        inner = stamper.internal_node(self._inner, name)
        self.drop.stamp(stamper, f"{name}.drop", name, a, inner)
        pair = stamper.pair(name, name, inner, k, 0.0, 0.0)
        g, e = self.controls if self.n else self.controls[::-1]
        threshold = self.given.get("vto", 0.0) * (1.0 if self.n else -1.0)
        width = self.given.get("vh", 0.0)
        control = layout.voltage(g, e)
        stamper.switches.append(Switch(pair, control, threshold + width, threshold - width))
        layout.pairs[f"{name}.channel"] = (pair,)
        if self.leg is not None:
            self.leg.stamp(stamper, f"{name}.diode", name, k, a, self.sources)
        parts = ("drop", "channel", "diode")
        layout.pairs[name] = sum((layout.pairs.get(f"{name}.{p}", ()) for p in parts), ())

    def terminal_current(self, layout: Layout, terminal: str) -> Functional:
        """Return the current into a terminal, ``c``, ``g`` or ``e``."""
        if terminal == "g":
            return Functional()
        a, k = self._forward
        total = Functional(lam=((layout.pairs[f"{self.name}.channel"][0], 1.0),))
        if self.leg is not None:
            back = self.leg.current(layout, f"{self.name}.diode", k, a)
            total = plus(total, scaled(back, -1.0))
        return total if (terminal == "c") == self.n else scaled(total, -1.0)

    def current(self, layout: Layout) -> Functional:
        """Return the current into the collector."""
        return self.terminal_current(layout, "c")

    def bodies(self) -> Iterator[tuple[str, Body]]:
        """Yield the law of the diode, if there is one."""
        if self.leg is not None:
            yield f"{self.name}.diode", self.leg.body

    def valves(self, layout: Layout) -> Iterator[Valve]:
        """Yield the channel and the forward pair of the diode."""
        for pair in layout.pairs.get(f"{self.name}.channel", ()):
            yield Valve("switch", pair, self.parallel)
        if self.leg is not None:
            yield from self.leg.valves(layout, f"{self.name}.diode")

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charge of a smooth diode from which a run with ``uic`` starts."""
        if self.leg is None:
            return []
        a, k = self._forward
        v = voltage(k) - voltage(a)
        return list(layout.voltage(*self.leg.charge(layout, f"{self.name}.diode", k, a, v)))


def _fits(element: Element, given: Mapping[str, float], m: float, context: Context) -> bool:
    """Return whether the values are possible; report those that are not."""
    wrong = [k for k in ("vce0", "ron", "vh") if not 0.0 <= given.get(k, 0.0) < math.inf]
    for key in wrong:
        message = f"{key}={given[key]:g} of {element.name} must be at least 0"
        context.findings.error("NS2005", message, element.span)
    if not m > 0.0:
        message = f"m of {element.name} must be positive"
        context.findings.error("NS2005", message, element.params["m"].span)
    return not wrong and m > 0.0
