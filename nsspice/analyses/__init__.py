"""The analyses: DC solution, sweep, transient, and everything a deck asks for at once."""

from __future__ import annotations

from .batch import Job, Request, jobs_of, run, run_job
from .cards import Dc, Op, Tran
from .certificate import Certificate
from .events import Event
from .load import read, read_deck
from .loop_gain import loop
from .measure import evaluate_measures
from .sensitivity import sens
from .settings import METHODS, Settings
from .small_signal import ac
from .solution import Impulse, IslandRun, Solution
from .statics import dc, op
from .steady_state import pss
from .transient import tran

__all__ = [
    "METHODS",
    "Certificate",
    "Dc",
    "Event",
    "Impulse",
    "IslandRun",
    "Job",
    "Op",
    "Request",
    "Settings",
    "Solution",
    "Tran",
    "ac",
    "dc",
    "evaluate_measures",
    "jobs_of",
    "loop",
    "op",
    "pss",
    "read",
    "read_deck",
    "run",
    "run_job",
    "sens",
    "tran",
]
