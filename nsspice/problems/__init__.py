"""The mathematical problems nsspice solves, usable for any non-smooth system, not only circuits."""

from .csc import Csc, weighted_sum
from .descriptor import DescriptorSystem, Functional, SmoothTerms, Switch, Waveform
from .elements import Elements, elements_of
from .tape import Tape, TapeBuilder

__all__ = [
    "Csc",
    "DescriptorSystem",
    "Elements",
    "Functional",
    "SmoothTerms",
    "Switch",
    "Tape",
    "TapeBuilder",
    "Waveform",
    "elements_of",
    "weighted_sum",
]
