"""Numerical methods, usable without any netlist: the Python interfaces of the compiled core.

Read ``stepper`` (what all engines share), ``modewise``, ``implicit`` with ``moreau`` and ``sdirk``,
then ``orbit``.  ``certificate`` proves that a problem has no solution.  Imports ``problems`` only.
"""

from .mlcp import MlcpSolution, solve_mlcp
from .moreau import MoreauStepper
from .stepper import Jump, UnsolvedStep

__all__ = ["Jump", "MlcpSolution", "MoreauStepper", "UnsolvedStep", "solve_mlcp"]
