"""What a block of a circuit senses of another one: a voltage at a node that nothing else holds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...netlist.deck import Element
from ...problems.descriptor import Functional, Handed, Waveform
from ..carrier import Carrier
from ..device import NO_VALUES, Context, Device, Edge
from ..effect import Effect
from ..stamper import Layout, Stamper

if TYPE_CHECKING:
    from ...errors import Span


class BlockInput(Device):
    """A voltage source from a node to ground that follows what another block hands on.

    Nothing that senses draws a current, so that the source carries none.  A sensed current is the
    voltage of a node of the same name.

    Parameters
    ----------
    signal : str
        ``v(b)`` or ``i(v1)``, of the other block.
    handed : Handed
    span : Span
        Of an element that senses it.
    """

    KIND = "input of a block"
    NOISE = ()
    __slots__ = ("handed", "signal")

    def __init__(self, signal: str, handed: Handed, span: Span) -> None:
        node = signal[2:-1] if signal[0] == "v" else signal
        super().__init__(Element(f"input.{signal}", "v", (node, "0"), span))
        self.signal, self.handed = signal, handed
        self.effects = (Effect(f"{signal} of another block"),)

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return nothing: no line of a deck is one."""
        return None

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one voltage branch."""
        return (Edge("V", *self.ends),)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``-v = -u``."""
        branch = stamper.branch(self.name)
        stamper.connect(branch, *self.ends)
        waveform = Waveform("polynomial", (), handed=self.handed)
        if stamper.layout.conditions.analysis == "dc":
            waveform = Waveform("dc", (self.handed.value(0.0, -1),))
        stamper.S.add(branch, stamper.column(waveform), -1.0)

    def current(self, layout: Layout) -> Functional:
        """Return the unknown current, which is zero."""
        return layout.branch(self.name)


class Sensed(Carrier):
    """A current of another block, for the elements that read it."""

    __slots__ = ("name", "node")

    def __init__(self, name: str) -> None:
        self.name = name
        self.node = f"i({name})"

    def current(self, layout: Layout) -> Functional:
        """Return the voltage of the node of the same name."""
        return Functional(z=layout.voltage(self.node, "0"))
