"""The response of a periodic steady state to small signals.

Sources, references and loads are perturbed by their AC values; the instants of switching move with
them.  Nothing is averaged: the response at a frequency holds at and above that of the switching
too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ..circuit import Circuit
from ..errors import Diagnostic, UsageError
from ..netlist.deck import PssCard
from ..problems.descriptor import DescriptorSystem, Functional
from ..solvers.modewise import refusal
from ..solvers.orbit import NoDerivative, PeriodMap
from .curve import Floats
from .linearised import Complexes, unbounded
from .small_signal import Ac
from .steady_failure import no_derivative
from .steady_state import Neighbour, Orbit, Periodic, Pss, find_orbits, report, static_orbit
from .stimuli import Stimulated, stimulated


def about_orbit(
    circuit: Circuit,
    analysis: Ac,
    names: Sequence[str],
    weights: Mapping[str, complex],
    card: PssCard | None,
    period: float | None,
    temperature: float | None,
    values: Mapping[str, float] | None,
    neighbour: Neighbour | None,
) -> tuple[dict[str, Complexes], list[Diagnostic], Periodic]:
    """Return responses by signal (sidebands as ``v(a)@1``), warnings, and the orbit's report."""
    pss = Pss.from_card(card) if card is not None and period is None else Pss(period)
    period, orbits = find_orbits(circuit, pss, temperature, values, neighbour)
    multiples = np.arange(-analysis.sidebands, analysis.sidebands + 1, dtype=np.float64)
    multiples = multiples[np.argsort(np.abs(multiples), kind="stable")]
    parts = {name: circuit.parts(name) for name in names}
    labels = [(n, k, f"{n}@{int(m)}" if m else n) for n in names for k, m in enumerate(multiples)]
    found = {label: np.zeros(analysis.frequencies.size, complex) for _, _, label in labels}
    for home, (island, orbit) in enumerate(zip(circuit.islands, orbits, strict=True)):
        if not any(device.name in weights for device in island.devices):
            continue
        local = list(dict.fromkeys(n for t in parts.values() for h, n, _ in t if h == home))
        if not local:
            continue
        if orbit is None:
            orbit = static_orbit(circuit, home, pss, period, temperature, values)
        responses = respond(orbit, local, analysis.frequencies, multiples, weights, pss)
        for name, k, label in labels:
            for h, part, factor in parts[name]:
                if h == home:
                    found[label] += factor * responses[:, k, local.index(part)]
    return found, [], report(circuit, period, [o for o in orbits if o is not None])


def at_orbit(
    orbit: Orbit, outputs: Sequence[Functional], system: DescriptorSystem, stimuli: Sequence[int]
) -> PeriodMap:
    """Return the period map of an orbit, run over its period and differentiated.

    Raises
    ------
    UsageError
        NS4015 for an orbit that has no closed form.
    """
    if orbit.stepped:
        raise UsageError(
            Diagnostic(
                "NS4015",
                "small signals about an orbit need its closed form, and this one was found by "
                f"steps with error control: {refusal(orbit.mna.system)}",
                hint="set-valued elements (D(ideal), SW) have one; .ac without .pss takes all",
            )
        )
    triggered = len(orbit.system.switches) > len(orbit.mna.system.switches)
    period_map = PeriodMap(system, None if triggered else orbit.found.period, outputs, stimuli)
    period_map.run(orbit.found.state)
    period_map.derivative()
    return period_map


def respond(
    orbit: Orbit,
    names: Sequence[str],
    frequencies: Floats,
    multiples: Floats,
    weights: Mapping[str, complex],
    pss: Pss,
) -> Complexes:
    """Return responses, shape (frequencies, multiples, signals).

    Raises
    ------
    NumericalError
        NS3060 without a derivative, NS3063 where the orbit responds without bound.
    """
    table = by_stimulus(orbit, names, frequencies, multiples, weights, pss)
    found = stimulated(orbit.mna, orbit.system, weights)
    factors = np.array([weights[name] for name in found.columns])
    result: Complexes = table @ factors
    return result


def by_stimulus(
    orbit: Orbit,
    names: Sequence[str],
    frequencies: Floats,
    multiples: Floats,
    weights: Iterable[str],
    pss: Pss,
) -> Complexes:
    """Return responses to each stimulus alone, shape (frequencies, multiples, signals, stimuli)."""
    found: Stimulated = stimulated(orbit.mna, orbit.system, weights)
    functionals = [found.functional(orbit.mna, name) for name in names]
    try:
        period_map = at_orbit(orbit, functionals, found.system, list(found.columns.values()))
    except NoDerivative as problem:
        raise no_derivative(problem, orbit.mna, pss.span) from problem
    pairs = np.zeros(2 * frequencies.size)
    pairs[1::2] = 2.0 * math.pi * frequencies
    flat = period_map.core.responses(pairs, np.ascontiguousarray(multiples))
    if flat is None:
        raise unbounded(float(frequencies[0]), pss.span)
    values = flat[::2] + 1j * flat[1::2]
    shape = frequencies.size, multiples.size, len(names), len(found.columns)
    table: Complexes = values.reshape(shape)
    bad = ~np.isfinite(table).all(axis=(1, 2, 3))
    if bad.any():
        raise unbounded(float(frequencies[int(np.argmax(bad))]), pss.span)
    return table
