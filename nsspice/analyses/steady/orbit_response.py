"""The response of a periodic steady state to small signals.

Sources, references and loads are perturbed by their AC values; the instants of switching move with
them.  Nothing is averaged: the response at a frequency holds at and above that of the switching
too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, Span
from ...netlist.deck import PssCard
from ...problems.descriptor import DescriptorSystem, Functional
from ...solvers.orbit import NoDerivative, PeriodMap
from ...solvers.step_maps import Stimuli
from ..request.request import Request
from ..results.periodic import Periodic
from ..signals.curve import Floats
from .linearised import Complexes, unbounded
from .small_signal import Ac
from .steady_failure import no_derivative
from .steady_state import Orbit, Pss, find_orbits, report, static_orbit
from .stepped_response import SteppedResponse
from .stimuli import Stimulated, stimulated

#: relative error of a response above which it is reported
KNOWN = 1e-4


def about_orbit(
    circuit: Circuit,
    analysis: Ac,
    names: Sequence[str],
    weights: Mapping[str, complex],
    card: PssCard | None,
    period: float | None,
    request: Request,
) -> tuple[dict[str, Complexes], list[Diagnostic], Periodic]:
    """Return responses by signal (sidebands as ``v(a)@1``), warnings, and the orbit's report."""
    pss = Pss.from_card(card) if card is not None and period is None else Pss(period)
    period, orbits = find_orbits(circuit, pss, request)
    multiples = np.arange(-analysis.sidebands, analysis.sidebands + 1, dtype=np.float64)
    multiples = multiples[np.argsort(np.abs(multiples), kind="stable")]
    parts = {name: circuit.parts(name) for name in names}
    labels = [(n, k, f"{n}@{int(m)}" if m else n) for n in names for k, m in enumerate(multiples)]
    warnings: list[Diagnostic] = []
    found = {label: np.zeros(analysis.frequencies.size, complex) for _, _, label in labels}
    for home, (island, orbit) in enumerate(zip(circuit.islands, orbits, strict=True)):
        if not any(device.name in weights for device in island.devices):
            continue
        local = list(dict.fromkeys(n for t in parts.values() for h, n, _ in t if h == home))
        if not local:
            continue
        if orbit is None:
            orbit = static_orbit(circuit, home, pss, period, request)
        respond = responder(orbit, local, weights, pss)
        factors = np.array([weights[name] for name in respond.stimuli])
        responses = respond(analysis.frequencies, multiples) @ factors
        if respond.error > KNOWN:
            warnings.append(_inaccurate(respond.error, analysis))
        for name, k, label in labels:
            for h, part, factor in parts[name]:
                if h == home:
                    found[label] += factor * responses[:, k, local.index(part)]
    return found, warnings, report(period, orbits)


def at_orbit(
    orbit: Orbit, outputs: Sequence[Functional], system: DescriptorSystem, stimuli: Sequence[int]
) -> PeriodMap:
    """Return the period map of an orbit, run over its period and differentiated."""
    triggered = len(orbit.system.switches) > len(orbit.mna.system.switches)
    period_map = PeriodMap(system, None if triggered else orbit.found.period, outputs, stimuli)
    period_map.run(orbit.found.state)
    period_map.derivative()
    return period_map


class Responder:
    """The responses of an orbit to each stimulus alone.

    Parameters
    ----------
    stimuli : sequence of str
        Their names, in the order of the last axis.
    table : callable
        Returns responses at frequencies and multiples.
    span : Span or None
        Of the card.
    """

    def __init__(
        self,
        stimuli: Sequence[str],
        table: SteppedResponse | Callable[[Floats, Floats], Complexes],
        span: Span | None,
    ) -> None:
        self.stimuli, self.table, self._span = stimuli, table, span

    @property
    def error(self) -> float:
        """How far responses are off at most, relative; 0 where they are exact."""
        return self.table.error if isinstance(self.table, SteppedResponse) else 0.0

    def __call__(self, frequencies: Floats, multiples: Floats) -> Complexes:
        """Return responses, shape (frequencies, multiples, signals, stimuli).

        Raises
        ------
        NumericalError
            NS3060 without a derivative, NS3063 where the orbit responds without bound.
        """
        table = self.table(frequencies, multiples)
        bad = ~np.isfinite(table).all(axis=(1, 2, 3))
        if bad.any():
            raise unbounded(float(frequencies[int(np.argmax(bad))]), self._span)
        return table


def responder(orbit: Orbit, names: Sequence[str], weights: Iterable[str], pss: Pss) -> Responder:
    """Return the responses of signals to stimuli by name.

    Raises
    ------
    NumericalError
        NS3060 without a derivative.
    """
    found: Stimulated = stimulated(
        orbit.mna, orbit.mna.system if orbit.stepped else orbit.system, weights
    )
    functionals = [found.functional(orbit.mna, name) for name in names]
    stimuli = list(found.columns)
    if orbit.stepped:
        rows = found.system.S.dense()[:, list(found.columns.values())]
        read = orbit.mna.layout.columns
        reads = {k: read[name] for k, name in enumerate(stimuli) if name in read}
        response = SteppedResponse(orbit, functionals, Stimuli(rows, reads), pss)
        return Responder(stimuli, response, pss.span)
    try:
        period_map = at_orbit(orbit, functionals, found.system, list(found.columns.values()))
    except NoDerivative as problem:
        raise no_derivative(problem, orbit.mna, pss.span) from problem

    def exact(frequencies: Floats, multiples: Floats) -> Complexes:
        pairs = np.zeros(2 * frequencies.size)
        pairs[1::2] = 2.0 * math.pi * frequencies
        flat = period_map.core.responses(pairs, np.ascontiguousarray(multiples))
        shape = frequencies.size, multiples.size, len(names), len(stimuli)
        if flat is None:
            return np.full(shape, np.inf, complex)
        values: Complexes = (flat[::2] + 1j * flat[1::2]).reshape(shape)
        return values

    return Responder(stimuli, exact, pss.span)


def _inaccurate(error: float, analysis: Ac) -> Diagnostic:
    return Diagnostic(
        "NS3067",
        f"responses are accurate only to {error:.1g}: they still changed with shorter steps",
        analysis.span,
        "omit the highest frequencies",
        severity="warning",
    )
