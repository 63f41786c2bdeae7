"""The mathematical problems nsspice solves, usable for any non-smooth system, not only circuits."""

from .csc import Csc, weighted_sum
from .descriptor import DescriptorSystem, Functional, SmoothTerms, Switch, Waveform
from .elements import Elements, elements_of
from .generalized import Cone, GeneralizedEquation, Ramp, Sign
from .tape import Tape, TapeBuilder

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
