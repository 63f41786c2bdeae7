"""Measures of a deck and their derivatives by parameters: one run, and one pass backwards each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, UsageError, suggest
from ...lazy import need_library
from ...netlist.deck import Analysis, LoopCard, Sweep
from ..gradients.differentiated import differentiated
from ..gradients.refusals import undone
from ..gradients.responses import MARGINS, Responses, of_margins, of_measures
from ..gradients.variation import Decks, Parameter
from ..request.load import need_circuit
from ..request.request import Neighbour, Request
from ..signals.curve import Floats
from ..solution.solution import Solution
from .batch import jobs_of, run_job

#: what is differentiated
KINDS = ("tran", "pss", "ac", "loop")


@dataclass(frozen=True, slots=True)
class Gradient:
    """Measures and their derivatives.

    Parameters
    ----------
    measures : dict of str to float
    parameters : dict of str to float
        Values by which they are differentiated.
    derivatives : dict of str to dict of str to float
        By measure, then by parameter.
    """

    measures: dict[str, float]
    parameters: dict[str, float]
    derivatives: dict[str, dict[str, float]]

    def matrix(self) -> Floats:
        """Return the derivatives, shape (measures, parameters)."""
        return np.array([list(row.values()) for row in self.derivatives.values()])

    def to_pandas(self) -> Any:
        """Return a table with a row for each measure."""
        return need_library("pandas").DataFrame(self.derivatives).T


def gradient(
    circuit: Circuit, measures: Sequence[str] | None = None, parameters: Sequence[str] | None = None
) -> Gradient:
    """Differentiate measures of transients and periodic steady states by parameters.

    One run and one pass backwards for each measure, for any number of parameters: through events,
    jumps, and the dependence of a steady state on itself.

    Parameters
    ----------
    circuit : Circuit
        With ``.tran`` or ``.pss`` and ``.measure`` cards.
    measures : sequence of str, optional
        Names of measures; all by default.
    parameters : sequence of str, optional
        ``.param`` names, elements, ``temp``, model parameters as ``dmod(ron)``; all parameters of
        the deck by default.

    Returns
    -------
    Gradient

    Raises
    ------
    UsageError
        NS4005 for a measure that the deck does not have; NS4041, NS4042 where there is no
        derivative, or none is known.
    NumericalError
        NS3068 at an event that has none, with its instant.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''RC
    ... V1 a 0 1
    ... R1 a b 1k
    ... C1 b 0 1u IC=0
    ... .tran 10u 1m uic
    ... .measure tran end find v(b) at=1m
    ... ''')
    >>> found = gradient(circuit, ["end"], ["r1"])
    >>> abs(found.derivatives["end"]["r1"] + 1e-3 * 2.718281828459045**-1) < 1e-15
    True
    """
    need_circuit(circuit)
    known = [m.name for m in circuit.deck.measures]
    wanted = known if measures is None else [name.lower() for name in measures]
    asked = list(circuit.deck.parameters) if parameters is None else list(parameters)
    return evaluated(circuit, wanted, asked, {})


def evaluated(
    circuit: Circuit,
    measures: Sequence[str],
    parameters: Sequence[str],
    values: Mapping[str, float],
    neighbour: Neighbour | None = None,
) -> Gradient:
    """Return measures and their derivatives with other values of some elements.

    Steady states are looked for near those of the ``neighbour``, and become it.
    """
    deck = circuit.deck
    known = {m.name: m.analysis for m in deck.measures}
    if any(isinstance(card, LoopCard) for card in deck.analyses):
        known = {**dict.fromkeys(MARGINS, "loop"), **known}
    for name in measures:
        if name not in known:
            hint = suggest(name, known) or f"it has {', '.join(known) or 'none'}"
            raise UsageError(Diagnostic("NS4005", f"the deck has no measure {name}", hint=hint))
        if known[name] not in KINDS:
            raise undone(f"measures of .{known[name]} are not differentiated", name)
    if deck.steps:
        raise undone("a deck with .step cards is not differentiated", ".step")
    if deck.sampled:
        raise undone("a deck with functions of z is not differentiated", deck.sampled[0].source)
    if deck.delays:
        raise undone("a deck with delays is not differentiated", deck.delays[0].element)
    by = [Parameter.of(circuit, name) for name in parameters]
    by = [
        replace(p, value=values[p.target.name], given=True) if p.target.name in values else p
        for p in by
    ]
    decks = Decks(circuit)
    table: dict[str, dict[str, float]] = {}
    results: dict[str, float] = {}
    for job in jobs_of(deck):
        mine = [name for name in measures if known[name] == job.kind]
        if not mine:
            continue
        steps = tuple((Sweep(n, "element", (v,), job.card.span), v) for n, v in values.items())
        wanted = Request(record=True, neighbour=neighbour or Neighbour())
        solution = run_job(circuit, replace(job, steps=steps), wanted)
        margins = {} if solution.loop is None else solution.loop.margins()
        measured = {**margins, **solution.measures}
        if any(math.isnan(measured[name]) for name in mine):
            raise undone("it has no result", next(n for n in mine if math.isnan(measured[n])))
        found = derivatives_of(circuit, solution, job.card, values, mine, by, decks)
        for name, row in zip(mine, found.tolist(), strict=True):
            results[name] = measured[name]
            table[name] = {p.target.name: d for p, d in zip(by, row, strict=True)}
    return Gradient(
        {name: results[name] for name in measures},
        {p.target.name: p.value for p in by},
        {name: table[name] for name in measures},
    )


def derivatives_of(
    circuit: Circuit,
    solution: Solution,
    card: Analysis,
    values: Mapping[str, float],
    measures: Sequence[str],
    by: Sequence[Parameter],
    decks: Decks,
) -> Floats:
    """Return the derivatives of a solution's measures, shape (measures, parameters).

    Raises
    ------
    UsageError, NumericalError
        Where there is none, or none is known.
    """
    if solution.analysis not in ("ac", "loop"):
        source = differentiated(circuit, solution, card, values)
        return source.derivatives(measures, by, decks)
    about = Responses(circuit, Request(values=values), by, decks)
    if isinstance(card, LoopCard):
        return of_margins(about, solution, card, measures)
    return of_measures(about, solution, measures)
