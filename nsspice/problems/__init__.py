"""The mathematical problems nsspice solves, usable for any non-smooth system, not only circuits.

Read ``descriptor`` (the form of every circuit), ``tape`` (smooth functions), ``verdict`` (what can
be proved), then ``matrices`` and ``theorems``.  Imports no other folder.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..lazy import lazily
from .csc import Csc, weighted_sum
from .descriptor import DescriptorSystem, Functional, SmoothTerms, Switch, Waveform
from .elements import Elements, elements_of
from .tape import Tape, TapeBuilder

if TYPE_CHECKING:
    from .generalized import Cone, GeneralizedEquation, Ramp, Sign
    from .matrices import (
        is_copositive,
        is_definite,
        is_h_matrix,
        is_m_matrix,
        is_monotone,
        is_p0_matrix,
        is_p_matrix,
    )
    from .verdict import Verdict, Witness

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
    "Verdict",
    "Waveform",
    "Witness",
    "elements_of",
    "is_copositive",
    "is_definite",
    "is_h_matrix",
    "is_m_matrix",
    "is_monotone",
    "is_p0_matrix",
    "is_p_matrix",
    "weighted_sum",
]

_MATRICES = (
    "is_copositive",
    "is_definite",
    "is_h_matrix",
    "is_m_matrix",
    "is_monotone",
    "is_p0_matrix",
    "is_p_matrix",
)
__getattr__ = lazily(
    __name__,
    {
        **dict.fromkeys(("Cone", "GeneralizedEquation", "Ramp", "Sign"), ".generalized"),
        **dict.fromkeys(_MATRICES, ".matrices"),
        **dict.fromkeys(("Verdict", "Witness"), ".verdict"),
    },
)
