"""The analyses: every card that asks for a computation, in rooms that import one way.

Read ``studies.batch`` (everything a deck asks for), ``static.statics`` (``.op``, ``.dc``),
``transient.transient`` (``.tran``), ``steady.steady_state`` (``.pss``), then ``solution.solution``.
Imports ``netlist``, ``devices``, ``circuit``, ``problems`` and ``solvers``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..lazy import lazily

if TYPE_CHECKING:
    from .certificate.certificate import Certificate
    from .request.cards import Dc, Op, Tran
    from .request.load import read, read_deck
    from .request.request import Request
    from .request.settings import METHODS, Settings
    from .results.jumps import Impulse
    from .signals.events import Event
    from .solution.solution import IslandRun, Solution
    from .static.statics import dc, op
    from .steady.loop_gain import loop
    from .steady.sensitivity import sens
    from .steady.small_signal import ac
    from .steady.steady_state import pss
    from .studies.batch import Job, jobs_of, run, run_job
    from .transient.measure import evaluate_measures
    from .transient.transient import tran

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

__getattr__ = lazily(
    __name__,
    {
        "Certificate": ".certificate.certificate",
        "Dc": ".request.cards",
        "Event": ".signals.events",
        "Impulse": ".results.jumps",
        "IslandRun": ".solution.solution",
        "Job": ".studies.batch",
        "METHODS": ".request.settings",
        "Op": ".request.cards",
        "Request": ".request.request",
        "Settings": ".request.settings",
        "Solution": ".solution.solution",
        "Tran": ".request.cards",
        "ac": ".steady.small_signal",
        "dc": ".static.statics",
        "evaluate_measures": ".transient.measure",
        "jobs_of": ".studies.batch",
        "loop": ".steady.loop_gain",
        "op": ".static.statics",
        "pss": ".steady.steady_state",
        "read": ".request.load",
        "read_deck": ".request.load",
        "run": ".studies.batch",
        "run_job": ".studies.batch",
        "sens": ".steady.sensitivity",
        "tran": ".transient.transient",
    },
)
