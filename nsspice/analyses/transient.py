"""Transient analysis: every island through time on its own, rows put side by side."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..circuit import Circuit, Island, MnaSystem
from ..errors import Diagnostic, NumericalError, UsageError
from ..netlist.deck import TranCard
from ..solvers.moreau import MoreauStepper, UnsolvedStep
from .cards import Tran
from .certificate import Certificate
from .curve import Floats
from .failure import named_failure
from .impulses import impulses_of
from .initial import start
from .recorder import Recorder, select
from .settings import Settings
from .sink import Sink, Store
from .solution import Impulse, IslandRun, Solution

#: Called with the finished share of the run, 0 to 1.
Progress = Callable[[float], None]

_BUDGET = 0.05  # [s] longest stretch inside the core: Ctrl-C waits no longer
_CHUNK_TIME = 0.1  # [s] aim for one block of rows
_CHUNK_NUMBERS = 1 << 20  # most numbers in one block
_POINTS = 1 << 16  # points of a static island planned at once


def tran(
    circuit: Circuit,
    stop: float | None = None,
    row_step: float | None = None,
    *,
    step: float | None = None,
    start: float = 0.0,
    uic: bool | None = None,
    method: str | None = None,
    theta: float | None = None,
    signals: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
    progress: Progress | None = None,
    sink: Sink | None = None,
    keep: bool = True,
) -> Solution:
    """Simulate a circuit in time.

    Parameters
    ----------
    circuit : Circuit
        From :func:`nsspice.read`.
    stop : float, optional
        End [s]; without it everything comes from the deck's first ``.tran`` card.
    row_step : float, optional
        Distance of the output rows [s]; a thousandth of the time by default.
    step : float, optional
        Solver step [s]; by default as SPICE chooses its largest step.
    start : float
        First output row [s].
    uic : bool, optional
        Start from the initial values of the elements instead of the DC solution.
    method : str, optional
        ``auto`` or ``moreau``.
    theta : float, optional
        Weight of the new state: 1 implicit (default), 0.5 trapezoidal in the smooth part.
    signals : sequence of str, optional
        What to return; the deck's ``.save`` cards, or the default set.
    extra : sequence of str
        Signals that are recorded but not among ``columns``.
    temperature : float, optional
        [degrees Celsius]
    values : mapping of str to float, optional
        Values of R, L, C or sources by element name that replace the deck's.
    progress : callable, optional
        Called with the finished share, 0 to 1.
    sink : Sink, optional
        Takes the rows while they are computed.
    keep : bool
        False leaves the rows to the sink alone; the solution then holds the first and last row.

    Returns
    -------
    Solution
        With ``interrupted`` set if Ctrl-C stopped it; the rows up to there are complete.

    Raises
    ------
    NumericalError
        If a step has no solution; ``partial`` holds what was computed before.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''RC
    ... V1 a 0 1
    ... R1 a b 1
    ... C1 b 0 1 IC=0
    ... ''')
    >>> sol = nsspice.tran(circuit, stop=1.0, step=1e-3, uic=True)
    >>> abs(float(sol["v(b)"][-1]) - (1 - 2.718281828**-1)) < 2e-4
    True
    """
    if stop is not None:
        analysis = Tran(stop, row_step, start, None, bool(uic))
    else:
        analysis = _from_deck(circuit, uic)
    settings = Settings.of(circuit.deck, method, theta, step)
    return run_tran(
        circuit,
        analysis,
        settings,
        signals=signals,
        extra=extra,
        temperature=temperature,
        values=values or {},
        progress=progress,
        sink=sink,
        keep=keep,
    )


def _from_deck(circuit: Circuit, uic: bool | None) -> Tran:
    for card in circuit.deck.analyses:
        if isinstance(card, TranCard):
            found = Tran.from_card(card)
            if uic is None:
                return found
            return Tran(found.stop, found.row_step, found.start, found.max_step, uic)
    raise UsageError(
        Diagnostic(
            "NS4006",
            f"{circuit.deck.file} has no .tran card",
            hint="pass stop=, or add .tran tstep tstop to the deck",
        )
    )


def run_tran(
    circuit: Circuit,
    analysis: Tran,
    settings: Settings,
    *,
    signals: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
    progress: Progress | None = None,
    sink: Sink | None = None,
    keep: bool = True,
) -> Solution:
    """Run one transient analysis; see :func:`tran`."""
    begin = clock.perf_counter()
    columns = select(circuit, signals)
    names = columns + [n for n in select(circuit, extra) if n not in columns] if extra else columns
    recorder = Recorder(circuit, names)
    runners = [
        _Runner(circuit, k, island, recorder.local[k], analysis, settings, temperature, values)
        for k, island in enumerate(circuit.islands)
    ]
    rows = analysis.row_count
    store = Store(rows if keep else 2, 1 + len(names))
    if sink is not None:
        sink.open(["time", *columns])
    outlet = _Outlet(recorder, store, sink, keep)
    failure: NumericalError | None = None
    interrupted = False
    try:
        for runner in runners:
            runner.start()
        interrupted = _loop(runners, outlet, rows, analysis, progress)
    except KeyboardInterrupt:
        interrupted = True
    except NumericalError as error:
        failure = error
    if sink is not None and (failure is None or outlet.rows):
        sink.close()
    solution = Solution(
        "tran",
        circuit.deck.title,
        "time",
        outlet.table[:, 0],
        {name: outlet.table[:, 1 + k] for k, name in enumerate(names)},
        columns,
        impulses=sorted((p for runner in runners for p in runner.impulses()), key=lambda p: p.time),
        islands=[runner.report() for runner in runners],
        certificate=Certificate.of(r.stepper.statistics for r in runners),
        interrupted=interrupted,
        wall_time=clock.perf_counter() - begin,
        row_count=outlet.rows,
    )
    if failure is not None:
        failure.partial = solution
        raise failure
    return solution


class _Runner:
    """One island on its way through time."""

    def __init__(
        self,
        circuit: Circuit,
        number: int,
        island: Island,
        names: Sequence[str],
        analysis: Tran,
        settings: Settings,
        temperature: float | None,
        values: Mapping[str, float] | None,
    ) -> None:
        self.circuit, self.number, self.island = circuit, number, island
        self.analysis, self.settings = analysis, settings
        self.mna: MnaSystem = island.assemble(
            temperature, values or {}, tstep=analysis.row_distance, tstop=analysis.stop
        )
        system = self.mna.system
        self.step: float | None = None if system.static else analysis.solver_step(settings.step)
        averaging: dict[str, object] = {}
        if self.step is not None and settings.theta < 1.0:
            from ..circuit.theta import theta_terms

            averaging["H"], averaging["Hs"] = theta_terms(self.mna, settings.theta)
        self.width = len(names)
        self.charges: Floats | None = None
        self._planned = 0
        functionals = [self.mna.functional(name) for name in names]
        self.stepper = MoreauStepper(system, functionals, **averaging)  # type: ignore[arg-type]

    def start(self) -> None:
        """Find the first state and plan the instants."""
        analysis = self.analysis
        # the plan comes first: it tells the stepper whether switches act on a static circuit
        if self.step is None:
            self._plan_more()
        else:
            self.stepper.plan(0.0, analysis.stop, self.step, analysis.start, analysis.row_distance)
        try:
            self.charges = start(self.circuit, self.mna, self.stepper, analysis, self.step)
        except UnsolvedStep as problem:
            raise named_failure(self.circuit, self.mna, problem, starting=True) from problem

    def _plan_more(self) -> None:
        """Plan the next points of a static island: all at once could be more than memory holds."""
        first, self._planned = self._planned, self._planned + _POINTS
        self.stepper.plan_points(self.analysis.rows(first, self._planned))

    def impulses(self) -> list[Impulse]:
        """Return the jumps so far as impulses of elements."""
        if self.step is None:
            return []
        state = self.stepper.state
        return impulses_of(self.mna, self.stepper.jumps, self.step, state, self.charges)

    def advance(self, rows: int) -> Floats:
        """Return the next rows, fewer than asked for if that takes too long."""
        try:
            block, done = self.stepper.advance(rows, _BUDGET)
            if done and self.step is None and self._planned < self.analysis.row_count:
                self._plan_more()
            return block
        except UnsolvedStep as problem:
            raise _Stopped(self.stepper.pending, problem) from problem

    def report(self) -> IslandRun:
        """Return how the island was solved."""
        system = self.mna.system
        return IslandRun(
            self.number + 1,
            self.island.problem_class.name,
            self.island.reason,
            "point by point" if self.step is None else "moreau",
            system.n,
            system.m,
            None if self.step is None else self.settings.theta,
            self.step,
            dict(self.stepper.statistics),
        )


class _Stopped(Exception):
    """A step failed after some rows."""

    def __init__(self, rows: Floats, problem: UnsolvedStep) -> None:
        super().__init__()
        self.rows, self.problem = rows, problem


class _Outlet:
    """Turns recorded columns into signals and hands them on."""

    def __init__(self, recorder: Recorder, store: Store, sink: Sink | None, keep: bool) -> None:
        self.recorder, self.store, self.sink, self.keep = recorder, store, sink, keep
        self.rows = 0

    @property
    def table(self) -> Floats:
        """The rows kept."""
        return self.store.table

    def write(self, block: Floats) -> None:
        """Take complete rows: time, then the recorded columns."""
        if block.shape[0] == 0:
            return
        if not self.recorder.direct:
            block = np.column_stack([block[:, 0], self.recorder.signals(block[:, 1:])])
        if self.keep:
            self.store.write(block)
        else:
            self._keep_ends(block)
        self.rows += block.shape[0]
        if self.sink is not None:
            self.sink.write(block)

    def _keep_ends(self, block: Floats) -> None:
        """Keep the first row of all and the last one so far."""
        if self.rows == 0:
            self.store.write(block[:1])
            block = block[1:]
        if block.shape[0]:
            self.store.filled = 1
            self.store.write(block[-1:])


def _loop(
    runners: Sequence[_Runner],
    outlet: _Outlet,
    rows: int,
    analysis: Tran,
    progress: Progress | None,
) -> bool:
    """Advance all islands by blocks of rows; return True if Ctrl-C stopped it.

    A failed step or Ctrl-C ends it with the rows that all islands have.
    """
    width = 1 + outlet.recorder.recorded
    most = max(1, _CHUNK_NUMBERS // width)
    size = min(most, 256)
    while outlet.rows < rows:
        want = min(size, rows - outlet.rows)
        block = np.empty((want, width))
        got = [0] * len(runners)
        begin = clock.perf_counter()
        try:
            _fill(runners, block, got, analysis, progress)
        except KeyboardInterrupt:
            outlet.write(block[: min(got)])
            return True
        except _Stopped as stopped:
            k = next(j for j, g in enumerate(got) if g < want)
            _put(block, runners, k, got, stopped.rows)
            outlet.write(block[: got[k]])
            runner = runners[k]
            raise named_failure(runner.circuit, runner.mna, stopped.problem) from stopped.problem
        outlet.write(block)
        if progress is not None:
            progress(outlet.rows / rows)
        spent = clock.perf_counter() - begin
        if spent < _CHUNK_TIME / 2.0:
            size = min(most, 2 * size)
        elif spent > 2.0 * _CHUNK_TIME:
            size = max(1, size // 2)
    return False


def _fill(
    runners: Sequence[_Runner],
    block: Floats,
    got: list[int],
    analysis: Tran,
    progress: Progress | None,
) -> None:
    """Let every island compute its columns of a block; ``got`` counts its rows."""
    for k, runner in enumerate(runners):
        while got[k] < block.shape[0]:
            part = runner.advance(block.shape[0] - got[k])
            _put(block, runners, k, got, part)
            if progress is not None and part.shape[0] == 0:
                progress(runner.stepper.time / analysis.stop)


def _put(block: Floats, runners: Sequence[_Runner], k: int, got: list[int], part: Floats) -> None:
    """Write rows of island k into its columns."""
    first, last = got[k], got[k] + part.shape[0]
    left = 1 + sum(r.width for r in runners[:k])
    block[first:last, 0] = part[:, 0]
    block[first:last, left : left + part.shape[1] - 1] = part[:, 1:]
    got[k] = last
