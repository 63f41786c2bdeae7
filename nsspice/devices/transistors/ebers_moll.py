"""The Ebers-Moll transistor with junctions of any diode law.

Two diodes are connected back to back, and each carries along a share of the other's current (J. J.
Ebers, J. L. Moll, Proc. IRE 42 (1954) 1761-1772).  For a PNP transistor, with the diode currents
``I`` from emitter and ``I'`` from collector to base,

    i_E = I - alphaI I',    i_C = I' - alphaN I

are the currents into the terminals; for NPN all of them are turned round.  ``DE`` and ``DC`` name
the model cards of the two diodes, which may be ideal, practical, or smooth junctions, each with a
smooth drop ``V={expr(i)}`` in series.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from ...netlist.expressions.expression import Expression
from ...problems.descriptor import Functional
from ..device import NO_VALUES, Context, Edge
from ..diodes.diode_branch import Body, Leg, Voltage
from ..diodes.leg_device import size_of
from ..diodes.named_leg import named_leg
from ..effect import Effect
from ..outputs import plus, scaled
from ..parameter import Parameter, Table, inert, refused
from ..stamper import Layout, Stamper
from .transistor import ELEMENT, RATINGS, Transistor

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model

_GAINS = (
    Parameter("alphan", "share of the emitter's diode current in the collector"),
    Parameter("alphai", "share of the collector's diode current in the emitter"),
)
#: parameters of SPICE's transistor that another parameter stands for here
_OTHER = "alphan, alphai and the diodes DE and DC define it"


class EbersMoll(Transistor):
    """Two diode laws and two current shares."""

    INSTANCE = Table(
        *ELEMENT,
        *_GAINS,
        Parameter("temp", "temperature of its smooth junctions", "C"),
        Parameter("dtemp", "temperature above the circuit's", "K", 0.0),
        inert("ic", "initial voltages (give them to capacitors, or by .ic)", "V"),
        inert("icvce", "initial voltage", "V"),
    )
    MODEL = Table(
        Parameter("ideal", "ideal diodes"),
        *_GAINS,
        *(refused(name, "parameter of the smooth transistor", _OTHER) for name in ("is", "bf")),
        *(refused(name, "parameter of the smooth transistor", _OTHER) for name in ("br", "vaf")),
        inert("subs", "place of the substrate"),
        inert("level", "model level"),
        *RATINGS,
    )
    NOISE = ()
    __slots__ = ("alphai", "alphan", "late", "legs", "smooth", "sources", "stores_energy")

    def __init__(
        self,
        element: Element,
        npn: bool,
        legs: tuple[Leg, Leg],
        alphan: float,
        alphai: float,
        parallel: float,
    ) -> None:
        super().__init__(element, npn, parallel)
        #: emitter's and collector's diode
        self.legs = legs
        self.alphan = alphan
        self.alphai = alphai
        self.smooth = any(leg.smooth for leg in legs)
        self.stores_energy = any(leg.body.stores_energy for leg in legs)
        self.late = any(leg.drop is not None for leg in legs)
        self.sources = {}
        shares = (("alphan", "forward share", alphan), ("alphai", "reverse share", alphai))
        self.effects = (
            Effect(f"Ebers-Moll {'NPN' if npn else 'PNP'}"),
            *(Effect(name, key, value) for key, name, value in shares if value),
            *(
                Effect(f"{which} diode: {effect.name}", effect.parameter, effect.value, effect.unit)
                for which, leg in zip(("emitter", "collector"), legs, strict=True)
                for effect in leg.effects
            ),
        )

    @classmethod
    def of(cls, element: Element, model: Model, context: Context) -> EbersMoll | None:
        """Return the transistor of an element line, or None after reporting why not."""
        findings = context.findings
        own = {k: p for k, p in element.params.items() if k not in ("de", "dc")}
        given = cls.INSTANCE.read(own, element.name, findings)
        parallel = size_of(element, given, findings)
        card = context.cards.get(id(model))
        if card is None:
            params = {k: p for k, p in model.params.items() if k not in ("de", "dc")}
            card = context.cards[id(model)] = cls.MODEL.read(
                params, f"model {model.name}", findings
            )
        shares = {**card, **given}
        for key in ("alphan", "alphai"):
            if not 0.0 <= shares.get(key, 0.0) <= 1.0:
                findings.error(
                    "NS2005",
                    f"{key}={shares[key]:g} of {element.name} must be between 0 and 1",
                    (element.params.get(key) or model.params[key]).span,
                    "it is the fraction of one diode's current that the other terminal carries",
                )
                return None
        if parallel is None:
            return None
        legs = []
        for key in ("de", "dc"):
            diode = element.models.get(key) or model.models.get(key)
            temperature = given.get("temp"), given.get("dtemp", 0.0)
            leg = named_leg(element, key, diode, parallel, temperature, context)
            if leg is None:
                return None
            legs.append(leg)
        alphan, alphai = shares.get("alphan", 0.0), shares.get("alphai", 0.0)
        return cls(element, model.type == "npn", (legs[0], legs[1]), alphan, alphai, parallel)

    @property
    def pair_count(self) -> int:
        """Number of complementarity pairs."""
        return sum(leg.body.pair_count for leg in self.legs)

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Return the drops in series with the diodes."""
        return tuple(leg.drop for leg in self.legs if leg.drop is not None)

    @property
    def _places(self) -> tuple[tuple[str, str, str, Leg], ...]:
        """Name, anode, cathode and law of both diodes."""
        c, b, e = self.corners
        result = []
        for key, node, leg in zip(("de", "dc"), (e, c), self.legs, strict=True):
            a, k = (b, node) if self.npn else (node, b)
            result.append((f"{self.name}.{key}", a, k, leg))
        return tuple(result)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return the branches of both diodes and of the currents that they carry along."""
        c, b, e = self.corners
        found = [Edge(kind, a, k) for _, a, k, leg in self._places for kind in leg.body.kinds]
        if self.alphai:
            found.append(Edge("G", b, e))
        if self.alphan:
            found.append(Edge("G", b, c))
        return tuple(found)

    def bodies(self) -> Iterator[tuple[str, Body]]:
        """Yield the laws of both diodes."""
        return ((name, leg.body) for name, _, _, leg in self._places)

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the currents of diodes with a drop."""
        for name, _, _, leg in self._places:
            leg.allocate(stamper, name)

    def stamp(self, stamper: Stamper) -> None:
        """Write the diodes and the currents that they carry along."""
        layout = stamper.layout
        pairs: tuple[int, ...] = ()
        for name, a, k, leg in self._places:
            leg.stamp(stamper, name, self.name, a, k, self.sources)
            pairs += layout.pairs.get(name, ())
        layout.pairs[self.name] = pairs
        c, b, e = self.corners
        emitter, collector = self._currents(layout)
        for node, output, share in ((c, emitter, self.alphan), (e, collector, self.alphai)):
            a, k = (node, b) if self.npn else (b, node)
            stamper.inject(a, k, output, share)

    def _currents(self, layout: Layout) -> tuple[Functional, Functional]:
        """Return the currents of the emitter's and the collector's diode."""
        one, two = (leg.current(layout, name, a, k) for name, a, k, leg in self._places)
        return one, two

    def current_into(self, layout: Layout, terminal: str) -> Functional:
        """Return the current into a terminal other than the base."""
        emitter, collector = self._currents(layout)
        sign = -1.0 if self.npn else 1.0
        if terminal == "e":
            return plus(scaled(emitter, sign), scaled(collector, -sign * self.alphai))
        return plus(scaled(collector, sign), scaled(emitter, -sign * self.alphan))

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charges of smooth junctions from which a run with ``uic`` starts."""
        return [
            share
            for name, a, k, leg in self._places
            for share in layout.voltage(*leg.charge(layout, name, a, k, voltage(a) - voltage(k)))
        ]
