"""Slow, obvious and independent numpy version of the stepping scheme, and its yardsticks.

Nothing here is shared with the compiled core; only the data class of the descriptor system is.
"""

from .mlcp import OracleInfeasible, OracleStuck, Point, solve
from .residual import Mlcp, Undecided, feasible, least_violation, residual
from .stepping import Network, Record, instants, run
from .theta import theta_terms
from .uniqueness import directions, is_unique, unique_signals
from .waveforms import Corner, Source, merged_corners

__all__ = [
    "Corner",
    "Mlcp",
    "Network",
    "OracleInfeasible",
    "OracleStuck",
    "Point",
    "Record",
    "Source",
    "Undecided",
    "directions",
    "feasible",
    "instants",
    "is_unique",
    "least_violation",
    "merged_corners",
    "residual",
    "run",
    "solve",
    "theta_terms",
    "unique_signals",
]
