"""The mathematical problems nsspice solves, usable for any non-smooth system, not only circuits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..lazy import lazily
from .csc import Csc, weighted_sum
from .descriptor import DescriptorSystem, Functional, SmoothTerms, Switch, Waveform
from .elements import Elements, elements_of
from .tape import Tape, TapeBuilder

if TYPE_CHECKING:
    from .generalized import Cone, GeneralizedEquation, Ramp, Sign

__all__ = [
    "Cone",
    "Csc",
    "DescriptorSystem",
    "Elements",
    "Functional",
    "GeneralizedEquation",
    "Ramp",
    "Sign",
    "SmoothTerms",
    "Switch",
    "Tape",
    "TapeBuilder",
    "Waveform",
    "elements_of",
    "weighted_sum",
]

__getattr__ = lazily(
    __name__,
    dict.fromkeys(("Cone", "GeneralizedEquation", "Ramp", "Sign"), ".generalized"),
)
