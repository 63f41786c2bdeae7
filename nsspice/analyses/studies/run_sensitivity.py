"""How measures of a transient depend on its elements, exactly.

A change of an element is a source in its place that what the element sees drives; the perturbation
of the run is a closed form between two events, whose instants move with it (saltation).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from ...circuit import Circuit
from ...netlist.deck import Measure
from ...solvers.modewise import refusal
from ...solvers.orbit import NoDerivative, PeriodMap
from ...solvers.stepper import UnsolvedStep
from ..signals.signal_names import canonical
from ..steady.sensitivity import ElementValue, parameters_of
from ..steady.stimuli import with_columns
from ..transient.integrals import Course, Integrals

_EXACT = ("find_at", "avg", "integ")


class RunSlopes:
    """Derivatives of measures of one transient that begins with given voltages and currents.

    Parameters
    ----------
    integrals : Integrals
        Of the run.
    """

    def __init__(self, integrals: Integrals) -> None:
        self._integrals = integrals

    def derivatives(self, measures: Iterable[Measure], element: str) -> Mapping[str, float]:
        """Return the derivatives by the value of an element of those measures that have exact ones.

        Parameters
        ----------
        measures : iterable of Measure
            Values of signals at an instant, averages and integrals are exact.
        element : str
            R, L, C, and V or I (a constant added to the source).
        """
        home = self._integrals.circuit.element_island[element]
        course = self._integrals.course(home)
        parameters = parameters_of(course.mna, {element})
        if not parameters or refusal(course.system) is not None:
            return {}
        (parameter,) = parameters
        found = {}
        for measure in measures:
            slope = self._slope(measure, home, course, parameter)
            if slope is not None:
                found[measure.name] = slope
        return found

    def _slope(
        self, measure: Measure, home: int, course: Course, parameter: ElementValue
    ) -> float | None:
        signal = _signal_of(measure)
        if signal is None or signal.startswith("p(") or course.stop is None:
            return None
        parts = _local(self._integrals.circuit, signal, home)
        # the current of a resistor or capacitor depends on its value by its own law, too
        own = parameter.driver is not None and parameter.letter != "l"
        if own and f"i({parameter.name})" in parts:
            return None
        if measure.operation == "find_at":
            return None if measure.at is None else self._at(measure.at, parts, course, parameter, 0)
        start, stop = self._integrals.window
        low = start if measure.start is None else measure.start
        high = stop if measure.stop is None else measure.stop
        ends = [self._at(t, parts, course, parameter, 1) for t in (low, high)]
        if ends[0] is None or ends[1] is None:
            return None
        change = ends[1] - ends[0]
        return change / (high - low) if measure.operation == "avg" else change

    def _at(
        self,
        time: float,
        parts: Mapping[str, float],
        course: Course,
        parameter: ElementValue,
        integral: int,
    ) -> float | None:
        """Return the derivative of a signal at an instant, or of its integral up to it."""
        if time <= 0.0:
            return 0.0 if integral else None
        outputs = [course.mna.functional(name) for name in parts]
        if any(output.dz for output in outputs):
            return None
        drivers: list[int | None] = [None]
        if parameter.driver is not None:
            outputs.append(parameter.driver)
            drivers = [len(outputs) - 1]
        added = with_columns(course.system, {parameter.name: parameter.entries})
        period_map = PeriodMap(added.system, time, outputs, list(added.columns.values()))
        try:
            period_map.run(course.state)
            period_map.derivative()
        except (NoDerivative, UnsolvedStep):
            return None
        flat = period_map.core.of_run(drivers)
        if flat is None:
            return None
        table = flat.reshape(2, len(outputs))[integral]
        return float(sum(f * y for f, y in zip(parts.values(), table, strict=False)))


def _signal_of(measure: Measure) -> str | None:
    """Return the one signal that a measure looks at, None if it has no exact derivative."""
    expression = measure.expression
    if measure.operation not in _EXACT or expression is None or measure.first is not None:
        return None
    if measure.second is not None:
        return None
    name = canonical(expression.source)
    return name if expression.variables() == {name} else None


def _local(circuit: Circuit, signal: str, home: int) -> dict[str, float]:
    """Return the parts of a signal in one island, with their factors."""
    found: dict[str, float] = {}
    for place, name, factor in circuit.parts(signal):
        if place == home:
            found[name] = found.get(name, 0.0) + factor
    return found
