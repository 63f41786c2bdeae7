"""How averages in the periodic steady state depend on the elements, exactly.

A change of an element acts like a source in its place, driven by what the element itself sees; the
perturbation of the orbit by it is a closed form across all switchings, whose instants move with it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...devices.device import Device
from ...devices.outputs import scaled
from ...devices.passive.capacitor import Capacitor
from ...devices.passive.coupling import Coupling
from ...devices.passive.inductor import Inductor
from ...devices.passive.resistor import Resistor
from ...devices.sources.isource import CurrentSource
from ...devices.sources.vsource import VoltageSource
from ...errors import Diagnostic, NsspiceError, StepError, UsageError
from ...netlist.deck import PssCard
from ...problems.descriptor import Functional
from ...solvers.orbit import NoDerivative
from ...solvers.step_maps import Stimuli
from ..request.load import need_circuit
from ..request.request import Request
from ..request.values import checked_values
from ..results.sensitivity import Sensitivities, Sensitivity, ranked
from ..signals.curve import Floats
from ..signals.signal_names import canonical
from ..solution.solution import Solution
from .orbit_response import at_orbit
from .steady_failure import no_derivative
from .steady_state import Orbit, Pss, find_orbits
from .stepped_response import SteppedResponse
from .stimuli import Entries, with_columns


@dataclass(frozen=True, slots=True)
class ElementValue:
    """An element as a stimulus: where it enters, what drives it (None: a constant), its value."""

    name: str
    letter: str
    entries: Entries
    driver: Functional | None
    value: float


#: value, average and derivative by element and signal of an island
Slopes = Mapping[tuple[str, str], tuple[float, float, float]]


def parameters_of(mna: MnaSystem, wanted: Collection[str] | None = None) -> list[ElementValue]:
    """Return the values of an island's elements, of some or of all that have one known here."""
    coupled = {name for d in mna.devices if isinstance(d, Coupling) for name in d.controls}
    devices = [d for d in mna.devices if wanted is None or d.name in wanted]
    found = (_parameter_of(d, mna) for d in devices if d.name not in coupled)
    return [parameter for parameter in found if parameter is not None]


def _parameter_of(device: Device, mna: MnaSystem) -> ElementValue | None:
    """Return the parameter of an element, None if it has none that is known here."""
    layout, name, letter = mna.layout, device.name, device.letter
    if isinstance(device, VoltageSource):
        entries: Entries = ((layout.branches[name], -1.0),)
        return ElementValue(name, letter, entries, None, device.source.dc or 0.0)
    if isinstance(device, CurrentSource):
        entries = layout.voltage(*device.ends, -device.m)
        return ElementValue(name, letter, entries, None, device.source.dc or 0.0)
    if isinstance(device, Resistor | Capacitor) and device.value:
        if name in layout.branches:
            return None
        sign = -1.0 if isinstance(device, Resistor) else 1.0
        driver = scaled(device.current(layout), sign / device.value)
        entries = layout.voltage(*device.ends, -1.0)
        return ElementValue(name, letter, entries, driver, device.value)
    if isinstance(device, Inductor) and device.value:
        branch = layout.branches[name]
        rate = Functional(dz=((branch, device.inductance(layout) / device.value),))
        return ElementValue(name, letter, ((branch, -1.0),), rate, device.value)
    return None


def summed(circuit: Circuit, keys: Sequence[str], islands: Mapping[int, Slopes]) -> Sensitivities:
    """Return the sensitivities of signals, each a sum over islands."""
    found: dict[tuple[str, str], Sensitivity] = {}
    for key in keys:
        for home, part, factor in circuit.parts(key):
            for (name, signal), (value, average, slope) in islands.get(home, {}).items():
                if signal == part:
                    before = found.get((key, name), Sensitivity(key, name, value, 0.0, 0.0))
                    found[key, name] = Sensitivity(
                        key,
                        name,
                        value,
                        before.average + factor * average,
                        before.derivative + factor * slope,
                    )
    return ranked(found.values(), keys)


def sens(
    circuit: Circuit,
    signals: Sequence[str],
    elements: Sequence[str] | None = None,
    *,
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
) -> Sensitivities:
    """Find how averages in the periodic steady state depend on elements.

    Parameters
    ----------
    circuit : Circuit
    signals : sequence of str
        Voltages and currents.
    elements : sequence of str, optional
        R, L, C, and V or I (a constant added to the source); all of them by default.
    temperature, values
        As for :func:`nsspice.tran`.

    Returns
    -------
    list of Sensitivity
        Signal by signal, the elements with the largest effect first; shown as a table, also a
        DataFrame (``to_pandas()``).

    Raises
    ------
    NumericalError
        NS3060 where there is no derivative, NS3062 without an orbit.
    UsageError
        NS4005 for an element that has no such parameter.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''chopped divider
    ... V1 a 0 PULSE(0 1 0 0 0 5u 10u)
    ... R1 a b 1k
    ... R2 b 0 1k
    ... C1 b 0 10n
    ... ''')
    >>> [(s.element, round(s.derivative * 1e3, 9)) for s in nsspice.sens(circuit, ["v(b)"], ["r1"])]
    [('r1', -0.125)]
    """
    need_circuit(circuit)
    card = next((c for c in circuit.deck.analyses if isinstance(c, PssCard)), None)
    analysis = Pss() if card is None else Pss.from_card(card)
    if analysis.trigger is not None:
        raise UsageError(
            Diagnostic(
                "NS4021",
                "sensitivities of a circuit with a free period are not computed",
                analysis.span,
                "use the difference of two runs",
            )
        )
    keys = [canonical(name) for name in signals]
    parts = {key: circuit.parts(key) for key in keys}
    request = Request(temperature=temperature, values=checked_values(circuit, values))
    _, orbits = find_orbits(circuit, analysis, request)
    wanted = None if elements is None else [name.lower() for name in elements]
    islands: dict[int, Slopes] = {}
    for home, orbit in enumerate(orbits):
        if orbit is not None:
            local = list(dict.fromkeys(n for t in parts.values() for h, n, _ in t if h == home))
            islands[home] = _of_island(orbit, local, wanted, analysis)
    known = {name for table in islands.values() for name, _ in table}
    for name in wanted or ():
        if name not in known:
            raise UsageError(
                Diagnostic(
                    "NS4005",
                    f"{name} has no value with respect to which an average could be differentiated",
                    hint="use R, C, uncoupled L, V and I in parts that store energy",
                )
            )
    return summed(circuit, keys, islands)


def _of_island(
    orbit: Orbit, names: Sequence[str], wanted: Sequence[str] | None, analysis: Pss
) -> Slopes:
    """Return the averages of signals of one island, and their derivatives by its elements."""
    mna = orbit.mna
    parameters = parameters_of(mna, wanted)
    drivers = [p.driver for p in parameters if p.driver is not None]
    outputs = [*map(mna.functional, names), *drivers]
    places = iter(range(len(names), len(outputs)))
    numbers = [None if p.driver is None else next(places) for p in parameters]
    # the charges and fluxes whose rates drive
    outputs += [Functional(z=driver.dz) for driver in drivers]
    if orbit.stepped:
        found = _by_steps(orbit, parameters, outputs, analysis)
    else:
        found = _exact(orbit, parameters, outputs, numbers, analysis)
    if found is None:
        raise StepError(
            Diagnostic(
                "NS3065",
                "no sensitivities: nothing restores the orbit, or a mode has a double rate",
                analysis.span,
                "change a value slightly, or add damping",
            ),
            time=0.0,
            residual=float("nan"),
        )
    table, means = found
    result = {}
    for k, parameter in enumerate(parameters):
        for j, name in enumerate(names):
            slope = float(table[j, k])
            if name == f"i({parameter.name})" and parameter.driver is not None:
                # the element's own law depends on its value, too
                number = numbers[k]
                slope += 0.0 if parameter.letter == "l" or number is None else float(means[number])
            result[parameter.name, name] = parameter.value, float(means[j]), slope
    return result


def _exact(
    orbit: Orbit,
    parameters: Sequence[ElementValue],
    outputs: Sequence[Functional],
    numbers: list[int | None],
    analysis: Pss,
) -> tuple[Floats, Floats] | None:
    """Return derivatives of the averages of outputs, (outputs, parameters), and the averages."""
    stimulated = with_columns(orbit.system, {p.name: p.entries for p in parameters})
    try:
        period_map = at_orbit(orbit, outputs, stimulated.system, list(stimulated.columns.values()))
    except NoDerivative as problem:
        raise no_derivative(problem, orbit.mna, analysis.span) from problem
    period, driving = orbit.found.period, sum(n is not None for n in numbers)
    drivers = [
        (k, number, None if number is None else number + driving, 1.0 if number is None else 0.0)
        for k, number in enumerate(numbers)
    ]
    rows = []
    for place in range(len(outputs) - 2 * driving):
        window = (place, [0.0, period], 1.0 / period)
        found = period_map.core.gradient(drivers, True, integrals=[window])
        if found is None:
            return None
        rows.append(found[0])
    means = period_map.core.coefficients(np.zeros(1), 0.0, period)[::2]
    return np.array(rows), means


def _by_steps(
    orbit: Orbit,
    parameters: Sequence[ElementValue],
    outputs: Sequence[Functional],
    analysis: Pss,
) -> tuple[Floats, Floats] | None:
    """Return the same of an orbit that was found by steps with error control."""
    rows = np.zeros((orbit.mna.system.n, len(parameters)))
    drivers: list[tuple[Functional | None, bool]] = []
    for k, parameter in enumerate(parameters):
        for row, value in parameter.entries:
            rows[row, k] += value
        driver = parameter.driver
        stored = driver is not None and bool(driver.dz)
        # charges and fluxes instead of their rates: they may jump
        drivers.append((Functional(z=driver.dz) if driver and stored else driver, stored))
    response = SteppedResponse(orbit, outputs, Stimuli(rows, {}, drivers), analysis)
    table = response(np.zeros(1), np.zeros(1))[0, 0].real
    if not np.isfinite(table).all():
        return None
    return table, response.finest.means()


def add_sensitivities(circuit: Circuit, solution: Solution, request: Request) -> None:
    """Compute what ``.sens`` cards ask for, of an orbit or the operating point; else a warning."""
    from .transfer import op_sensitivities

    compute = op_sensitivities if solution.analysis == "op" else sens
    for card in circuit.deck.sensitivities:
        if not card.signals:
            continue  # of measures
        try:
            solution.sensitivities += compute(
                circuit,
                card.signals,
                card.elements or None,
                temperature=request.temperature,
                values=request.values,
            )
        except NsspiceError as problem:
            found = problem.diagnostics[0]
            solution.warnings.append(
                Diagnostic(
                    found.code,
                    f".sens is omitted: {found.message}",
                    card.span,
                    found.hint,
                    severity="warning",
                )
            )
