"""Transistor ``Q c b e model``: what its two kinds share, and which of them a model card asks for.

``alphaN alphaI DE DC`` (or ``ideal``) ask for the Ebers-Moll circuit with two diode laws of the
deck's own choice; any other NPN or PNP card is SPICE's smooth transistor.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar

from ...problems.descriptor import Functional
from ..device import Context, Device, check_flags, check_model
from ..outputs import plus, scaled
from ..parameter import Parameter, inert, refused
from ..stamper import Layout

if TYPE_CHECKING:
    from ...netlist.deck import Element

#: parameters that ask for the Ebers-Moll circuit with diode laws
_JUNCTIONS = ("ideal", "alphan", "alphai", "de", "dc")
ELEMENT = (
    Parameter("area", "area factor", "", 1.0),
    Parameter("m", "number of equal transistors in parallel", "", 1.0),
    refused("areab", "area of the base", "give area", neutral=(1.0,)),
    refused("areac", "area of the collector", "give area", neutral=(1.0,)),
)
RATINGS = tuple(
    inert(name, "rating or note")
    for name in (
        *("mfg", "type", "vceo", "vcbo", "vebo", "icrating"),
        *("vbe_max", "vbc_max", "vce_max", "ic_max", "ib_max", "pd_max", "te_max", "rth0", "cth0"),
    )
)


class Transistor(Device):
    """Base of the transistors: three terminals and their currents."""

    KIND = "transistor"
    FLAGS: ClassVar[tuple[str, ...]] = ("off",)
    terminals: tuple[str, ...] = ("c", "b", "e")
    shows_current = True
    #: the fourth node, ground without one
    substrate = "0"
    __slots__ = ("npn", "parallel")

    def __init__(self, element: Element, npn: bool, parallel: float) -> None:
        super().__init__(element)
        #: the power is summed over the terminals, collector to emitter comes first
        self.ends = (element.nodes[0], element.nodes[2])
        self.npn = npn
        self.parallel = parallel

    @classmethod
    def read(cls, element: Element, context: Context) -> Transistor | None:
        """Return the transistor of an element line, or None after reporting why not."""
        from .bipolar import Bipolar
        from .ebers_moll import EbersMoll

        findings = context.findings
        if not check_model(element, ("npn", "pnp"), context, required=True):
            return None
        model = element.model
        assert model is not None
        check_flags(cls, element, findings)
        given = (*model.params, *element.params)
        kind = EbersMoll if any(key in given for key in _JUNCTIONS) else Bipolar
        device = kind.of(element, model, context)
        if device is not None and len(element.nodes) > 3 and "s" not in device.terminals:
            context.idle_substrates.append(element)
        return device

    @property
    def corners(self) -> tuple[str, str, str]:
        """Collector, base and emitter node."""
        return self.nodes[0], self.nodes[1], self.nodes[2]

    def current(self, layout: Layout) -> Functional:
        """Return the current into the collector."""
        return self.terminal_current(layout, "c")

    def terminal_current(self, layout: Layout, terminal: str) -> Functional:
        """Return the current into a terminal, ``c``, ``b``, ``e`` or ``s``."""
        if terminal != "b":
            return self.current_into(layout, terminal)
        total = Functional()
        for other in self.terminals:
            if other != "b":
                total = plus(total, self.current_into(layout, other))
        return scaled(total, -1.0)

    @abstractmethod
    def current_into(self, layout: Layout, terminal: str) -> Functional:
        """Return the current into a terminal other than the base."""

    @property
    def powers(self) -> tuple[tuple[str, str, str], ...]:
        """Return current and two nodes of each product that adds to the power."""
        c, b, e = self.corners
        listed = ((self.name, c, e), (f"{self.name}.b", b, e))
        return (*listed, (f"{self.name}.s", self.substrate, e)) if "s" in self.terminals else listed
