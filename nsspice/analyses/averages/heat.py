"""Energies of switchings from the tables of model cards, and the junction temperatures that follow.

Switching stays ideal.  At each event of the exact run the current and the voltage on both sides are
known: a switch turns on into the current after the event with the voltage before it, it turns off
the current before it against the voltage after it; a diode recovers from the current before to the
voltage after.  Where both have the wrong signs, or one is zero, the switching is soft and the table
at zero counts.  These energies are not in the circuit's equations: they are added to the
balance of energy, which does not change.

In a periodic steady state tables are read at the average temperature of the junction, which solves

.. math::

    T = T_a + R_{th} (p + p_s(T)),

an equation of straight pieces between the temperatures of the tables.  Elements on a heat sink have
its temperature in place of the ambient's :math:`T_a`, which the heat of all of them raises.  Over a
transient each event is looked up at the temperature at its instant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...circuit import Circuit
from ...devices.heat.energy_table import EnergyTable
from ...devices.heat.switching_loss import SwitchingLoss, switching_loss
from ...devices.heat.thermal_network import ThermalNetwork, thermal_network
from ...devices.valve import Valve
from ...errors import Diagnostic, NumericalError, UsageError
from ..signals.curve import Floats
from .integrals import Integrals

_EPS = float(np.finfo(float).eps)
_INSTANTS = 400  # of a temperature's waveform


@dataclass(frozen=True, slots=True)
class Commutation:
    """One event at which an element switches.

    Parameters
    ----------
    time : float
        [s]
    kind : str
        ``on``, ``off`` or ``recovery``.
    current, voltage : float
        Sizes on the sides that count [A], [V], of one of equal parallel elements.
    energy : float
        Of all of them [J].
    """

    time: float
    kind: str
    current: float
    voltage: float
    energy: float


@dataclass(frozen=True, slots=True)
class Heating:
    """What heats an element, on average over the window.

    Parameters
    ----------
    element : str
    conduction, switching : float
        [W]
    commutations : tuple of Commutation
    temperature : float
        Of the junction, average [C]; nan without a thermal network.
    highest : float
        Of the junction over the window [C]; nan without one.
    outside : bool
        A table was read beyond its grid.
    times, temperatures : ndarray, shape (k,)
        The junction's temperature [C] over the window.
    sink : float
        Of its heat sink, average [C]; nan without one.
    """

    element: str
    conduction: float
    switching: float
    commutations: tuple[Commutation, ...]
    temperature: float
    highest: float
    outside: bool
    times: Floats
    temperatures: Floats
    sink: float = math.nan

    def to_dict(self) -> dict[str, object]:
        """Return a JSON-ready mapping."""
        return {
            "conduction": self.conduction,
            "switching": self.switching,
            "commutations": len(self.commutations),
            "temperature": self.temperature,
            "highest": self.highest,
            "outside": self.outside,
            "sink": self.sink,
        }


@dataclass(frozen=True, slots=True)
class _Event:
    """A commutation before its table is read."""

    time: float
    kind: str
    current: float
    voltage: float
    parallel: float
    table: EnergyTable

    def energy(self, temperature: float) -> float:
        one = self.table.energy(self.current, self.voltage, temperature)
        return self.parallel * one


def heating(circuit: Circuit, integrals: Integrals) -> dict[str, Heating]:
    """Return what heats the elements whose model cards have tables or thermal networks.

    Parameters
    ----------
    circuit : Circuit
    integrals : Integrals
        Over a period, or another window.

    Raises
    ------
    NumericalError
        NS3066 if a junction has no steady temperature: losses grow faster than heat flows off.
    """
    if integrals.heat is None:
        found = {e.name: loss for e in circuit.deck.elements if (loss := switching_loss(e))}
        found = {n: loss for n, loss in found.items() if n in circuit.element_island}
        powers = dict(zip(found, integrals.powers(list(found)), strict=True)) if found else {}
        members = {
            name: _Member(name, loss, powers[name], *_events(circuit, integrals, name, loss))
            for name, loss in found.items()
        }
        heat: dict[str, Heating] = {}
        for names, sink in _groups(circuit, list(members)):
            heat |= _heating(circuit, integrals, [members[name] for name in names], sink)
        integrals.heat = heat
    return integrals.heat


@dataclass(frozen=True, slots=True)
class _Member:
    """An element that heats itself and its sink, or equal parallel ones."""

    name: str
    loss: SwitchingLoss
    conduction: float
    events: list[_Event]
    parallel: float

    @property
    def network(self) -> ThermalNetwork:
        """From the junction to the sink, none of them: nothing."""
        found = self.loss.network
        if found is None:
            return ThermalNetwork((), ())
        return ThermalNetwork(tuple(r / self.parallel for r in found.resistances), found.times)

    def switching(self, temperature: float, length: float) -> float:
        """Return the average power of switchings at a temperature of the junction."""
        return math.fsum(e.energy(temperature) for e in self.events) / length

    def junction(self, base: float, length: float) -> float:
        """Return the temperature that the losses keep above a heat sink or the surroundings."""
        resistance = self.network.resistance
        return _balance(
            self.name,
            base,
            lambda t: base + resistance * (self.conduction + self.switching(t, length)),
            self.loss.temperatures,
        )


def _groups(
    circuit: Circuit, names: Sequence[str]
) -> list[tuple[list[str], ThermalNetwork | None]]:
    """Return the elements of each heat sink with its network, and all others alone.

    Raises
    ------
    UsageError
        NS4005 for an element on a heat sink of which no energies or network are known.
    """
    found: list[tuple[list[str], ThermalNetwork | None]] = []
    for card in circuit.deck.heat_sinks:
        on = [name for name in card.elements if name in names]
        for name in card.elements:
            if name not in names and name in circuit.element_island:
                message = f"{name} is on a heat sink, but its model card has no thermal network"
                hint = "give it Foster or Cauer, and tables of energies if it switches"
                raise UsageError(Diagnostic("NS4005", message, card.span, hint))
        if on:
            found.append((on, thermal_network(card.network, ".heatsink")))
    shared = {name for group, _ in found for name in group}
    return found + [([name], None) for name in names if name not in shared]


def _heating(
    circuit: Circuit, integrals: Integrals, group: Sequence[_Member], sink: ThermalNetwork | None
) -> dict[str, Heating]:
    """Return what heats the elements of one heat sink, or one element without any."""
    start, stop = integrals.window
    length, ambient = stop - start, integrals.temperature
    base = ambient
    if sink is not None and integrals.periodic:
        resistance = sink.resistance

        def heated(t: float) -> float:
            junctions = [m.junction(t, length) for m in group]
            powers = zip(group, junctions, strict=True)
            total = math.fsum(m.conduction + m.switching(at, length) for m, at in powers)
            return ambient + resistance * total

        knots = sorted({t for m in group for t in m.loss.temperatures})
        base = _balance(", ".join(m.name for m in group), ambient, heated, knots)
    known = sink is not None or group[0].loss.network is not None
    nothing: Floats = np.zeros(0)
    times, course = nothing, np.zeros((1 + len(group), 0))
    # at which temperatures tables are read
    steady = [m.junction(base, length) for m in group] if integrals.periodic or not known else []
    at = [[mean] * len(m.events) for m, mean in zip(group, steady, strict=True)] if steady else []
    if not known:
        at = [[ambient] * len(m.events) for m in group]
    else:
        if not steady:
            at = [[] for _ in group]
        times, course = _course(circuit, integrals, group, sink, steady, at)
    found = {}
    for k, member in enumerate(group):
        events = zip(member.events, at[k], strict=True)
        told = tuple(
            Commutation(e.time, e.kind, e.current, e.voltage, e.energy(t)) for e, t in events
        )
        outside = any(
            not e.table.covers(e.current, e.voltage, t)
            for e, t in zip(member.events, at[k], strict=True)
        )
        mean = highest = cool = math.nan
        if known:
            shown, own = course[1 + k], course[0]
            mean = steady[k] if steady else float(np.trapezoid(shown, times) / length)
            highest = float(shown.max())
        if sink is not None:
            cool = base if steady else float(np.trapezoid(own, times) / length)
        found[member.name] = Heating(
            member.name,
            member.conduction,
            math.fsum(c.energy for c in told) / length,
            told,
            mean,
            highest,
            outside,
            times,
            course[1 + k],
            cool,
        )
    return found


def _terms(circuit: Circuit, name: str) -> tuple[int, tuple[str, str]]:
    """Return the island of an element, and its voltage and current as signals."""
    device = circuit.device(name)
    a, b = device.ends
    voltage = f"v({a},{b})" if b != "0" else f"v({a})"
    return circuit.element_island[name], (voltage, f"i({name})")


def _events(
    circuit: Circuit, integrals: Integrals, name: str, loss: SwitchingLoss
) -> tuple[list[_Event], float]:
    """Return the commutations of an element within the window, and how many it stands for."""
    device = circuit.device(name)
    home, signals = _terms(circuit, name)
    period_map = integrals.map_of(home, signals)
    parts = list(device.valves(integrals.course(home).mna.layout))
    parallel = parts[0].parallel if parts else 1.0
    start, stop = integrals.window
    found: list[_Event] = []
    for time, before, after, on, then in _together(
        period_map.core.commutations(integrals.periodic)
    ):
        if not start <= time <= stop:
            continue
        for valve in parts:
            event = _event(
                valve, loss, time, before, after, valve.conducts(on), valve.conducts(then)
            )
            if event is not None:
                found.append(event)
    return found, parallel


def hot_statistic(
    circuit: Circuit,
    integrals: Integrals,
    signal: str,
    operation: str,
    window: tuple[float, float] | None = None,
) -> float | None:
    """Return a statistic of ``psw(x)``, the power of switchings, or ``tj(x)``, a temperature.

    Parameters
    ----------
    circuit : Circuit
    integrals : Integrals
    signal : str
    operation : str
        ``avg`` of both, ``max``, ``min`` and ``pp`` of a temperature, ``integ`` of a power.
    window : (float, float), optional
        Within that of the integrals [s]; the whole by default.

    Returns
    -------
    float or None
        None if there is no such statistic.
    """
    kind, _, element = signal[:-1].partition("(")
    found = heating(circuit, integrals).get(element)
    if found is None:
        return None
    start, stop = integrals.window if window is None else window
    if kind == "psw":
        # at the very ends of a period what switches there belongs to one of them
        inside = [c.energy for c in found.commutations if start <= c.time <= stop]
        total = math.fsum(inside)
        return {"avg": total / (stop - start), "integ": total}.get(operation)
    if not found.times.size:
        return None
    if operation == "avg" and window is None:
        return found.temperature
    within = (found.times > start) & (found.times < stop)
    ends = np.interp([start, stop], found.times, found.temperatures)
    times = np.concatenate([[start], found.times[within], [stop]])
    shown = np.concatenate([ends[:1], found.temperatures[within], ends[1:]])
    high, low = float(shown.max()), float(shown.min())
    mean = float(np.trapezoid(shown, times) / (stop - start))
    return {"avg": mean, "max": high, "min": low, "pp": high - low}.get(operation)


_Raw = tuple[float, list[float], list[float], list[int], list[int]]


def _together(events: Sequence[_Raw]) -> list[_Raw]:
    """Return events with those at one instant, up to its rounding, as one."""
    merged: list[_Raw] = []
    for event in events:
        if merged and event[0] - merged[-1][0] <= 8.0 * _EPS * event[0]:
            time, before, _, on, _ = merged[-1]
            merged[-1] = (time, before, event[2], on, event[4])
        else:
            merged.append(event)
    return merged


def _event(
    valve: Valve,
    loss: SwitchingLoss,
    time: float,
    before: Sequence[float],
    after: Sequence[float],
    was_on: bool,
    is_on: bool,
) -> _Event | None:
    """Return the commutation of one part of an element, None if it costs nothing."""
    if was_on == is_on:
        return None
    if valve.kind == "diode":
        kind, table, i, v, sign = "recovery", loss.recovery, before[1], after[0], -1.0
        if is_on:
            return None
    elif is_on:
        kind, table, i, v, sign = "on", loss.on, after[1], before[0], 1.0
    else:
        kind, table, i, v, sign = "off", loss.off, before[1], after[0], 1.0
    if table is None:
        return None
    # current and voltage overlap only if their product has the sign of a loss: else it is soft
    if sign * i * v < 0.0:
        v = 0.0
    return _Event(time, kind, abs(i) / valve.parallel, abs(v), valve.parallel, table)


def _balance(
    name: str, ambient: float, heated: Callable[[float], float], knots: Sequence[float]
) -> float:
    """Return the temperature that its own losses keep.

    Between neighbouring knots the losses are straight lines, so that one secant step from the ends
    of the right piece is exact; energies that end at zero bend it once more, hence several.
    """
    low = ambient
    for high in [*(t for t in knots if t > ambient), math.inf]:
        if math.isinf(high):
            high = low + max(1.0, heated(low) - low)
            slope = (heated(high) - heated(low)) / (high - low)
            if slope >= 1.0:
                raise _runaway(name)
            high = low + (heated(low) - low) / (1.0 - slope)
        if heated(high) - high <= 8.0 * _EPS * abs(high):
            break
        low = high
    for _ in range(100):
        below, above = heated(low) - low, heated(high) - high
        if below == above:
            return high
        middle = low + (high - low) * below / (below - above)
        left = heated(middle) - middle
        if abs(left) <= 8.0 * _EPS * abs(middle):
            return middle
        low, high = (middle, high) if left > 0.0 else (low, middle)
    return middle


def _runaway(name: str) -> NumericalError:
    return NumericalError(
        Diagnostic(
            "NS3066",
            f"the junction of {name} has no steady temperature: its losses grow faster with "
            f"temperature than its thermal network can dissipate",
            hint="lower the thermal resistance, or extend the tables to higher temperatures",
        )
    )


def _course(
    circuit: Circuit,
    integrals: Integrals,
    group: Sequence[_Member],
    sink: ThermalNetwork | None,
    steady: Sequence[float],
    at: Sequence[list[float]],
) -> tuple[Floats, Floats]:
    """Return instants, and temperatures [C] of the heat sink and of all junctions there.

    The power between neighbouring instants is its exact mean there, switchings are impulses of
    energy.  With ``steady`` temperatures tables are read there and the course is periodic; else it
    begins at the ambient temperature, and what tables are read at goes to ``at``.
    """
    start, stop = integrals.window
    ambient = integrals.temperature
    grid = np.linspace(start, stop, _INSTANTS + 1)
    instants = [e.time for m in group for e in m.events]
    times: Floats = np.unique(np.concatenate([grid, instants, [start, stop]]))
    widths = np.diff(times)
    energies = []
    for member in group:
        home, signals = _terms(circuit, member.name)
        core = integrals.map_of(home, signals).core
        energies.append(core.products_between([(0, 1)], times))
    # the sink takes the energies of all, each junction its own
    networks = [sink or ThermalNetwork((), ()), *(m.network for m in group)]
    taken = [np.sum(energies, axis=0), *energies]
    resistances = [np.array(n.resistances) for n in networks]
    rates = [1.0 / np.array(n.times) for n in networks]
    decays = [np.exp(-np.outer(widths, rate)) for rate in rates]
    rises = [
        -np.expm1(-np.outer(widths, rate)) * r * (energy / widths)[:, None]
        for rate, r, energy in zip(rates, resistances, taken, strict=True)
    ]
    at_instant: dict[int, list[tuple[int, _Event]]] = {}
    for k, member in enumerate(group):
        for event in member.events:
            place = int(np.searchsorted(times, event.time))
            at_instant.setdefault(place, []).append((k, event))

    def run(state: list[Floats]) -> tuple[list[Floats], Floats]:
        shown = np.empty((1 + len(group), times.size))
        for k in range(times.size):
            if k:
                parts = zip(decays, state, rises, strict=True)
                state = [decay[k - 1] * x + rise[k - 1] for decay, x, rise in parts]
            for j, event in at_instant.get(k, ()):
                warm = ambient + float(state[0].sum()) + float(state[1 + j].sum())
                if steady:
                    warm = steady[j]
                else:
                    at[j].append(warm)
                for n in (0, 1 + j):
                    state[n] = state[n] + event.energy(warm) * resistances[n] * rates[n]
            sums = [float(x.sum()) for x in state]
            shown[:, k] = ambient + sums[0] + np.array([0.0, *sums[1:]])
        return state, shown

    begin = [np.zeros(rate.size) for rate in rates]
    if steady:
        end, _ = run(list(begin))
        begin = [x / -np.expm1(-rate * (stop - start)) for x, rate in zip(end, rates, strict=True)]
    return times, run(begin)[1]
