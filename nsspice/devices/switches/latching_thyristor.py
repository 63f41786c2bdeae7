"""Ideal thyristor: blocks until it is fired, then is a diode until its current has come to zero.

    fired:      0 <= i  _|_  Vh + Ron i - v >= 0          blocked:      i = 0

It is fired while the gate current exceeds ``Igt`` or, where the card gives no ``Igt``, while the
voltage from gate to cathode, which then draws no current, exceeds ``Vgt``; a breakover voltage
``Vbo`` lowers these thresholds in proportion to the voltage from anode to cathode.  The falling
branch between breakover and holding of `Thyristor`, which no stable state lies on, shrinks to the
instant of firing, so that a converter of thyristors is linear between its events (N. Mohan,
T. M. Undeland, W. P. Robbins, *Power Electronics*, 3rd ed. (2003), section 2-3).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...netlist.expressions.expression import Expression
from ...problems.descriptor import Functional, Switch
from ..effect import Effect
from ..stamper import Layout, Stamper
from .thyristor import Thyristor

if TYPE_CHECKING:
    from ...netlist.deck import Element


class LatchingThyristor(Thyristor):
    """A thyristor without a falling branch: one pair that the gate turns into a diode."""

    smooth = False
    late = False
    __slots__ = ()

    def __init__(
        self, element: Element, card: Mapping[str, float], curve: Expression | None, parallel: float
    ) -> None:
        super().__init__(element, card, curve, parallel)
        self.effects = (*self.effects, Effect("stays on while it conducts"))
        if len(self.nodes) > 2 and "igt" not in card:
            # the gate is sensed as the control of a switch is
            self.controls = (self.nodes[2], self.ends[1])
            self.nodes = self.ends

    @property
    def control_nodes(self) -> tuple[str, ...]:
        """Return gate and cathode where no gate current flows."""
        return self.controls

    def allocate(self, stamper: Stamper) -> None:
        """Need nothing: the current is that of a pair."""

    def stamp(self, stamper: Stamper) -> None:
        """Write the pairs, and what fires the first one."""
        card, layout = self.card, stamper.layout
        drop, slope = card.get("vh", 0.0), card.get("ron", 0.0) / self.parallel
        forward = stamper.pair(f"{self.name}.fwd", self.name, *self.ends, drop, slope)
        gate = self._stamp_pairs(stamper, forward)
        control: tuple[tuple[int, float], ...] = ()
        if gate is not None:
            threshold = card["igt"] * self.parallel
            control = ((gate, 1.0),)
        elif self.controls:
            threshold = card["vgt"]
            control = layout.voltage(self.controls[0], self.controls[1])
        else:
            threshold = card["vbo"]
        if "vbo" in card:
            control += layout.voltage(*self.ends, threshold / card["vbo"])
        fired = Switch(forward, control, threshold, threshold, latching=True)
        stamper.switches.append(fired)

    def _forward(self, layout: Layout) -> Functional:
        """Return the forward current."""
        return Functional(lam=((layout.pairs[self.name][0], 1.0),))
