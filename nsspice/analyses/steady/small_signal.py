"""The response of a circuit to small signals: ``.ac``, about the operating point or an orbit."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, Span, UsageError
from ...netlist.deck import AcCard, PssCard
from ..request.arguments import frequencies_of, instant_of
from ..request.load import need_circuit
from ..request.request import Request
from ..request.row_sinks import hand_over
from ..request.sampled import refuse_sampled
from ..request.values import checked_values
from ..signals.curve import Floats
from ..solution.solution import Solution
from .linearised import Complexes, operating_point, respond
from .stimuli import ac_values


@dataclass(frozen=True, slots=True)
class Ac:
    """What is asked for.

    Parameters
    ----------
    frequencies : ndarray, shape (k,)
        [Hz]
    sidebands : int
        Multiples of a periodic orbit's own frequency that are shown on both sides.
    span : Span or None
        Of the card.
    """

    frequencies: Floats
    sidebands: int = 0
    span: Span | None = None

    @classmethod
    def from_card(cls, card: AcCard) -> Ac:
        """Return the analysis of a card."""
        return cls(np.array(card.frequencies), card.sidebands, card.span)


def ac(
    circuit: Circuit,
    frequencies: Sequence[float] | Floats | None = None,
    *,
    signals: Sequence[str] | None = None,
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
    period: float | None = None,
    sidebands: int = 0,
) -> Solution:
    """Find the response to the AC values of the sources.

    With a ``.pss`` card, or a ``period``, it is that of the periodic steady state, in which
    switching instants move; otherwise that of the operating point.

    Parameters
    ----------
    circuit : Circuit
        From :func:`nsspice.read`.
    frequencies : sequence of float, optional
        [Hz]; those of the deck's first ``.ac`` card by default.
    signals, temperature, values
        As for :func:`nsspice.tran`.
    period : float, optional
        Of the periodic steady state [s].
    sidebands : int
        Multiples of the orbit's frequency shown on both sides of the stimulus frequency.

    Returns
    -------
    Solution
        Its axis is ``frequency`` [Hz]; ``sol["v(out)"]`` is complex.

    Raises
    ------
    NumericalError
        If there is no operating point or orbit, or no response at a frequency.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''low-pass filter
    ... V1 a 0 AC 1
    ... R1 a b 1k
    ... C1 b 0 1u
    ... ''')
    >>> sol = nsspice.ac(circuit, [0.0, 159.15494309189535])
    >>> [complex(v) for v in sol["v(b)"].round(12)]
    [(1+0j), (0.5-0.5j)]
    """
    need_circuit(circuit)
    if period is not None:
        instant_of(period, "a period", above_zero=True)
    card = next((c for c in circuit.deck.analyses if isinstance(c, AcCard)), None)
    if frequencies is not None:
        if sidebands < 0:
            hint = "give a whole number from 0 on"
            raise UsageError(Diagnostic("NS4005", f"sidebands cannot be {sidebands}", hint=hint))
        analysis = Ac(frequencies_of(frequencies), sidebands)
    elif card is not None:
        analysis = Ac.from_card(card)
    else:
        raise UsageError(
            Diagnostic(
                "NS4006",
                f"{circuit.deck.file} has no .ac card",
                hint="pass frequencies, or add .ac dec 10 1 1meg to the deck",
            )
        )
    given = checked_values(circuit, values)
    request = Request(signals=signals, temperature=temperature, values=given)
    return run_ac(circuit, analysis, request, period)


def run_ac(
    circuit: Circuit, analysis: Ac, request: Request, period: float | None = None
) -> Solution:
    """Run one analysis of small signals; see :func:`ac`."""
    refuse_sampled(circuit.deck, ".ac", delays=True)
    begin = clock.perf_counter()
    weights = ac_values(circuit)
    columns, names = request.names(circuit)
    powers = {n for n in columns if n.startswith("p(")}
    columns, names = ([n for n in part if n not in powers] for part in (columns, names))
    periodic = next((c for c in circuit.deck.analyses if isinstance(c, PssCard)), None)
    if periodic is not None or period is not None:
        from .orbit_response import about_orbit

        found, warnings, notes = about_orbit(
            circuit, analysis, names, weights, periodic, period, request
        )
    else:
        found, warnings = _about_point(circuit, analysis, names, weights, request)
        notes = None
    if not weights:
        warnings = [*warnings, _no_stimulus(analysis)]
    table = {}
    for name, response in found.items():
        table[f"re({name})"], table[f"im({name})"] = response.real.copy(), response.imag.copy()
    shown = [n for n in found if n.partition("@")[0] in columns]
    solution = Solution(
        "ac",
        circuit.deck.title,
        "frequency",
        analysis.frequencies,
        table,
        [part for n in shown for part in (f"re({n})", f"im({n})")],
        warnings=warnings,
        periodic=notes,
        wall_time=clock.perf_counter() - begin,
    )
    hand_over(solution, request.sink)
    return solution


def _about_point(
    circuit: Circuit,
    analysis: Ac,
    names: Sequence[str],
    weights: Mapping[str, complex],
    request: Request,
) -> tuple[dict[str, Complexes], list[Diagnostic]]:
    s: Complexes = (2j * np.pi * analysis.frequencies).astype(np.complex128)
    parts = {name: circuit.parts(name) for name in names}
    found = {name: np.zeros(s.size, complex) for name in names}
    corners: list[str] = []
    for home, island in enumerate(circuit.islands):
        if not any(device.name in weights for device in island.devices):
            continue
        local = dict.fromkeys(n for terms in parts.values() for h, n, _ in terms if h == home)
        point = operating_point(circuit, island, weights, request)
        corners += point.corners
        functionals = [point.stimulated.functional(point.mna, name) for name in local]
        responses = dict(zip(local, respond(point, functionals, s, weights).T, strict=True))
        for name, terms in parts.items():
            for h, part, factor in terms:
                if h == home:
                    found[name] += factor * responses[part]
    warnings = [_at_corner(analysis, corners)] if corners else []
    return found, warnings


def _no_stimulus(analysis: Ac) -> Diagnostic:
    return Diagnostic(
        "NS4016",
        "no source has an AC value: the response is zero",
        analysis.span,
        "write AC 1 on the line of a source, as in V1 in 0 DC 5 AC 1",
        severity="warning",
    )


def _at_corner(analysis: Ac, corners: Sequence[str]) -> Diagnostic:
    return Diagnostic(
        "NS3064",
        f"{', '.join(corners)} is at a kink of its characteristic at the operating point and is "
        f"treated as blocking: for small signals it would be a rectifier",
        analysis.span,
        "give it a bias, or use .pss for circuits that switch",
        severity="warning",
    )
