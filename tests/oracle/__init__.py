"""Slow, obvious and independent numpy version of the stepping scheme, and its yardsticks.

Nothing here is shared with the compiled core; only the data class of the descriptor system is.
"""

from .mlcp import OracleInfeasible, solve
from .residual import Mlcp, Undecided, feasible, residual
from .stepping import Network

__all__ = [
    "Mlcp",
    "Network",
    "OracleInfeasible",
    "Undecided",
    "feasible",
    "residual",
    "solve",
]
