"""Numerical methods, usable without any netlist: the Python interfaces of the compiled core.

Read ``stepper`` (what all engines share), ``modewise``, ``implicit`` with ``moreau`` and ``sdirk``,
then ``orbit``.  ``certificate`` proves that a problem has no solution.  Imports ``problems`` only.
"""

from typing import TYPE_CHECKING

from ..lazy import lazily
from .moreau import MoreauStepper
from .stepper import Jump, UnsolvedStep

if TYPE_CHECKING:
    from .mlcp import MlcpSolution, solve_mlcp

__getattr__ = lazily(__name__, dict.fromkeys(("MlcpSolution", "solve_mlcp"), ".mlcp"))

__all__ = ["Jump", "MlcpSolution", "MoreauStepper", "UnsolvedStep", "solve_mlcp"]
