"""Elements that a deck may hold and that this version reads but does not simulate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .device import Context, Device, refuse_smooth

if TYPE_CHECKING:
    from ..netlist.deck import Element


class Behavioural(Device):
    """``B a b V={...}`` or ``I={...}``."""

    KIND = "behavioural source"
    __slots__ = ()

    @classmethod
    def read(cls, element: Element, context: Context) -> None:
        """Report the element by name."""
        refuse_smooth(
            element,
            f"{element.name} is a behavioural source",
            context.findings,
            "use E, G, F or H with a constant gain, or a V or I source",
        )


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
