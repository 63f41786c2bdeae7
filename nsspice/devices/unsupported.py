"""Elements that a deck may hold and that this version reads but does not simulate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .device import Context, Device, refuse_smooth

if TYPE_CHECKING:
    from ..netlist.deck import Element


class Transistor(Device):
    """``Q c b e model``."""

    KIND = "transistor"
    __slots__ = ()

    @classmethod
    def read(cls, element: Element, context: Context) -> None:
        """Report the element by name."""
        refuse_smooth(
            element,
            f"{element.name} is a bipolar transistor",
            context.findings,
            "build it from diodes and F sources, or use a switch",
        )
