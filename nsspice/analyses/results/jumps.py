"""State jumps: impulses, and stored charge and flux on both sides, with their energies."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Impulse:
    """The content of a Dirac impulse through or across an element.

    Parameters
    ----------
    time : float
        [s]
    element : str
    value : float
        Charge or flux.
    unit : str
        ``"A s"`` or ``"V s"``.
    """

    time: float
    element: str
    value: float
    unit: str


@dataclass(frozen=True, slots=True)
class Moved:
    """Charge of a capacitor or flux of an inductor on both sides of a jump.

    Parameters
    ----------
    element : str
    before, after : float
        Charge [A s] or flux [V s].
    unit : str
        ``"A s"`` or ``"V s"``.
    """

    element: str
    before: float
    after: float
    unit: str


@dataclass(frozen=True, slots=True)
class JumpReport:
    """A jump of stored charge or flux, with its balance of energy.

    Parameters
    ----------
    time : float
        [s]
    before, after : float
        Stored energy of the island [J].
    delivered : float
        Energy that sources gave during the jump [J].
    stores : list of Moved
        The capacitors and inductors whose content jumped.
    impulses : list of Impulse
        Through or across which elements.
    """

    time: float
    before: float
    after: float
    delivered: float
    stores: list[Moved]
    impulses: list[Impulse]

    @property
    def lost(self) -> float:
        """Energy that was stored or delivered and is nowhere afterwards [J]."""
        return self.before + self.delivered - self.after
