"""Solution: the named waveforms of one analysis, and everything known about how good they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ...errors import Diagnostic, UsageError, suggest
from ...netlist.expressions.node import COMPLEX_FORMS
from ..results.jumps import Impulse, JumpReport
from ..signals.events import Event
from ..signals.signal_names import canonical
from .computed_signals import derived
from .exports import HandedOver
from .run_statistics import RunStatistics

if TYPE_CHECKING:
    from ..averages.integrals import Integrals
    from ..certificate.certificate import Certificate
    from ..certificate.regularity import SolutionVerdict
    from ..results.error_estimate import ErrorEstimate
    from ..results.loop_report import LoopReport
    from ..results.loss_table import LossTable
    from ..results.periodic import Periodic
    from ..results.sensitivity import Sensitivity
    from ..results.spectrum import Spectrum
    from ..signals.signal_function import Motion
    from .computed_signals import Rows
    from .default_signals import View
    from .recording import Again, Recording

Floats = npt.NDArray[np.float64]


def part_of(response: npt.NDArray[np.complex128], part: str) -> Floats:
    """Return ``db``, ``m`` (magnitude), ``p`` (phase [deg], continuous), ``r`` or ``i``.

    Examples
    --------
    >>> part_of(np.array([10.0 + 0j]), "db").tolist()
    [20.0]
    """
    if part == "db":
        with np.errstate(divide="ignore"):
            decibels: Floats = 20.0 * np.log10(np.abs(response))
        return decibels
    if part == "p":
        degrees: Floats = np.rad2deg(np.unwrap(np.angle(response)))
        return degrees
    if part == "m":
        magnitude: Floats = np.abs(response)
        return magnitude
    real: Floats = response.real if part == "r" else response.imag
    return real


@dataclass(slots=True)
class FinePoints:
    """The rows of a solution with both sides of each jump put in, and points between the rows.

    Points between the rows are there where measures ask for them and lines between the rows do not
    follow a signal.

    Parameters
    ----------
    axis : ndarray, shape (k,)
        An instant of a jump appears twice.
    signals : dict of str to ndarray, shape (k,)
    """

    axis: Floats
    signals: dict[str, Floats]


@dataclass(frozen=True, slots=True)
class _Known:
    """Returns fine points that have been put together already: these can be pickled."""

    points: FinePoints | None

    def __call__(self) -> FinePoints | None:
        return self.points


def _values(parameters: Mapping[str, float]) -> str:
    """Return the values of the ``.step`` parameters as text."""
    inner = ", ".join(f"{name} = {value:g}" for name, value in parameters.items())
    return f"({inner})" if inner else ""


def _slots_of(item: object) -> dict[str, Any]:
    """Return the attributes of an object with slots, as they are pickled."""
    return {f.name: getattr(item, f.name) for f in fields(item)}  # type: ignore[arg-type]


@dataclass(slots=True, eq=False)
class IslandRun:
    """How one independent part of the circuit was solved.

    Parameters
    ----------
    number : int
        Counted from 1.
    problem_class, reason : str
        What kind of problem it is, and why.
    method : str
        ``modewise``, ``sdirk``, ``moreau``, or ``point by point`` where nothing stores energy.
    unknowns, pairs : int
    theta, step : float or None
        Weight of the new state, solver step [s] (the longest one of a method with step control).
    stats : dict
        Counters of the solver: steps, events, modes and others.
    note : str
        Why it was not another method, empty if there is nothing to say.
    reltol : float or None
        Relative tolerance of each step, of a method with step control.
    judge : SolutionVerdict, callable or None
        The verdict ``regularity`` of static islands with set-valued or smooth elements, or what
        returns it.
    cost : str
        What decides the cost of the run, a sentence.
    unwatched : tuple of str or None
        Switches that turn when they look at their controls, as rows do not show; None for all.
    """

    number: int
    problem_class: str
    reason: str
    method: str
    unknowns: int
    pairs: int
    theta: float | None = None
    step: float | None = None
    stats: dict[str, Any] = field(default_factory=dict)
    note: str = ""
    reltol: float | None = None
    judge: Callable[[], SolutionVerdict] | SolutionVerdict | None = None
    cost: str = ""
    unwatched: tuple[str, ...] | None = ()

    @property
    def regularity(self) -> SolutionVerdict | None:
        """Whether the solution is the only one, None if the question does not arise.

        It costs more than the run of a small circuit, and is computed when it is first read.
        """
        if callable(self.judge):
            self.judge = self.judge()
        return self.judge

    def __getstate__(self) -> tuple[None, dict[str, Any]]:
        # what computes the verdict holds the solver, which stays in its process
        return None, _slots_of(self) | {"judge": self.regularity}


@dataclass(slots=True, eq=False, repr=False)
class Solution(RunStatistics, HandedOver):
    """Result of one analysis.

    Parameters
    ----------
    analysis : str
        ``op``, ``dc``, ``tran``, ``pss``, ``ac`` or ``loop``.
    title : str
        Title line of the deck.
    axis_name : str
        ``time``, the swept name, or ``""`` for an operating point.
    axis : ndarray, shape (k,)
        Time [s] or the swept value.
    signals : dict of str to ndarray, shape (k,)
        Voltages [V], currents [A] and powers [W] by canonical name; outer sweep values come first.
    columns : list of str
        The signals that files and plots show; ``signals`` may hold more, for measures.
    parameters : dict of str to float
        Values of the ``.step`` parameters of this run.
    events : sequence of Event
        Changes of set-valued elements in order of time.
    impulses, jumps : list
        Impulses, and jumps of charge or flux with their energies.
    islands : list of IslandRun
    certificate : Certificate or None
    measures : dict of str to float
        ``.measure`` results, nan for one that was not found.
    warnings : list of Diagnostic
    interrupted : bool
        True if the run was stopped early; the rows up to there are valid.
    wall_time : float
        [s]
    row_count : int
        Rows computed; larger than ``axis.size`` only if rows were streamed and not kept.
    files : list of str
        Files that the command line wrote.
    error : ErrorEstimate or None
        Estimated distance from the exact solution, if requested.
    periodic : Periodic or None
        Period, Floquet multipliers and verdict of a periodic steady state.
    loop : LoopReport or None
        Crossover and margins of a loop gain.
    ports : tuple of float
        Impedances of the ports of ``.sp`` [Ohm].
    integrals : Integrals or None
        Exact Fourier coefficients, averages and powers of a periodic steady state.
    spectra : list of Spectrum
        Results of ``.four`` cards.
    powers : LossTable or None
        Average powers of all elements, if requested.
    sensitivities : list of Sensitivity
        Results of ``.sens`` cards.
    fine : callable or None
        Returns the rows with both sides of jumps put in, None if nothing jumps; they are computed
        at the first call.
    recording : Recording or None
        What the engine kept of signals between the rows.
    again : callable or None
        Runs the analysis once more and records other signals.
    more : Rows or None
        Runs the analysis once more, for signals requested later.
    view : View or None
        What a picture shows if no signals are named; None shows all ``columns``.

    Examples
    --------
    >>> sol = Solution("tran", "demo", "time", np.array([0.0, 1.0]),
    ...                {"v(a)": np.array([3.0, 4.0]), "v(b)": np.array([1.0, 1.0])})
    >>> sol["V(A, B)"].tolist()
    [2.0, 3.0]
    """

    analysis: str
    title: str
    axis_name: str
    axis: Floats
    signals: dict[str, Floats]
    columns: list[str] = field(default_factory=list)
    parameters: dict[str, float] = field(default_factory=dict)
    events: Sequence[Event] = field(default_factory=list)
    impulses: list[Impulse] = field(default_factory=list)
    jumps: list[JumpReport] = field(default_factory=list)
    islands: list[IslandRun] = field(default_factory=list)
    certificate: Certificate | None = None
    measures: dict[str, float] = field(default_factory=dict)
    warnings: list[Diagnostic] = field(default_factory=list)
    interrupted: bool = False
    wall_time: float = 0.0
    row_count: int = -1
    files: list[str] = field(default_factory=list)
    error: ErrorEstimate | None = None
    periodic: Periodic | None = None
    loop: LoopReport | None = None
    ports: tuple[float, ...] = ()
    integrals: Integrals | None = None
    spectra: list[Spectrum] = field(default_factory=list)
    powers: LossTable | None = None
    sensitivities: list[Sensitivity] = field(default_factory=list)
    fine: Callable[[], FinePoints | None] | None = None
    recording: Recording | None = None
    again: Again | None = None
    more: Rows | None = None
    view: View | None = None

    def __post_init__(self) -> None:
        if not self.columns:
            self.columns = list(self.signals)
        if self.row_count < 0:
            self.row_count = int(self.axis.size)

    def __getstate__(self) -> tuple[None, dict[str, Any]]:
        # what is computed when it is asked for holds the solver, which stays in its process
        fine = None if self.fine is None else _Known(self.fine())
        return None, _slots_of(self) | {"fine": fine}

    def __repr__(self) -> str:
        certificate = self.certificate
        verdict = (
            "not certified"
            if certificate is None
            else ("certificate holds" if certificate.passed else "certificate FAILS")
        )
        what = " ".join(filter(None, [self.analysis, repr(self.title), _values(self.parameters)]))
        return (
            f"<Solution {what}: {self.row_count} points of {len(self.columns)} signals, {verdict}>"
        )

    @property
    def time(self) -> Floats:
        """Time of each row [s], shape (k,)."""
        return self.axis

    @property
    def failure(self) -> Diagnostic | None:
        """Why the points are not reliable (NS3003), None if the certificate holds."""
        from .refusal import failure_of

        found = failure_of(self)
        return None if found is None else found.diagnostics[0]

    @property
    def stats(self) -> dict[str, Any]:
        """Counters summed over all islands; for residuals and stages the largest."""
        total: dict[str, Any] = {"rows": self.row_count, "wall_time": self.wall_time}
        for island in self.islands:
            for key, value in island.stats.items():
                if isinstance(value, (int, float)) and not isinstance(value, bool):
                    largest = key.startswith("residual") or key in ("worst_stage", "grid_residual")
                    before = total.get(key, 0)
                    total[key] = max(before, value) if largest else before + value
        return total

    def __getitem__(self, name: str) -> Floats:
        """Return a waveform by name, or an expression of waveforms: ``v(a)-v(b)``, ``p(r1)``.

        Signals that were not recorded cost another run of the analysis; they are kept.
        """
        if not isinstance(name, str):
            raise TypeError(f"name a signal by a string such as 'v(out)', not by {name!r}")
        key = canonical(name)
        found = self._recorded(key)
        if found is None:
            found = derived(self, name)
        if found is not None:
            return found
        if key[:2] in ("v(", "i(", "p("):
            hint = "list it in signals= or extra= of the run, or on a .save card"
        else:
            hint = f"signals are {', '.join(list(self.signals)[:8]) or 'v(node) and i(element)'}"
        hint = suggest(key, self.signals) or hint
        raise KeyError(f"no signal {name!r} in this solution; {hint}")

    def __contains__(self, name: object) -> bool:
        """Return whether a signal is known without running the analysis once more."""
        return self._recorded(canonical(str(name))) is not None

    def _recorded(self, key: str) -> Floats | None:
        """Return a recorded signal, the axis, a difference of node voltages or a part of one."""
        if key in self.signals:
            return self.signals[key]
        if key == self.axis_name:
            return self.axis
        if key.startswith("v(") and "," in key:
            plus, _, minus = key[2:-1].partition(",")
            if all(n == "0" or f"v({n})" in self.signals for n in (plus, minus)):
                return self._voltage(plus) - self._voltage(minus)
        response: Floats | None = self._response(key)
        return response

    def _response(self, key: str) -> Any:
        """Return a complex signal of ``.ac``, or a part of one: ``vdb(out)``; None without it."""
        kind, _, inner = key.partition("(")
        if kind in COMPLEX_FORMS:
            whole = self._response(f"{kind[0]}({inner}")
            return None if whole is None else part_of(whole, kind[1:])
        if f"re({key})" in self.signals:
            return self.signals[f"re({key})"] + 1j * self.signals[f"im({key})"]
        if kind == "v" and "," in inner:
            nodes = [self._response(f"v({node})") for node in inner[:-1].split(",")]
            if all(v is not None for v in nodes):
                return nodes[0] - nodes[1]
        return None

    def _voltage(self, node: str) -> Floats:
        return np.zeros(self.axis.size) if node == "0" else self.signals[f"v({node})"]

    def with_jumps(self) -> Solution:
        """Return the solution whose rows hold both sides of each jump, itself if it has none."""
        fine = None if self.fine is None else self.fine()
        if fine is None:
            return self
        changes: dict[str, Any] = {"fine": None, "recording": None, "again": None, "more": None}
        return replace(self, axis=fine.axis, signals=fine.signals, **changes)

    def motion(
        self, names: Sequence[str], start: float | None = None, stop: float | None = None
    ) -> Motion:
        """Return signals as functions between two instants, as accurate as the engine knows them.

        Signals that were not recorded are recorded by another run. For a sweep, and for rows
        without an engine, signals are interpolated linearly between the rows.

        Parameters
        ----------
        names : sequence of str
            Signals, including those that were not requested in the run.
        start, stop : float, optional
            The window; the whole run by default.

        Raises
        ------
        KeyError, NetlistError
            If there is no such signal.
        UsageError
            NS4028 if more happens in the window than can be kept.
        """
        from ..signals.signal_function import Motion
        from .recording import named, recorded

        wanted = [name for name in named(names) if name != self.axis_name]
        if self.again is not None and self.axis.size > 1:
            first, last = float(self.axis[0]), float(self.axis[-1])
            low = first if start is None else min(max(start, first), last)
            high = last if stop is None else min(max(stop, low), last)
            self.recording = recorded(
                self.recording, self.again, wanted, (low, high), (first, last)
            )
            return self.recording.motion(wanted, low, high)
        rows = self.with_jumps()
        return Motion.of_rows(rows.axis, {n: rows[n] for n in wanted}, self.axis_name or "op")

    def losses(self, *loads: str) -> LossTable:
        """Return average powers of all elements of ``.tran`` or ``.pss``: losses and efficiency.

        Parameters
        ----------
        loads : str
            Elements whose power is useful.

        Raises
        ------
        UsageError
            NS4005 of another analysis than these two, or for a load that the circuit lacks.
        """
        from ..averages.spectrum import add_powers

        if self.integrals is None and self.analysis == "tran" and self.again is not None:
            self.integrals = self.again.integrals()
        if self.again is not None:
            exact = self.integrals
            circuit = self.again.circuit() if exact is None else exact.circuit
            add_powers(circuit, self, [name.lower() for name in loads])
        if self.powers is None:
            hint = "use .tran or .pss"
            raise UsageError(Diagnostic("NS4005", "there are no average powers", hint=hint))
        return self.powers

    def values(self) -> Mapping[str, Floats]:
        """Return axis and signals by name, as expressions see them."""
        return {self.axis_name or "op": self.axis, **self.signals}

    def table(self, columns: Sequence[str] | None = None) -> tuple[list[str], Floats]:
        """Return the column names and the rows, axis first, shape (k, 1 + number of columns).

        Parameters
        ----------
        columns : sequence of str, optional
            Signals to return; all ``columns`` of the solution by default.

        Examples
        --------
        >>> sol = Solution("tran", "demo", "time", np.array([0.0, 1.0]), {"v(a)": np.ones(2)})
        >>> names, rows = sol.table(["v(a)"])
        >>> names, rows.tolist()
        (['time', 'v(a)'], [[0.0, 1.0], [1.0, 1.0]])
        """
        names = list(self.columns if columns is None else columns)
        arrays = [self[name] for name in names]
        if self.axis_name:
            names, arrays = [self.axis_name, *names], [self.axis, *arrays]
        if not arrays:
            return names, np.zeros((self.axis.size, 0))
        return names, np.column_stack(arrays)
