"""Transient analysis: every island through time on its own, rows put side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from ...circuit import Circuit
from ...circuit.blocks import Blocks
from ...errors import Diagnostic, UsageError
from ...netlist.deck import Deck, TranCard
from ..request.cards import Tran
from ..request.load import again, need_circuit
from ..request.measured_signals import Watched
from ..request.notebook_progress import Progress
from ..request.request import Request, named_controllers
from ..request.restart_state import Beginning
from ..request.row_sinks import Sink
from ..request.settings import Settings
from ..request.values import checked_values
from ..solution.recording import Recording
from ..solution.refusal import check_on_failure, judge
from ..solution.solution import Solution
from .blocks import split
from .transient_run import TransientRun

if TYPE_CHECKING:
    from ..averages.integrals import Integrals
    from ..request.controller import Controller
    from .memory import Memory


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
    reltol: float | None = None,
    accuracy: str | None = None,
    signals: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
    progress: Progress | None = None,
    sink: Sink | None = None,
    keep: bool = True,
    all_points: bool = False,
    everything: bool = False,
    controllers: Sequence[Controller] = (),
    on_failure: str = "raise",
) -> Solution:
    """Simulate a circuit in time.

    Parameters
    ----------
    circuit : Circuit
        From :func:`nsspice.read`.
    stop : float, optional
        End [s]; without it everything comes from the deck's first ``.tran`` card.
    row_step : float, optional
        Spacing of the output rows [s]; a thousandth of the time shown by default.
    step : float, optional
        Solver step [s]; by default SPICE's largest step. With ``sdirk`` it is the longest step.
    start : float
        First output row [s].
    uic : bool, optional
        Start from the initial values of the elements instead of the DC solution.
    method : str, optional
        ``auto``, ``modewise`` (exact), ``sdirk`` (steps with error control) or ``moreau`` (fixed
        steps); ``euler-newton`` or ``euler-newton-rate`` for circuits without energy storage.
    theta : float, optional
        Weight of the new state: 1 implicit (default), 0.5 trapezoidal in the smooth part.
    reltol : float, optional
        Error of one step of ``sdirk``, relative to the range of each unknown so far; 1e-5 by
        default.
    accuracy : str, optional
        ``waveforms`` (default), or ``energy``: errors of ``sdirk`` are measured by the energy
        exchanged in a period of the sources, 1e-4 of it by default.  Means and powers are accurate,
        ringing of little energy is damped.
    signals : sequence of str, optional
        Signals to return; by default those of the deck's ``.save`` cards, or the default set.
    extra : sequence of str
        Signals to record that are not among ``columns``.
    temperature : float, optional
        [degrees Celsius]
    values : mapping of str to float, optional
        Values of R, L, C or sources by element name that replace the deck's [Ohm, H, F, V or A].
    progress : callable, optional
        Called with the fraction completed, 0 to 1.
    sink : Sink, optional
        Takes the rows while they are computed.
    keep : bool
        If False, only the sink gets the rows; the solution then has the first and last row.
    all_points : bool
        Rows at the solver's own points (with fixed steps instead of the grid), and on both sides
        of each jump: the time of a jump appears twice, before and after.
    everything : bool
        Also simulate parts on which none of the signals depends; otherwise ``skipped`` of the
        solution and its certificate name them.
    controllers : sequence of Controller
        Functions that are called at sampling instants and set sources.
    on_failure : str
        What to do if the certificate fails: ``raise`` a CertificateError, ``warn`` (a
        CertificateWarning, also among the ``warnings`` of the solution), or ``ignore``.

    Returns
    -------
    Solution
        With ``interrupted`` set if Ctrl-C stopped it; the rows up to there are complete.

    Raises
    ------
    NumericalError
        If a step has no solution; ``partial`` holds what was computed before.
    CertificateError
        NS3003 if the certificate fails, unless ``on_failure`` says otherwise; ``solution`` is the
        run.

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
    need_circuit(circuit)
    check_on_failure(on_failure)
    if stop is not None:
        analysis = Tran(stop, row_step, start, None, bool(uic))
        if row_step is not None and row_step > stop:
            raise UsageError(
                Diagnostic(
                    "NS4005",
                    f"the row spacing, {row_step:g} s, is longer than the run, {stop:g} s",
                    hint="stop is the first argument: tran(circuit, stop, row_step)",
                )
            )
    else:
        analysis = _from_deck(circuit, uic)
    request = Request(
        method,
        theta,
        step,
        signals=signals,
        extra=extra,
        keep=keep,
        all_points=all_points,
        reltol=reltol,
        everything=everything,
        accuracy=accuracy,
        temperature=temperature,
        values=checked_values(circuit, values),
        progress=progress,
        sink=sink,
        controllers=named_controllers(circuit, controllers),
    )
    settings, watched = request.settings(circuit.deck), Watched.of(circuit, analysis)
    solution = run_tran(circuit, analysis, settings, request, watched=watched)
    judge([solution], on_failure)
    return solution


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
    request: Request,
    *,
    watched: Watched | None = None,
    beginnings: Sequence[Beginning | None] | None = None,
    periodic_sources: bool = False,
    controllers: tuple[Controller, ...] | None = None,
    memory: Memory | None = None,
) -> Solution:
    """Run one transient analysis; see :func:`tran`.

    Signals that are ``watched`` are recorded between the rows.  ``beginnings`` are the states from
    which islands begin, where they are given; sources that repeat are continued into the past if
    they are ``periodic_sources``.  ``controllers`` are those of an orbit, with their ``memory``.
    """
    run = TransientRun(circuit, analysis, settings, request, watched, beginnings, periodic_sources)
    run.control(controllers, memory)
    run.leave_out()
    run.place_islands()
    run.open_rows()
    failure, interrupted = run.advance()
    solution = run.solution(interrupted)
    run.warn(solution)
    run.keep_signals(solution)
    if failure is None and not interrupted and run.schedule is None:
        # controllers have states of their own: their functions are not called again
        same = replace(run.request, extra=(), everything=False, progress=None, sink=None)
        again = Rerun(circuit.deck, run.analysis, settings, same, beginnings, periodic_sources)
        solution.again, solution.more = again, again if same.keep else None
    if failure is not None:
        failure.partial = solution
        raise failure
    return solution


@dataclass(frozen=True, slots=True)
class Rerun:
    """Runs an analysis once more, and records other signals.

    It holds the deck, since a circuit holds the systems that were assembled of it.

    Parameters
    ----------
    deck : Deck
    analysis : Tran
    settings : Settings
    request : Request
    beginnings, periodic_sources
        As for ``run_tran``.
    parameters : mapping of str to float
        Values by parameter name that replace those of the deck.
    """

    deck: Deck
    analysis: Tran
    settings: Settings
    request: Request
    beginnings: Sequence[Beginning | None] | None
    periodic_sources: bool
    parameters: Mapping[str, float] = field(default_factory=dict)

    def __call__(self, names: Sequence[str], start: float, stop: float) -> Recording:
        """Record signals between two instants [s]."""
        circuit = again(self.deck, self.parameters)
        watched = Watched.signals(circuit, names, start, stop)
        request = replace(self.request, signals=names, keep=False, all_points=False)
        solution = self._run(circuit, request, watched)
        assert solution.recording is not None
        return solution.recording

    def circuit(self) -> Circuit:
        """Return the circuit that was run."""
        return again(self.deck, self.parameters)

    def integrals(self) -> Integrals:
        """Return integrals of the signals in closed form."""
        from ..averages.integrable_run import integrals_of

        circuit = again(self.deck, self.parameters)
        blocks = Blocks(circuit)
        if self.beginnings is None:
            blocks = split(circuit, self.settings, self.analysis, self.request)
        return integrals_of(blocks, self.analysis, self.request, self.beginnings)

    def rows(self, names: Sequence[str]) -> Solution:
        """Return other signals at the same output points."""
        circuit = again(self.deck, self.parameters)
        return self._run(circuit, replace(self.request, signals=names, keep=True))

    def _run(self, circuit: Circuit, request: Request, watched: Watched | None = None) -> Solution:
        return run_tran(
            circuit,
            self.analysis,
            self.settings,
            request,
            watched=watched,
            beginnings=self.beginnings,
            periodic_sources=self.periodic_sources,
        )
