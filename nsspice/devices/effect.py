"""Effects: the parts of a law that a deck calls for by giving their parameters."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Effect:
    """One active effect of an element.

    Parameters
    ----------
    name : str
        ``conduction``, ``forward drop``, ``on-resistance`` ...
    parameter : str
        The parameter that called for it, ``""`` for the law itself.
    value : float or None
        Its value after ``area`` and ``m``.
    unit : str

    Examples
    --------
    >>> str(Effect("forward drop", "vfwd", 0.7, "V"))
    'forward drop (vfwd=0.7 V)'
    """

    name: str
    parameter: str = ""
    value: float | None = None
    unit: str = ""

    def __str__(self) -> str:
        if not self.parameter:
            return self.name
        if self.parameter == "value":  # the value of the element line itself
            return self.name if self.value is None else f"{self.name} {self.value:g} {self.unit}"
        if self.value is None:
            return f"{self.name} ({self.parameter})"
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.name} ({self.parameter}={self.value:g}{unit})"


def called_for(
    card: Mapping[str, float],
    known: Iterable[tuple[str, str, str]],
    neutral: Collection[str],
) -> tuple[Effect, ...]:
    """Return the effects whose parameters a card gives.

    Parameters
    ----------
    card : mapping of str to float
    known : iterable of (str, str, str)
        Parameter, name and unit.
    neutral : collection of str
        Parameters that mean "no such effect" where they are zero.

    Examples
    --------
    >>> known = [("kp", "gain", ""), ("rd", "drain resistance", "Ohm")]
    >>> [str(effect) for effect in called_for({"rd": 0.0, "kp": 2.0}, known, {"rd"})]
    ['gain (kp=2)']
    """
    return tuple(
        Effect(name, key, card[key], unit)
        for key, name, unit in known
        if key in card and (card[key] or key not in neutral)
    )
