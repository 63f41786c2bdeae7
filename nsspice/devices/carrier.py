"""What expressions and controlled elements read: the current of an element or of a terminal."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from ..problems.descriptor import Functional
from .stamper import Layout

if TYPE_CHECKING:
    from .device import Device


class Carrier(ABC):
    """Something that carries a current."""

    name: str
    __slots__ = ()

    @abstractmethod
    def current(self, layout: Layout) -> Functional:
        """Return the current into the first terminal as an output."""


class Terminal(Carrier):
    """One terminal of an element, for expressions that read its current ``i(q1.b)``."""

    __slots__ = ("name", "owner", "terminal")

    def __init__(self, owner: Device, terminal: str) -> None:
        self.name = f"{owner.name}.{terminal}"
        self.owner = owner
        self.terminal = terminal

    def current(self, layout: Layout) -> Functional:
        """Return the current into the terminal."""
        return self.owner.terminal_current(layout, self.terminal)
