"""From decks to equations: graph, topology, islands, problem class, MNA system, DLCP form."""

from __future__ import annotations

from .build import build
from .circuit import Circuit, Island
from .dlcp import DlcpForm, dlcp_form
from .explain import Explanation, explain
from .mna import MnaSystem, Store, assemble
from .normal_tree import NormalTree, normal_tree
from .problem_class import ProblemClass
from .signals import parse_signal, unknown_signal
from .theta import theta_terms

__all__ = [
    "Circuit",
    "DlcpForm",
    "Explanation",
    "Island",
    "MnaSystem",
    "NormalTree",
    "ProblemClass",
    "Store",
    "assemble",
    "build",
    "dlcp_form",
    "explain",
    "normal_tree",
    "parse_signal",
    "theta_terms",
    "unknown_signal",
]
