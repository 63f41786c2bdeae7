"""Elements that replace another one where the kinks of its expression may be pairs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, TypeVar

from ...netlist.expressions.expression import Expression
from ..device import Context, Device

if TYPE_CHECKING:
    from ...netlist.deck import Element


Origin = TypeVar("Origin", bound=Device)


class StandIn(Device, Generic[Origin]):
    """Base of elements that replace another one, under its name and between its nodes.

    Parameters
    ----------
    origin : Device
        The same element on the tape.
    """

    late = True
    NOISE = ()
    __slots__ = ("origin",)

    def __init__(self, origin: Origin) -> None:
        self.origin = origin
        for name in ("name", "letter", "nodes", "ends", "controls", "span", "node_spans"):
            setattr(self, name, getattr(origin, name))

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return nothing: a line is read as the origin, which may be one of these."""
        return None

    @property
    def kinked(self) -> bool:
        """Whether kinks may be pairs."""
        return True

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Return the expression."""
        return self.origin.expressions
