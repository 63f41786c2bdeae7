"""DC solutions: the operating point, and sweeps of sources, resistors and temperature."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, NumericalError, Span, UsageError
from ...netlist.deck import DcCard, Deck, Sweep
from ..certificate.certificate import Certificate
from ..certificate.regularity import several_warning
from ..request.arguments import finite, name_of, several
from ..request.cards import Dc
from ..request.load import again, need_circuit
from ..request.notebook_progress import Progress
from ..request.path_following import Following
from ..request.recorder import Recorder
from ..request.request import Request
from ..request.row_sinks import Sink
from ..request.values import check_value, checked_values, valued
from ..signals.curve import Floats
from ..solution.default_signals import view_of
from ..solution.refusal import check_on_failure, judge
from ..solution.solution import Solution
from .dc_points import PointsOfIsland, report_of


def op(
    circuit: Circuit,
    *,
    signals: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
    sink: Sink | None = None,
    on_failure: str = "raise",
) -> Solution:
    """Find the DC solution: capacitors open, inductors short, sources at their DC value.

    Parameters
    ----------
    circuit : Circuit
    signals, extra : sequence of str, optional
        As for :func:`nsspice.tran`.
    temperature : float, optional
        [degrees Celsius]
    values : mapping of str to float, optional
        Values by element name that replace the deck's [Ohm, V or A].
    sink : Sink, optional
        Takes the row.
    on_failure : str
        What to do if the certificate fails: ``raise`` a CertificateError, ``warn`` (a
        CertificateWarning, also among the ``warnings`` of the solution), or ``ignore``.

    Returns
    -------
    Solution
        With one row and no axis.

    Raises
    ------
    InfeasibleError, StepError
        If there is no solution, or none was found.
    CertificateError
        NS3003 if the certificate fails, unless ``on_failure`` says otherwise; ``solution`` is the
        run.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''two resistors
    ... V1 a 0 10
    ... R1 a b 1k
    ... R2 b 0 3k
    ... ''')
    >>> float(nsspice.op(circuit)["v(b)"][0])
    7.5
    """
    need_circuit(circuit)
    check_on_failure(on_failure)
    request = Request(
        signals=signals,
        extra=extra,
        temperature=temperature,
        values=checked_values(circuit, values),
        sink=sink,
    )
    solution = run_op(circuit, request)
    judge([solution], on_failure)
    return solution


def run_op(circuit: Circuit, request: Request) -> Solution:
    """Find the DC solution; see :func:`op`."""
    return _solve(circuit, "op", (), request)


def dc(
    circuit: Circuit,
    source: str | None = None,
    values: Sequence[float] | Floats | None = None,
    *,
    signals: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    temperature: float | None = None,
    overrides: Mapping[str, float] | None = None,
    method: str | None = None,
    progress: Progress | None = None,
    sink: Sink | None = None,
    analysis: Dc | None = None,
    on_failure: str = "raise",
) -> Solution:
    """Find DC solutions over a sweep.

    Parameters
    ----------
    circuit : Circuit
    source : str, optional
        Voltage or current source, resistor, or ``temp``; without it the deck's first ``.dc`` card.
    values : sequence of float, optional
        Values of the source [V, A, Ohm or degrees Celsius].
    signals, extra : sequence of str, optional
        As for :func:`nsspice.tran`.
    temperature : float, optional
        [degrees Celsius]
    overrides : mapping of str to float, optional
        Values by element name that replace the deck's [Ohm, V or A].
    method : str, optional
        ``euler-newton`` or ``euler-newton-rate`` follow the path of solutions from point to point
        instead of solving at each one.
    progress : callable, optional
        Called with the fraction completed, 0 to 1.
    sink : Sink, optional
        Takes the rows.
    analysis : Dc, optional
        Nested sweeps, instead of ``source``.
    on_failure : str
        What to do if the certificate fails: ``raise`` a CertificateError, ``warn`` (a
        CertificateWarning, also among the ``warnings`` of the solution), or ``ignore``.

    Returns
    -------
    Solution
        Its axis is the first sweep; values of the others are signals.

    Raises
    ------
    InfeasibleError, StepError
        If there is no solution, or none was found.
    CertificateError
        NS3003 if the certificate fails, unless ``on_failure`` says otherwise; ``solution`` is the
        run.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''ideal clamp
    ... V1 a 0 0
    ... R1 a b 1k
    ... D1 b 0
    ... ''')
    >>> nsspice.dc(circuit, "v1", [-1.0, 1.0])["v(b)"].tolist()
    [-1.0, 0.0]
    """
    need_circuit(circuit)
    check_on_failure(on_failure)
    if analysis is None:
        analysis = _analysis(circuit, source, values)
    request = Request(
        method,
        signals=signals,
        extra=extra,
        temperature=temperature,
        values=checked_values(circuit, overrides),
        progress=progress,
        sink=sink,
    )
    solution = run_dc(circuit, analysis, request)
    judge([solution], on_failure)
    return solution


def run_dc(circuit: Circuit, analysis: Dc, request: Request) -> Solution:
    """Find DC solutions over a sweep; see :func:`dc`."""
    for sweep in analysis.sweeps:
        check_sweep(circuit, sweep)
    following = Following.of(circuit.deck, request.settings(circuit.deck).method)
    return _solve(circuit, "dc", analysis.sweeps, request, following)


def _analysis(circuit: Circuit, source: str | None, values: Sequence[float] | Floats | None) -> Dc:
    if source is None:
        for card in circuit.deck.analyses:
            if isinstance(card, DcCard):
                return Dc.from_card(card)
        raise UsageError(
            Diagnostic(
                "NS4006",
                f"{circuit.deck.file} has no .dc card",
                hint="pass a source and its values, or add .dc source start stop step",
            )
        )
    name = name_of(source, "a swept element", "v1, or temp").lower()
    given = several(values, f"the values of {name}", "[0.0, 1.0]")
    if not given:
        hint = "give at least one number"
        raise UsageError(Diagnostic("NS4005", f"the sweep of {name} has no values", hint=hint))
    if not all(map(finite, given)):
        message = f"the sweep of {name} holds {next(v for v in given if not finite(v))}"
        raise UsageError(Diagnostic("NS4005", message, hint="give finite numbers"))
    points = tuple(map(float, given))
    kind = "temp" if name in ("temp", "temper") else "element"
    return Dc((Sweep("temp" if kind == "temp" else name, kind, points, Span("", 0, 0)),))  # type: ignore[arg-type]


def check_sweep(circuit: Circuit, sweep: Sweep) -> None:
    """Raise UsageError unless the swept element exists and can have all of the values."""
    if sweep.kind != "element":
        return
    span = sweep.span if sweep.span.line else None
    device = valued(circuit, sweep.name, span)
    for value in sweep.values:
        check_value(device, value, span)


def _solve(
    circuit: Circuit,
    kind: str,
    sweeps: Sequence[Sweep],
    request: Request,
    following: Following | None = None,
) -> Solution:
    begin = clock.perf_counter()
    columns, names = request.names(circuit)
    progress, sink = request.progress, request.sink
    recorder = Recorder(circuit, names)
    grid = Dc(tuple(sweeps)).grid if sweeps else []
    count = grid[0].size if grid else 1
    swept = {s.name: axis for s, axis in zip(sweeps, grid, strict=False)}
    table = np.empty((count, recorder.recorded))
    totals, left, rows = [], 0, count
    failure: NumericalError | None = None
    interrupted = False
    for k, island in enumerate(circuit.islands):
        width = len(recorder.local[k])
        job = PointsOfIsland(circuit, island, recorder.local[k], swept, request, following)
        done = 0
        try:
            for block in job.blocks(count):
                table[done : done + block.shape[0], left : left + width] = block
                done += block.shape[0]
                if progress is not None:
                    progress((k + done / count) / len(circuit.islands))
        except KeyboardInterrupt:
            interrupted = True
        except NumericalError as error:
            failure = failure or error
        rows = min(rows, done)
        totals.append(job.totals)
        left += width
        if interrupted:
            rows = rows if k == len(circuit.islands) - 1 else 0
            break
    found = recorder.signals(table[:rows])
    axis = grid[0][:rows] if grid else np.zeros(rows)
    outer = [s.name for s in sweeps[1:]]
    solution = Solution(
        kind,
        circuit.deck.title,
        sweeps[0].name if sweeps else "",
        axis,
        {
            **{name: swept[name][:rows] for name in outer},
            **{name: found[:, j] for j, name in enumerate(names)},
        },
        outer + columns,
        islands=[report_of(k, circuit.islands[k], part) for k, part in enumerate(totals)],
        certificate=Certificate.total(c for part in totals for c in part.certificates),
        warnings=[several_warning(part.several) for part in totals if part.several is not None],
        interrupted=interrupted,
        wall_time=clock.perf_counter() - begin,
        view=None if request.signals or circuit.deck.saves else view_of(circuit, kind, columns),
    )
    if sink is not None and (rows or failure is None):
        heading, block = solution.table()
        sink.open(heading)
        sink.write(block)
        sink.close()
    if failure is not None:
        failure.partial = solution
        raise failure
    if not interrupted:
        same = replace(request, extra=(), progress=None, sink=None)
        solution.more = SolvedAgain(circuit.deck, kind, tuple(sweeps), same, following)
    return solution


@dataclass(frozen=True, slots=True)
class SolvedAgain:
    """Solves the points of a sweep once more, for other signals.

    It holds the deck, since a circuit holds the systems that were assembled of it.

    Parameters
    ----------
    deck : Deck
    kind : str
        ``op`` or ``dc``.
    sweeps : tuple of Sweep
    request : Request
    following : Following or None
    parameters : mapping of str to float
        Values by parameter name that replace those of the deck.
    """

    deck: Deck
    kind: str
    sweeps: tuple[Sweep, ...]
    request: Request
    following: Following | None
    parameters: Mapping[str, float] = field(default_factory=dict)

    def rows(self, names: Sequence[str]) -> Solution:
        """Return other signals at the same points."""
        circuit = again(self.deck, self.parameters)
        request = replace(self.request, signals=names)
        return _solve(circuit, self.kind, self.sweeps, request, self.following)
