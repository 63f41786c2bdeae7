"""``nsspice.sweep``: a deck at many points, measured, in one table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..analyses.request.controller import Controller
from ..analyses.request.load import read
from ..analyses.request.notebook_progress import Progress, shown_in_notebook
from ..analyses.request.request import named_controllers
from ..analyses.request.targets import nominal, target_of
from ..analyses.signals.signal_names import unit
from ..circuit import Circuit
from ..errors import Diagnostic, UsageError
from ..netlist.deck import Measure, kind_of
from .executors import Chunk, chunks_of, run_chunks
from .journal import Journal
from .plan import Options, Plan, measure_cards
from .points import How, Points, combined, grid, paired
from .table import SweepTable
from .worker import Outcome

if TYPE_CHECKING:
    from concurrent.futures import Executor

#: code of a point whose process has died more than once
_LOST = "NS3090"
#: operations whose result has the unit of what is measured
_SAME_UNIT = frozenset(("avg", "rms", "max", "min", "pp", "find_when", "find_at"))
_TIMES = frozenset(("when", "trig_targ", "max_at", "min_at"))


def sweep(
    circuit: Circuit | str | Path,
    over: Points | Mapping[str, Any] | Any = None,
    *,
    measures: Mapping[str, str] | None = None,
    samples: int | None = None,
    how: How = "latin",
    seed: int = 0,
    params: Mapping[str, float] | None = None,
    power: bool = False,
    loads: Sequence[str] = (),
    method: str | None = None,
    theta: float | None = None,
    step: float | None = None,
    reltol: float | None = None,
    accuracy: str | None = None,
    controllers: Sequence[Controller] = (),
    workers: int | None = None,
    executor: Executor | str | Any | None = None,
    journal: str | Path | None = None,
    resume: bool = False,
    progress: Progress | None = None,
) -> SweepTable:
    """Run all analyses of a deck at many points, and measure.

    Results are in the order of the points, and the same to the last bit for any number of workers
    and any executor.

    Parameters
    ----------
    circuit : Circuit, str or Path
        A circuit that was read, or what :func:`nsspice.read` reads.
    over : mapping, Points or DataFrame, optional
        What is swept: names with lists of values (all combinations) or distributions
        (``Uniform``, ``LogUniform``, ``Normal``, ``Tolerance``; needs ``samples``).  A name is a
        ``.param``, an element with a number as its value, ``temp`` [degrees Celsius] or a model's
        parameter, ``mymodel(ron)``.  A DataFrame is a list of points.  Left out: the ``.step``
        cards of the deck.
    measures : mapping of str to str, optional
        Measures besides the deck's ``.measure`` cards: ``{"ripple": "PP v(out) FROM=1m"}``.
    samples : int, optional
        Number of samples of the distributions.
    how : str
        ``latin``, ``sobol`` or ``random`` samples.
    seed : int
        The same seed gives the same samples.
    params : mapping of str to float, optional
        Values of ``.param`` cards that are not swept, of a deck that is read.
    power : bool
        Average powers ``p(x)`` of all elements of ``.tran`` and ``.pss``.
    loads : sequence of str
        Elements whose power is useful: ``efficiency`` and ``losses`` are measured.
    method, theta, step, reltol, accuracy
        As for :func:`nsspice.tran`.
    controllers : sequence of Controller
        As for :func:`nsspice.tran`; each run begins with copies of them.  Other processes get them
        by pickle: a function of a module, or an object of a class.
    workers : int, optional
        Processes; by default all cores, if the sweep is long enough to benefit.
    executor : Executor, Client or str, optional
        Any ``concurrent.futures.Executor``, a ``dask.distributed.Client``, or
        ``"dask:tcp://host:8786"``.
    journal : str or Path, optional
        File in which finished points are noted.
    resume : bool
        Continue with the points that the journal does not have.
    progress : callable, optional
        Called with the fraction completed.

    Returns
    -------
    SweepTable
        A point without a solution, or whose certificate fails, stays in it with its code. After
        Ctrl-C it has the points completed so far.

    Raises
    ------
    UsageError
        NS4005 for an impossible name or value, NS4006 without an analysis, NS4018 for the journal
        of a different sweep.

    Examples
    --------
    >>> import nsspice
    >>> deck = '''low-pass
    ... .param r=1k
    ... V1 a 0 SIN(0 1 1k) AC 1
    ... R1 a b {r}
    ... C1 b 0 100n
    ... .ac list 1k
    ... .measure ac gain find v(b) at=1k
    ... '''
    >>> table = nsspice.sweep(deck, {"r": [1e3, 2e3], "c1": [100e-9, 200e-9]})
    >>> table["gain"].round(4).tolist()
    [0.8467, 0.6227, 0.6227, 0.3697]
    """
    if isinstance(circuit, str | Path):
        circuit = read(circuit, params)
    elif params:
        raise TypeError("params= belongs to a deck that is read: nsspice.sweep(path, ...)")
    points = _points(circuit, over, samples, how, seed)
    targets = [target_of(circuit, name) for name in points.names]
    if not circuit.deck.analyses:
        message = f"{circuit.deck.file} asks for no analysis"
        raise UsageError(Diagnostic("NS4006", message, hint="add .tran, .pss, .op, .dc or .ac"))
    options = Options(
        method,
        theta,
        step,
        reltol,
        accuracy,
        power or bool(loads),
        tuple(name.lower() for name in loads),
        named_controllers(circuit, controllers),
    )
    if workers is not None and workers < 1:
        message = f"{workers} workers cannot run anything"
        raise UsageError(Diagnostic("NS4005", message, hint="give a positive number"))
    plan = Plan.of(circuit.deck, targets, measure_cards(circuit.deck, measures or {}), options)
    # what is wrong with added measures is an error here, not one of each point
    home = Path(plan.root) / plan.folder
    measured = plan.deck(plan.outline(home), {}).measures if measures else circuit.deck.measures
    outcomes: list[Outcome | None] = [None] * len(points)
    notes = None if journal is None else Journal(Path(journal), plan, points, resume)
    if notes is not None:
        for k, outcome in notes.known.items():
            outcomes[k] = outcome
    continued = any(kind_of(card) == "pss" for card in circuit.deck.analyses)
    todo = [c for c in chunks_of(points.values, continued) if not _finished(c, outcomes)]
    units = {t.name: t.unit for t in targets if t.unit}
    units |= _units(measured)
    interrupted = False
    with shown_in_notebook(circuit.deck.title, progress) as watcher:
        try:
            for chunk, found in run_chunks(plan, todo, workers, executor):
                some = _lost(chunk, found) if isinstance(found, str) else found
                outcomes[chunk.first : chunk.first + len(some)] = some
                if notes is not None:
                    notes.note(chunk, some)
                if watcher is not None:
                    watcher(sum(o is not None for o in outcomes) / len(outcomes))
        except KeyboardInterrupt:
            interrupted = True
        finally:
            if notes is not None:
                notes.close()
    return SweepTable(circuit.deck.title, points, outcomes, units, interrupted)


def _points(circuit: Circuit, over: Any, count: int | None, how: How, seed: int) -> Points:
    """Return the points that a caller means."""
    if over is None:
        steps = circuit.deck.steps
        if not steps:
            message = "nothing is swept: the deck has no .step card"
            hint = 'name what is swept: {"rload": [1, 2, 5]}, or --over rload=1,2,5'
            raise UsageError(Diagnostic("NS4005", message, hint=hint))
        # the first card of a deck runs fastest
        return grid({s.name: s.values for s in reversed(steps)})
    if isinstance(over, Points):
        return over
    if isinstance(over, Mapping):

        def own(name: str) -> float:
            return nominal(circuit, target_of(circuit, name))

        return combined(over, count, how, seed, own)
    if hasattr(over, "columns"):
        return paired(over)
    message = f"a sweep cannot be over {over!r}"
    hint = 'give {"rload": [1, 2, 5]}, a DataFrame, or nsspice.sweeps.Points'
    raise UsageError(Diagnostic("NS4005", message, hint=hint))


def _finished(chunk: Chunk, outcomes: Sequence[Outcome | None]) -> bool:
    """Return whether all points of a chunk are known; a chunk is run as a whole or not at all."""
    return None not in outcomes[chunk.first : chunk.first + chunk.rows.shape[0]]


def _lost(chunk: Chunk, why: str) -> list[Outcome]:
    """Return the outcomes of a chunk that nobody could run to its end."""
    return [Outcome({}, _LOST, why, 0.0)] * int(chunk.rows.shape[0])


def _units(measures: Sequence[Measure]) -> dict[str, str]:
    """Return the units of measures, as far as one signal gives them."""
    found = {}
    for card in measures:
        if card.operation in _TIMES and card.analysis == "tran":
            found[card.name] = "s"
        elif card.operation in (*_SAME_UNIT, "integ") and card.expression is not None:
            own = unit(card.expression.text.lower().replace(" ", ""))
            if own and card.operation == "integ":
                own = f"{own} s"
            if own:
                found[card.name] = own
    return found
