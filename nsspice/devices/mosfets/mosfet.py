"""MOSFET ``M d g s [b] model``: what its kinds share, and which of them a model card asks for.

``NMOS(ideal ...)`` and ``PMOS(ideal ...)`` are switches with a body diode; ``LEVEL=1`` is SPICE's
square law, ``VDMOS`` LTspice's and ngspice's power transistor.  The word ``switch`` on a card, or
``.options mosfet=switch``, reads any card as a switch.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from ...problems.descriptor import Functional
from ..device import Context, Device, check_flags, check_model
from ..outputs import plus, scaled
from ..parameter import Parameter, inert
from ..stamper import Layout

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model

#: parameters that make an NMOS or PMOS card a switch
SWITCHED = ("ideal", "ron", "roff", "vh", "body")
VDMOS_TYPES = ("vdmos", "vdmosn", "vdmosp")
_TYPES = ("nmos", "pmos", *VDMOS_TYPES)
#: what users of other models are advised
_OTHER = "LEVEL=1, 2 and 3, VDMOS and the switch are simulated; or add the word switch to the card"

MULTIPLE = Parameter("m", "number of equal transistors in parallel", "", 1.0)
TEMPERATURES = (
    Parameter("temp", "temperature of this transistor", "C"),
    Parameter("dtemp", "temperature above the circuit's", "K", 0.0),
)
INITIAL = (
    Parameter("ic", "initial drain-source voltage, used with uic", "V"),
    Parameter("icvgs", "initial gate-source voltage", "V"),
    Parameter("icvbs", "initial body-source voltage", "V"),
)
RATINGS = tuple(
    inert(name, "rating or note")
    for name in ("mfg", "qg", "vds", "vgs_max", "vgd_max", "vds_max", "vgsr_max", "vgdr_max")
)


class Flow(NamedTuple):
    """A current inside a transistor, from one of its terminals or inner nodes to another."""

    current: Functional
    begin: str
    end: str


class Mosfet(Device):
    """Base of the MOSFETs: their terminals and currents."""

    KIND = "MOSFET"
    FLAGS: ClassVar[tuple[str, ...]] = ("off",)
    shows_current = True
    __slots__ = ("body", "corners", "n", "parallel", "terminals")

    def __init__(self, element: Element, n: bool, parallel: float) -> None:
        super().__init__(element)
        d, g, s, *rest = element.nodes
        #: drain, gate and source node
        self.corners: tuple[str, str, str] = (d, g, s)
        #: node of the body, the source without a fourth node
        self.body = rest[0] if rest else s
        self.ends = (d, s)
        self.terminals: tuple[str, ...] = ("d", "g", "s")
        #: n-channel
        self.n = n
        self.parallel = parallel

    @classmethod
    def read(cls, element: Element, context: Context) -> Mosfet | None:
        """Return the transistor of an element line, or None after reporting why not."""
        if not check_model(element, _TYPES, context, required=True):
            return None
        model = element.model
        assert model is not None
        if "thermal" in element.flags:
            context.findings.error(
                "NS2008",
                f"self-heating of {element.name} (thermal) is not simulated",
                element.flags["thermal"],
                "give temp=, the expected temperature",
            )
            return None
        check_flags(cls, element, context.findings)
        if _is_switch(model, context):
            from .mosfet_reading import as_switch

            return as_switch(element, model, context)
        law = _law_of(model, context)
        return None if law is None else law.of(element, model, context)

    @classmethod
    @abstractmethod
    def of(cls, element: Element, model: Model, context: Context) -> Mosfet | None:
        """Return the transistor of an element line and its card, or None after reporting why."""

    @abstractmethod
    def flows(self, layout: Layout) -> Iterator[Flow]:
        """Yield the currents, together with those of resistances between terminals and nodes."""

    def current(self, layout: Layout) -> Functional:
        """Return the current into the drain."""
        return self.terminal_current(layout, "d")

    def terminal_current(self, layout: Layout, terminal: str) -> Functional:
        """Return the current into a terminal, ``d``, ``g``, ``s`` or ``b``."""
        total = Functional()
        for flow in self.flows(layout):
            if flow.begin == terminal:
                total = plus(total, flow.current)
            if flow.end == terminal:
                total = plus(total, scaled(flow.current, -1.0))
        return total

    @property
    def powers(self) -> tuple[tuple[str, str, str], ...]:
        """Return current and two nodes of each product that adds to the power."""
        d, g, s = self.corners
        listed = [(self.name, d, s)]
        if "g" in self.terminals:
            listed.append((f"{self.name}.g", g, s))
        if "b" in self.terminals:
            listed.append((f"{self.name}.b", self.body, s))
        return tuple(listed)


def _is_switch(model: Model, context: Context) -> bool:
    """Return whether the card of a smooth transistor is read as that of a switch."""
    if "switch" in model.params:
        return True
    own = model.type not in VDMOS_TYPES and any(key in model.params for key in SWITCHED)
    return context.mosfet_switch and not own


def _is_square_law(model: Model, level: object) -> bool:
    """Return whether the effects that LEVEL=3 has beyond LEVEL=1 are written as zero.

    So do the power transistors of PSpice's libraries; KAPPA is not zero unless it is written, and a
    doping brings other effects.
    """
    beyond = ("gamma", "delta", "eta", "theta", "vmax", "nfs", "nsub")
    kappa = model.params.get("kappa")
    return (
        level == 3.0
        and kappa is not None
        and kappa.value == 0.0
        and not any(key in model.params and model.params[key].value != 0.0 for key in beyond)
    )


def _law_of(model: Model, context: Context) -> type[Mosfet] | None:
    """Return the kind of transistor that a card asks for, or None after reporting why not."""
    from .level1 import Level1
    from .level2 import Level2
    from .level3 import Level3
    from .mosfet_switch import MosfetSwitch
    from .vdmos import Vdmos

    power = model.type in VDMOS_TYPES
    if not power and any(key in model.params for key in SWITCHED):
        return MosfetSwitch
    given = model.params.get("level")
    level = 1.0 if given is None else given.value
    if not power and (level == 1.0 or _is_square_law(model, level)):
        return Level1
    if not power and level in (2.0, 3.0):
        return Level2 if level == 2.0 else Level3
    if power:
        return Vdmos
    context.findings.error(
        "NS2008",
        f"model {model.name} ({model.type}, level {level}) is not simulated",
        model.span,
        _OTHER,
    )
    return None
