"""Loop gain by double injection at a source of zero volts in the loop.

With voltage injection (a) and current injection into its first node (b), v the voltage of that node
and i the current through the source,

.. math::

    T = -1 \\Big/ \\Big(1 - \\frac{1}{2 (i_a v_b - v_a i_b) + v_a + i_b}\\Big),

which holds for any impedances and in whichever direction the loop is passed through.  T is
the return ratio: negative feedback has a positive T at low frequencies, and the loop is unstable
where it encircles -1.

Source: M. Tian, V. Visvanathan, J. Hantgan, K. Kundert, "Striving for small-signal stability", IEEE
Circuits and Devices Magazine 17 (2001) 31, doi:10.1109/101.900125.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, Span, UsageError
from ...netlist.deck import LoopCard, PssCard
from ..request.arguments import frequencies_of, name_of
from ..request.load import need_circuit
from ..request.request import Request
from ..request.row_sinks import hand_over
from ..request.sampled import refuse_sampled
from ..request.values import checked_values
from ..results.loop_report import Crossing, LoopReport
from ..results.periodic import Periodic
from ..signals.curve import Floats
from ..solution.solution import Solution, part_of
from .linearised import Complexes, operating_point
from .linearised import respond as respond_at_point
from .orbit_response import responder
from .steady_state import Pss, find_orbits, report
from .stimuli import injection

#: a crossing is located to this part of its frequency
_LOCATED = 1e-12


@dataclass(frozen=True, slots=True)
class Loop:
    """What is asked for.

    Parameters
    ----------
    source : str
        A voltage source of 0 V in the loop.
    frequencies : ndarray, shape (k,)
        [Hz], rising.
    span : Span or None
        Of the card.
    """

    source: str
    frequencies: Floats
    span: Span | None = None

    @classmethod
    def from_card(cls, card: LoopCard) -> Loop:
        """Return the analysis of a card."""
        return cls(card.source, np.array(card.frequencies), card.span)


def loop(
    circuit: Circuit,
    source: str,
    frequencies: Sequence[float] | Floats,
    *,
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
) -> Solution:
    """Find the loop gain at a 0 V source, about the orbit if the deck has ``.pss``.

    Parameters
    ----------
    circuit : Circuit
    source : str
        Its first node is on the side to which the signal flows, but the result does not depend on
        it.
    frequencies : sequence of float
        [Hz], rising.
    temperature, values
        As for :func:`nsspice.tran`.

    Returns
    -------
    Solution
        ``sol["t"]`` is the loop gain, ``sol.loop`` has crossovers and margins.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''integrator of gain 1 with a pole at 1 rad/s
    ... E1 y 0 0 c 1
    ... Vt x y 0
    ... R1 x c 1
    ... C1 c 0 1
    ... ''')
    >>> [complex(v) for v in nsspice.loop(circuit, "vt", [0.15915494309189535])["t"].round(12)]
    [(0.5-0.5j)]
    """
    need_circuit(circuit)
    name = name_of(source, "a source", "vt").lower()
    request = Request(temperature=temperature, values=checked_values(circuit, values))
    return run_loop(circuit, Loop(name, frequencies_of(frequencies)), request)


def run_loop(circuit: Circuit, analysis: Loop, request: Request) -> Solution:
    """Run one analysis of a loop gain; see :func:`loop`."""
    refuse_sampled(circuit.deck, ".loop")
    begin = clock.perf_counter()
    if analysis.source not in circuit.element_island:
        raise UsageError(
            Diagnostic(
                "NS4005",
                f"there is no source {analysis.source}",
                analysis.span,
                "name a 0 V source between two nodes of the loop",
            )
        )
    gain, notes = _gain(circuit, analysis, request)
    t = gain(analysis.frequencies)
    solution = Solution(
        "loop",
        circuit.deck.title,
        "frequency",
        analysis.frequencies,
        {"re(t)": t.real.copy(), "im(t)": t.imag.copy()},
        periodic=notes,
        loop=margins(analysis.frequencies, t, gain),
        wall_time=clock.perf_counter() - begin,
    )
    hand_over(solution, request.sink)
    return solution


def _gain(
    circuit: Circuit, analysis: Loop, request: Request
) -> tuple[Callable[[Floats], Complexes], Periodic | None]:
    """Return the loop gain as a function of frequencies [Hz], and the report of the orbit."""
    home = circuit.element_island[analysis.source]
    node = circuit.device(analysis.source).nodes[0]
    names = [f"v({node})", f"i({analysis.source})"]
    stimuli = [analysis.source, injection(node)]
    card = next((c for c in circuit.deck.analyses if isinstance(c, PssCard)), None)
    if card is None:
        units = dict.fromkeys(stimuli, 1.0)
        point = operating_point(circuit, circuit.islands[home], units, request)
        functionals = [point.stimulated.functional(point.mna, name) for name in names]

        def about_point(frequencies: Floats) -> Complexes:
            s = (2j * np.pi * frequencies).astype(np.complex128)
            found = [
                respond_at_point(point, functionals, s, {n: float(n == on) for n in stimuli})
                for on in stimuli
            ]
            return tian(*found[0].T, *found[1].T)

        return about_point, None
    pss = Pss.from_card(card)
    period, orbits = find_orbits(circuit, pss, request)
    orbit = orbits[home]
    if orbit is None:
        raise UsageError(
            Diagnostic(
                "NS4005",
                f"no energy is stored in the part of the circuit with {analysis.source}",
                analysis.span,
                "remove .pss to get its loop gain at the operating point",
            )
        )

    respond = responder(orbit, names, stimuli, pss)

    def about_orbit(frequencies: Floats) -> Complexes:
        table = respond(frequencies, np.zeros(1))[:, 0]
        return tian(table[:, 0, 0], table[:, 1, 0], table[:, 0, 1], table[:, 1, 1])

    return about_orbit, report(period, orbits)


def tian(va: Complexes, ia: Complexes, vb: Complexes, ib: Complexes) -> Complexes:
    """Return the loop gain from both injections; see the module.

    Examples
    --------
    An amplifier of gain -3 with no output impedance: v = 1/(1 + T), and the current goes through.

    >>> tian(*(np.array([x + 0j]) for x in (0.25, 0.0, 0.0, 1.0))).real.tolist()
    [3.0]
    """
    total = 2.0 * (ia * vb - va * ib) + va + ib
    result: Complexes = total / (1.0 - total)
    return result


def margins(frequencies: Floats, t: Complexes, gain: Callable[[Floats], Complexes]) -> LoopReport:
    """Return where a loop gain crosses 1 and -180 deg, located with the gain itself.

    Parameters
    ----------
    frequencies : ndarray, shape (k,)
        [Hz], rising and positive where crossings are looked for.
    t : ndarray of complex, shape (k,)
        The gain there.
    gain : callable
        The gain at other frequencies.
    """

    def at(f: float) -> complex:
        return complex(gain(np.array([f]))[0])

    def located(low: float, high: float, value: Callable[[complex], float]) -> float:
        """Return a root between two frequencies by bisection with secants (regula falsi)."""
        a, b = value(at(low)), value(at(high))
        for _ in range(100):
            f = low - a * (high - low) / (b - a)
            if not low < f < high:
                f = math.sqrt(low * high)
            c = value(at(f))
            if c == 0.0 or high - low <= _LOCATED * high:
                return f
            # the side that stays is halved, so that both ends approach the root
            if (c > 0.0) == (a > 0.0):
                low, a, b = f, c, 0.5 * b
            else:
                high, b, a = f, c, 0.5 * a
        return f

    crossovers, reversals = [], []
    decibels, phase = part_of(t, "db"), part_of(t, "p")
    for k in range(frequencies.size - 1):
        low, high = float(frequencies[k]), float(frequencies[k + 1])
        if low <= 0.0:
            continue
        if (decibels[k] > 0.0) != (decibels[k + 1] > 0.0):
            f = located(low, high, lambda v: math.log(abs(v)))
            angle = math.degrees(math.atan2(at(f).imag, at(f).real))
            crossovers.append(Crossing(f, 180.0 + angle if angle <= 0.0 else angle - 180.0))
        turns = math.floor((phase[k] + 180.0) / 360.0), math.floor((phase[k + 1] + 180.0) / 360.0)
        if turns[0] != turns[1]:
            f = located(low, high, lambda v: v.imag if v.real < 0.0 else math.copysign(1.0, v.imag))
            reversals.append(Crossing(f, -20.0 * math.log10(abs(at(f)))))
    return LoopReport(tuple(crossovers), tuple(reversals))
