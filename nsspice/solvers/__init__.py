"""Numerical methods, usable without any netlist."""

from .mlcp import MlcpSolution, solve_mlcp
from .moreau import Jump, MoreauStepper, UnsolvedStep

__all__ = ["Jump", "MlcpSolution", "MoreauStepper", "UnsolvedStep", "solve_mlcp"]
