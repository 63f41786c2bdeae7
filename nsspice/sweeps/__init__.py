"""Many runs of one deck: points, workers, one table.

Read ``run`` first: it puts together ``points`` (grids, lists, samples), ``targets`` (what a name
changes), ``plan`` (all that a worker needs, sent once), ``worker`` (one chunk of points),
``executors`` (processes or a cluster) and ``journal`` (to go on later).  ``table`` is the result.
Imports ``output``, ``analyses`` and everything below them.
"""

from __future__ import annotations

from .points import LogUniform, Normal, Points, Tolerance, Uniform, corners, grid, paired, samples
from .run import sweep
from .table import SweepTable

__all__ = [
    "LogUniform",
    "Normal",
    "Points",
    "SweepTable",
    "Tolerance",
    "Uniform",
    "corners",
    "grid",
    "paired",
    "samples",
    "sweep",
]
