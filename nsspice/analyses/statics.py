"""DC solutions: the operating point, and sweeps of sources, resistors and temperature."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..circuit import Circuit, Island, MnaSystem
from ..errors import Diagnostic, NumericalError, Span, UsageError
from ..netlist.deck import DcCard, Sweep
from ..problems.csc import Csc
from ..problems.descriptor import DescriptorSystem, Waveform
from ..solvers.moreau import MoreauStepper, UnsolvedStep
from .cards import Dc
from .certificate import Certificate
from .curve import Floats
from .failure import named_failure
from .initial import guess_of
from .recorder import Recorder, select
from .sink import Sink
from .solution import IslandRun, Solution
from .transient import Progress

#: A source value that no deck holds, so that the swept source gets a column of its own.
_MARK = 1.234567890123e-101
_BUDGET = 0.05  # [s] longest stretch inside the core
_ROWS = 4096


def op(
    circuit: Circuit,
    *,
    signals: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
    sink: Sink | None = None,
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
        Values by element name that replace the deck's.
    sink : Sink, optional
        Takes the row.

    Returns
    -------
    Solution
        With one row and no axis.

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
    return _solve(circuit, "op", (), signals, extra, temperature, values or {}, None, sink)


def dc(
    circuit: Circuit,
    source: str | None = None,
    values: Sequence[float] | Floats | None = None,
    *,
    signals: Sequence[str] | None = None,
    extra: Sequence[str] = (),
    temperature: float | None = None,
    overrides: Mapping[str, float] | None = None,
    progress: Progress | None = None,
    sink: Sink | None = None,
    analysis: Dc | None = None,
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
        Values by element name that replace the deck's.
    progress : callable, optional
        Called with the finished share, 0 to 1.
    sink : Sink, optional
        Takes the rows.
    analysis : Dc, optional
        Nested sweeps, instead of ``source``.

    Returns
    -------
    Solution
        Its axis is the first sweep; values of the others are signals of their own.

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
    if analysis is None:
        analysis = _analysis(circuit, source, values)
    for sweep in analysis.sweeps:
        check_sweep(circuit, sweep)
    return _solve(
        circuit, "dc", analysis.sweeps, signals, extra, temperature, overrides or {}, progress, sink
    )


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
    name = source.strip().lower()
    points = tuple(float(v) for v in (() if values is None else values))
    if not points:
        raise UsageError(Diagnostic("NS4005", f"the sweep of {name} has no values"))
    kind = "temp" if name in ("temp", "temper") else "element"
    return Dc((Sweep("temp" if kind == "temp" else name, kind, points, Span("", 0, 0)),))  # type: ignore[arg-type]


def check_sweep(circuit: Circuit, sweep: Sweep) -> None:
    """Raise UsageError NS4007 unless the swept element exists and has a value to sweep."""
    if sweep.kind != "element":
        return
    span = sweep.span if sweep.span.line else None
    device = circuit.device(sweep.name)
    if device.letter not in "virlc":
        raise UsageError(
            Diagnostic(
                "NS4007",
                f"{sweep.name} cannot be swept",
                span,
                "sweep a voltage or current source, a resistor, or temp",
            )
        )


@dataclass(slots=True)
class _Totals:
    """What the solvers of one island counted, over all points."""

    statistics: list[dict[str, float]]
    unknowns: int = 0
    pairs: int = 0


def _solve(
    circuit: Circuit,
    kind: str,
    sweeps: Sequence[Sweep],
    signals: Sequence[str] | None,
    extra: Sequence[str],
    temperature: float | None,
    values: Mapping[str, float],
    progress: Progress | None,
    sink: Sink | None,
) -> Solution:
    begin = clock.perf_counter()
    columns = select(circuit, signals)
    names = columns + [n for n in select(circuit, extra) if n not in columns] if extra else columns
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
        job = _Job(circuit, island, recorder.local[k], swept, temperature, values)
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
        islands=[_report(k, circuit.islands[k], part) for k, part in enumerate(totals)],
        certificate=Certificate.of(s for part in totals for s in part.statistics),
        interrupted=interrupted,
        wall_time=clock.perf_counter() - begin,
    )
    if sink is not None and (rows or failure is None):
        heading, block = solution.table()
        sink.open(heading)
        sink.write(block)
        sink.close()
    if failure is not None:
        failure.partial = solution
        raise failure
    return solution


class _Job:
    """The DC points of one island."""

    def __init__(
        self,
        circuit: Circuit,
        island: Island,
        names: Sequence[str],
        swept: Mapping[str, Floats],
        temperature: float | None,
        values: Mapping[str, float],
    ) -> None:
        self.circuit, self.island, self.names = circuit, island, list(names)
        mine = {device.name: device.letter for device in island.devices}
        self.sources = {n: v for n, v in swept.items() if mine.get(n, "") in ("v", "i")}
        self.others = {
            n: v for n, v in swept.items() if n == "temp" or mine.get(n, "") in tuple("rlc")
        }
        self.temperature, self.values = temperature, dict(values)
        self.totals = _Totals([])

    def blocks(self, count: int) -> Iterator[Floats]:
        """Yield the recorded columns of all points, some rows at a time.

        Stretches in which only sources change are one run of the solver, which stays close to the
        previous point where a solution is not unique; the matrices change between stretches.
        """
        cuts = [0, count]
        if self.others:
            changed = np.zeros(count, dtype=bool)
            for axis in self.others.values():
                changed[1:] |= np.diff(axis) != 0.0
            cuts = [0, *np.flatnonzero(changed).tolist(), count]
        near: tuple[Floats, Floats] | None = None
        for first, last in pairwise(cuts):
            mna, system = self._system(first, last)
            stepper = MoreauStepper(system, [mna.functional(name) for name in self.names])
            self.totals.unknowns, self.totals.pairs = system.n, system.m
            try:
                stepper.start_dc(0.0, near or guess_of(self.circuit, mna))
                stepper.plan_points(np.arange(float(last - first)))
                done = 0
                while done < last - first:
                    rows, _ = stepper.advance(min(_ROWS, last - first - done), _BUDGET)
                    done += rows.shape[0]
                    yield rows[:, 1:]
            except UnsolvedStep as problem:
                raise self._failure(mna, problem, first) from problem
            finally:
                self.totals.statistics.append(dict(stepper.statistics))
            near = stepper.state

    def _system(self, first: int, last: int) -> tuple[MnaSystem, DescriptorSystem]:
        """Return the static system in which time counts the points of a stretch."""
        values = dict(self.values)
        temperature = self.temperature
        for name, axis in self.others.items():
            if name == "temp":
                temperature = float(axis[first])
            else:
                values[name] = float(axis[first])
        marks = {name: _MARK * (1.0 + k) for k, name in enumerate(self.sources)}
        mna = self.island.assemble(temperature, {**values, **marks}, analysis="dc")
        waveforms = list(mna.system.waveforms)
        times = np.arange(float(last - first))
        for name, axis in self.sources.items():
            column = mna.layout.columns[name]
            points = np.column_stack([times, axis[first:last]]).ravel()
            waveforms[column] = Waveform(
                "pwl", tuple(points.tolist()), scale=waveforms[column].scale
            )
        n = mna.system.n
        return mna, replace(mna.system, E=Csc.zeros((n, n)), waveforms=tuple(waveforms))

    def _failure(self, mna: MnaSystem, problem: UnsolvedStep, first: int) -> NumericalError:
        """Return the error, with the swept values in place of the count of points."""
        index = first + round(problem.time)
        swept = {**self.sources, **self.others}
        where = ", ".join(f"{name} = {axis[index]:.6g}" for name, axis in swept.items())
        return named_failure(self.circuit, mna, problem, where=where)


def _report(number: int, island: Island, totals: _Totals) -> IslandRun:
    stats: dict[str, float] = {}
    for part in totals.statistics:
        for key, value in part.items():
            if key.startswith("residual") or key in ("modes", "worst_stage"):
                stats[key] = max(stats.get(key, 0), value)
            else:
                stats[key] = stats.get(key, 0) + value
    return IslandRun(
        number + 1,
        island.problem_class.name,
        island.reason,
        "point by point",
        totals.unknowns,
        totals.pairs,
        stats=stats,
    )
