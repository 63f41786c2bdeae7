"""Measures of a periodic steady state over one box of parameters, as Taylor models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...circuit import Circuit
from ...netlist.deck import Measure, Sweep
from ...problems.csc import Floats
from ...problems.taylor import Models, Unbounded, space
from ..gradients.carried import Carried, Lost
from ..gradients.variation import Parameter
from ..request.load import read_again
from ..request.request import Request
from ..request.targets import with_model_values
from ..solution.solution import Solution
from ..studies.batch import Job, run_job
from .arrays import traced
from .extremes import Extremes
from .nominal import Nominal, nominal_of
from .orbit import NotProved, Orbit

#: what is enclosed
OPERATIONS = ("avg", "pp", "max", "min")


def signal_of(card: Measure) -> str:
    """Return the signal of a measure.

    Raises
    ------
    Lost
        If it is not an average, a ripple or a peak of one signal over the period.
    """
    tree = None if card.expression is None else card.expression.node
    whole = card.start is None and card.stop is None and not card.conditions
    if card.operation not in OPERATIONS or tree is None or tree.op != "var" or not whole:
        raise Lost(
            f"{card.name} is not an AVG, PP, MAX or MIN of one voltage or current over a period"
        )
    return str(tree.value)


class Box:
    """A part of the tolerances, with the orbit in its middle.

    Parameters
    ----------
    circuit : Circuit
    job : Job
        Its ``.pss``.
    parameters : sequence of Parameter
    ends : ndarray, shape (n, 2)
        Of each.
    """

    def __init__(
        self, circuit: Circuit, job: Job, parameters: Sequence[Parameter], ends: Floats
    ) -> None:
        self.ends = ends
        self.middle: Floats = ends.mean(axis=1)
        by_kind: dict[str, dict[str, float]] = {"param": {}, "element": {}}
        models: dict[tuple[str, str], float] = {}
        for parameter, value in zip(parameters, self.middle.tolist(), strict=True):
            target = parameter.target
            if target.kind == "model":
                models[target.model, target.key] = value
            else:
                by_kind[target.kind][target.name] = value
        other = read_again(circuit.deck, by_kind["param"])
        if models:
            from ...circuit.build import build

            other = build(with_model_values(other.deck, models))
        card = other.deck.analyses[circuit.deck.analyses.index(job.card)]
        steps = tuple(
            (Sweep(name, "element", (value,), job.card.span), value)
            for name, value in by_kind["element"].items()
        )
        self.circuit = other
        self.parameters = [
            replace(p, value=v) for p, v in zip(parameters, self.middle.tolist(), strict=True)
        ]
        self.solution: Solution = run_job(
            other, replace(job, card=card, steps=steps), Request(keep=True)
        )
        self._nominal: dict[int, Nominal] = {}

    def measures(self, cards: Sequence[Measure], degree: int) -> dict[str, Models]:
        """Return measures as Taylor models of a degree, in parameters from -1 to 1.

        Raises
        ------
        Lost, Unbounded, NotProved
            If they cannot be enclosed.
        """
        home = space(len(self.parameters), degree)
        radius = (self.ends[:, 1] - self.ends[:, 0]) / 2.0
        given: dict[Parameter, Carried] = {}
        for k, parameter in enumerate(self.parameters):
            # the ends of the box lie inside by the rounding of middle and radius
            wide = float(radius[k]) * (1.0 + 2.0**-50) + 2.0**-52 * abs(parameter.value)
            wide = wide if radius[k] else 0.0
            given[parameter] = Carried(Models.variable(home, parameter.value, wide, k))
        parts = {card.name: self.circuit.parts(signal_of(card)) for card in cards}
        found: dict[str, Models] = {}
        islands = sorted({i for terms in parts.values() for i, _, _ in terms})
        for island in islands:
            mine = [c for c in cards if [i for i, _, _ in parts[c.name]] == [island]]
            names = [parts[c.name][0][1] for c in mine]
            if island not in self._nominal:
                self._nominal[island] = nominal_of(self.solution, island)
            nominal = self._nominal[island]
            arrays = traced(self.circuit, nominal.course.mna, island, given, names, home)
            orbit = Orbit(arrays, nominal)
            orbit.prove_order()
            for k, card in enumerate(mine):
                factor = parts[card.name][0][2]
                found[card.name] = _measured(orbit, k, card.operation, factor)
        if len(found) < len(cards):
            raise Lost("a signal between two islands")
        return found


def _measured(orbit: Orbit, output: int, operation: str, factor: float) -> Models:
    """Return one measure of an orbit."""
    place = len(orbit.segments[0].mode.states) + 2 + output
    if operation == "avg":
        total = Models.constant(orbit.home, 0.0)
        for change in orbit.run.changes:
            total = total + change[place, 0]
        return total / orbit.period * factor
    extremes = Extremes(orbit, orbit.output(output))
    if operation == "pp":
        both = extremes.difference(extremes.extreme(1), extremes.extreme(-1))
        return both * abs(factor)
    sign = 1 if operation == "max" else -1
    return extremes.value(extremes.extreme(sign if factor > 0.0 else -sign)) * factor


def weights_of(models: Sequence[Models]) -> Floats:
    """Return how much each parameter takes part in what is not linear in measures."""
    total = np.zeros(models[0].home.variables)
    for model in models:
        powers = model.home.powers
        share = np.abs(model.coefficients) * (powers.sum(axis=1) > 1)
        total += (share[:, None] * powers).sum(axis=0) / (
            np.abs(model.coefficients[1:]).sum() or 1.0
        )
    return total


__all__ = ["OPERATIONS", "Box", "Lost", "NotProved", "Unbounded", "signal_of", "weights_of"]
