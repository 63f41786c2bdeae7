"""From decks to equations: graph, topology, islands, problem class, MNA system.

Read ``build`` (from deck to circuit), ``islands``, ``spanning`` (which voltages are unknowns),
``mna`` (the equations), ``problem_class``.  Imports ``netlist``, ``devices`` and ``problems``.

Names that a plain run does not need are imported from their own modules: ``explain.explain``,
``dlcp.dlcp_form``, ``normal_tree.normal_tree``, ``theta.theta_terms``.
"""

from __future__ import annotations

from .build import build
from .circuit import Circuit, Island
from .mna import MnaSystem, Store, assemble
from .problem_class import ProblemClass
from .signals import parse_signal, unknown_signal

__all__ = [
    "Circuit",
    "Island",
    "MnaSystem",
    "ProblemClass",
    "Store",
    "assemble",
    "build",
    "parse_signal",
    "unknown_signal",
]
