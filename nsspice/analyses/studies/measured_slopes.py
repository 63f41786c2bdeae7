"""Derivatives of measures: what ``.sens`` cards with the names of ``.measure`` cards ask for.

They come from one pass backwards through the run; where it knows none they are extrapolated
differences.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ...circuit import Circuit
from ...errors import Diagnostic, NsspiceError, UsageError
from ...netlist.deck import SensCard, Sweep
from ..gradients.variation import Decks, Parameter
from ..request.load import read_again
from ..request.request import Request
from ..request.values import valued
from ..results.sensitivity import Sensitivity, ranked
from ..solution.solution import Solution
from .batch import Job, run_job
from .gradient import KINDS, derivatives_of
from .slopes import slopes


def add_slopes(circuit: Circuit, solution: Solution, job: Job, request: Request) -> None:
    """Compute how measures of a run depend on what ``.sens`` cards name; else a warning."""
    for card in circuit.deck.sensitivities:
        if not card.signals:
            _add(circuit, solution, card, job, request)


def _add(
    circuit: Circuit,
    solution: Solution,
    card: SensCard,
    job: Job,
    request: Request,
) -> None:
    """Compute how measures of a run depend on what a ``.sens`` card names; else a warning."""
    deck = circuit.deck
    place = deck.analyses.index(job.card)
    own = {s.name: v for s, v in job.steps if s.kind == "param"}
    kept = tuple((s, v) for s, v in job.steps if s.kind != "param")
    plain = replace(
        request, signals=None, extra=(), keep=True, power=False, follow=(), progress=None, sink=None
    )

    def without_cards(parameters: Mapping[str, float]) -> Circuit:
        other = read_again(deck, parameters)
        other.deck.sensitivities.clear()
        return other

    unchanged: list[Circuit] = []

    def measured(name: str, value: float) -> Mapping[str, float]:
        if name in deck.parameters:
            other, steps = without_cards({**own, name: value}), kept
        else:
            if not unchanged:
                unchanged.append(without_cards(own))
            (other,) = unchanged
            sweep = Sweep(name, "element", (value,), card.span)
            steps = (*(s for s in kept if s[0].name != name), (sweep, value))
        return run_job(other, Job(other.deck.analyses[place], "", steps), plain).measures

    wanted = [name for name in card.names if name in solution.measures]
    others = [n for n in card.names if n not in {m.name for m in deck.measures}]
    if not wanted:
        return  # measures of another analysis
    found: list[Sensitivity] = []
    try:
        values: dict[str, float] = {}
        for name in [*others, *card.elements] or list(deck.parameters):
            value = _value_of(circuit, name, job)
            if value != 0.0:
                values[name] = value
            elif others or card.elements:
                hint = "differences are relative to the value: write it as {x - 1} with x=1"
                raise UsageError(Diagnostic("NS4005", f"{name} is 0", hint=hint))
        exact = _exact(circuit, solution, job, wanted, list(values))
        for name, value in values.items():
            nominal = {m: solution.measures[m] for m in wanted}
            for key in wanted:
                if (key, name) in exact:
                    slope = exact[key, name]
                    found.append(Sensitivity(key, name, value, nominal.pop(key), slope))
            if nominal:
                found += slopes(measured, nominal, name, value)
    except NsspiceError as problem:
        said = problem.diagnostics[0]
        message = f".sens is omitted: {said.message}"
        solution.warnings.append(replace(said, message=message, span=card.span, severity="warning"))
        return
    solution.sensitivities += ranked(found, wanted)


def _exact(
    circuit: Circuit, solution: Solution, job: Job, measures: Sequence[str], names: Sequence[str]
) -> dict[tuple[str, str], float]:
    """Return the derivatives of those measures of a run that have exact ones, by those names."""
    if job.kind not in KINDS or job.steps:
        return {}
    try:
        by = [Parameter.of(circuit, name) for name in names]
        table = derivatives_of(circuit, solution, job.card, {}, measures, by, Decks(circuit))
    except NsspiceError:
        # the differences say what can be said; what spoils one may leave the others
        if len(measures) * len(names) == 1:
            return {}
        if len(measures) > 1:
            parts = [([m], list(names)) for m in measures]
        else:
            parts = [(list(measures), [n]) for n in names]
        return {k: d for part in parts for k, d in _exact(circuit, solution, job, *part).items()}
    return {
        (measure, name): float(d)
        for measure, row in zip(measures, table, strict=True)
        for name, d in zip(names, row, strict=True)
    }


def _value_of(circuit: Circuit, name: str, job: Job) -> float:
    """Return the value of a parameter or element by which measures are differentiated.

    Raises
    ------
    UsageError
        NS4005 if there is none, or it is zero.
    """
    deck = circuit.deck
    if name in job.values:
        return job.values[name]
    if name in deck.parameters:
        return deck.parameters[name]
    if name not in circuit.element_island:
        message = f"there is no measure and no parameter {name}"
        raise UsageError(Diagnostic("NS4005", message, hint="define it with .param or .measure"))
    device = valued(circuit, name)
    source = getattr(device, "source", None)
    if source is not None:
        if source.kind:
            message = f"{name} is not a constant"
            hint = "define its values as parameters, and name those"
            raise UsageError(Diagnostic("NS4005", message, hint=hint))
        return float(source.dc or 0.0)
    return float(device.value)  # type: ignore[attr-defined]
