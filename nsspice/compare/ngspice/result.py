"""A finished run of ngspice, and what went wrong in one that did not finish."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...analyses.request.cards import Dc, Op, Tran
from ...analyses.signals.signal_names import canonical
from ...analyses.solution.solution import Floats
from ...errors import ComparisonError, Diagnostic
from .child import is_failure
from .raw_run import RawRun
from .translate import Translation


@dataclass(frozen=True, slots=True)
class NgspiceRun:
    """Waveforms of ngspice under the names of nsspice.

    Parameters
    ----------
    axis : ndarray, shape (k,)
        ngspice's own time points [s], or row numbers of a sweep.
    vectors : dict of str to ndarray, shape (k,)
        Node voltages [V] and currents [A].
    seconds : float
        Duration of the analysis inside its process [s], by the clock.
    points, rejected, iterations : int
        Accepted and rejected time points, Newton iterations.
    runner, version : str
        ``libngspice`` or ``ngspice -b``, and which ngspice.
    translation : Translation
        The deck and what stands for the laws that ngspice does not have.
    counters : dict of str to float
        ngspice's own account.
    attempts : tuple of NgspiceError
        Failures with sharper substitutes before this run.
    """

    axis: Floats
    vectors: Mapping[str, Floats]
    seconds: float
    points: int
    rejected: int
    iterations: int
    runner: str
    version: str
    translation: Translation
    counters: Mapping[str, float]
    attempts: tuple[NgspiceError, ...] = ()

    @property
    def time(self) -> Floats:
        """Time points [s]."""
        return self.axis

    def __getitem__(self, name: str) -> Floats:
        """Return a signal: ``v(a)``, ``v(a,b)`` or ``i(d1)``."""
        key = canonical(name)
        if key in self.vectors:
            return self.vectors[key]
        if key.startswith("v("):
            plus, _, minus = key[2:-1].partition(",")
            ends = [n for n in (plus, minus) if n not in ("", "0")]
            if all(f"v({n})" in self.vectors for n in ends):
                zero = np.zeros(self.axis.size)
                high = zero if plus == "0" else self.vectors[f"v({plus})"]
                return high - (zero if minus in ("", "0") else self.vectors[f"v({minus})"])
        raise KeyError(f"ngspice saved no signal {name!r}")


class NgspiceError(ComparisonError):
    """ngspice did not finish.

    Parameters
    ----------
    diagnostic : Diagnostic
    reason : str
        ``timestep too small``, ``no operating point``, ``singular matrix``, ``code model missing``,
        ``stopped early``, ``time-out`` or ``failed``.
    translation : Translation
    time : float or None
        Last time that ngspice reached [s].
    """

    def __init__(
        self, diagnostic: Diagnostic, reason: str, translation: Translation, time: float | None
    ) -> None:
        super().__init__(diagnostic)
        self.reason = reason
        self.translation = translation
        self.time = time


def finished(raw: RawRun, translation: Translation) -> NgspiceRun:
    """Return a run that reached its end.

    Raises
    ------
    NgspiceError
        NS5010 if ngspice reports a failure, or stopped silently before the end.
    """
    found = raw.vectors()
    analysis = translation.analysis
    axis = found.get("time", found.get("sweep"))
    if isinstance(analysis, Op):
        axis = np.zeros(1)
    reached = float(axis[-1]) if axis is not None and axis.size else None
    failures = [line.strip() for line in raw.log if is_failure(line)]
    if isinstance(analysis, Dc) and any(_SPOILT in line.lower() for line in raw.log):
        raise _failure(raw, failures, translation, reached)
    if failures or axis is None or axis.size == 0:
        raise _failure(raw, failures, translation, reached)
    if isinstance(analysis, Tran) and axis[-1] < analysis.stop * (1.0 - 1e-9):
        raise _failure(raw, [], translation, reached)
    if isinstance(analysis, Dc):
        rows = analysis.grid[0].size
        if axis.size != rows:
            raise _failure(raw, [], translation, reached)
        axis = np.arange(rows, dtype=np.float64)
    vectors = {
        signal: np.asarray(found[vector], dtype=np.float64)
        for signal, vector in translation.vectors.items()
        if vector in found
    }
    lost = [signal for signal in translation.vectors if signal not in vectors]
    if lost:
        raise _failure(raw, [f"it saved no {', '.join(lost)}"], translation, reached)
    counters = raw.counters
    return NgspiceRun(
        axis=np.asarray(axis, dtype=np.float64),
        vectors=vectors,
        seconds=raw.seconds,
        points=int(counters.get("Accepted timepoints", axis.size)),
        rejected=int(counters.get("Rejected timepoints", 0)),
        iterations=int(counters.get("Total iterations", 0)),
        runner=raw.runner,
        version=raw.version,
        translation=translation,
        counters=counters,
    )


#: after this ngspice leaves a conductance at each junction, for all points to come
_SPOILT = "true gmin stepping failed"
_REASONS = (
    ("timestep too small", "timestep too small"),
    ("unable to find definition of model", "code model missing"),
    ("unknown model type", "code model missing"),
    ("invalid model type", "code model missing"),
    ("singular matrix", "singular matrix"),
    ("no dc path", "no operating point"),
    ("gmin stepping failed", "no operating point"),
    ("source stepping failed", "no operating point"),
    ("no convergence", "no operating point"),
    ("iteration limit reached", "no operating point"),
)


def _failure(
    raw: RawRun, failures: list[str], translation: Translation, reached: float | None
) -> NgspiceError:
    """Return the error that says in one sentence what ngspice did."""
    log = "\n".join(raw.log).lower()
    reason = next((name for sign, name in _REASONS if sign in log), "failed")
    if reason == "timestep too small" and not isinstance(translation.analysis, Tran):
        reason = "no operating point"  # its search for one makes time steps, too
    if not failures and reason == "failed":
        reason = "stopped early"
    if reason == "timestep too small":
        said = re.search(r"timestep too small.*?time = ([-+.\deE]+)", log, re.I)
        reached = float(said[1].rstrip(",")) if said else reached
    where = ""
    if isinstance(translation.analysis, Tran) and reached is not None:
        where = f" at t = {reached:g} s of {translation.analysis.stop:g} s"
    said_lines = [line for line in failures if "aborted" not in line][:1]
    text = f"ngspice failed{where}: {reason}"
    if reason == "failed":
        text = f"ngspice failed{where}" + (f": {said_lines[0]}" if said_lines else "")
    elif reason == "stopped early":
        text = f"ngspice stopped{where} without a reason"
    hints = {
        "timestep too small": "use softer substitutes: --junction 0.1, a larger --ron, or a "
        "looser --reltol",
        "no operating point": "start with uic, or use softer substitutes: --junction 0.1, a "
        "larger --ron",
        "code model missing": "install the program ngspice, or use --junction 0.01",
    }
    hint = hints.get(reason, "save the deck with --deck FILE and look at it")
    instant = reached if isinstance(translation.analysis, Tran) else None
    return NgspiceError(Diagnostic("NS5010", text, hint=hint), reason, translation, instant)
