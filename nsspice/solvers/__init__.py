"""Numerical methods, usable without any netlist."""

from .mlcp import MlcpSolution, solve_mlcp
from .moreau import MoreauStepper
from .stepper import Jump, UnsolvedStep

__all__ = ["Jump", "MlcpSolution", "MoreauStepper", "UnsolvedStep", "solve_mlcp"]
