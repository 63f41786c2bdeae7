"""``.noise``: thermal, shot and flicker noise about the operating point; nothing switches."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...circuit import Circuit
from ...devices.noise import Flicker
from ...errors import Diagnostic, Span, UsageError
from ...netlist.deck import Element, NoiseCard, PssCard
from ..request.request import Request
from ..request.row_sinks import hand_over
from ..request.sampled import refuse_sampled
from ..request.values import checked_values
from ..signals.curve import Floats
from ..signals.signal_names import canonical
from ..solution.refusal import judge
from ..solution.solution import Solution
from ..static.statics import run_op
from .adjoint import adjoint
from .linearised import Complexes, Point, operating_point


@dataclass(frozen=True, slots=True)
class Noise:
    """What is asked for.

    Parameters
    ----------
    output : str
        A voltage.
    source : str
        To which the noise is referred back.
    frequencies : ndarray, shape (k,)
        [Hz]
    span : Span or None
        Of the card.
    """

    output: str
    source: str
    frequencies: Floats
    span: Span | None = None

    @classmethod
    def from_card(cls, card: NoiseCard) -> Noise:
        """Return the analysis of a card."""
        return cls(card.output, card.source, np.array(card.frequencies), card.span)


def noise(
    circuit: Circuit,
    output: str,
    source: str,
    frequencies: Floats,
    *,
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
) -> Solution:
    """Find the noise at an output, and what noise of a source would make it.

    Parameters
    ----------
    circuit : Circuit
        From :func:`nsspice.read`.
    output : str
        ``v(out)`` or ``v(a,b)``.
    source : str
        Name of a V or I.
    frequencies : ndarray, shape (k,)
        [Hz]
    temperature, values
        As for :func:`nsspice.tran`.

    Returns
    -------
    Solution
        Over ``frequency``: ``onoise`` [V/sqrt(Hz)], ``inoise`` [V/sqrt(Hz), or A/sqrt(Hz) of a
        current source], and ``onoise(r1)``, ... of each element; its measures ``onoise_total`` and
        ``inoise_total`` are the rms values over the band [V or A].

    Examples
    --------
    >>> import nsspice
    >>> from nsspice.analyses.steady.noise import noise
    >>> circuit = nsspice.read('''divider
    ... V1 a 0 1
    ... R1 a b 2k
    ... R2 b 0 2k
    ... ''')
    >>> sol = noise(circuit, "v(b)", "v1", [1e3])
    >>> round(float(sol["onoise"][0]) * 1e9, 4)  # sqrt(4 k T 1 kOhm)
    4.0714
    """
    asked = Noise(canonical(output), source.lower(), np.asarray(frequencies, dtype=np.float64))
    return run_noise(
        circuit, asked, Request(temperature=temperature, values=checked_values(circuit, values))
    )


def run_noise(circuit: Circuit, analysis: Noise, request: Request) -> Solution:
    """Run one analysis of noise; see :func:`noise`."""
    refuse_sampled(circuit.deck, ".noise")
    begin = clock.perf_counter()
    _check(circuit, analysis)
    s: Complexes = (2j * np.pi * analysis.frequencies).astype(np.complex128)
    parts = circuit.parts(analysis.output)
    densities: dict[str, Floats] = {}
    gain = np.zeros(s.size, complex)
    elements = {e.name: e for e in circuit.deck.elements}
    silent = {e.name for e in circuit.deck.elements if _silent(e)}
    for home in dict.fromkeys(h for h, _, _ in parts):
        island = circuit.islands[home]
        point = operating_point(circuit, island, {analysis.source: 1.0}, request)
        layout = point.mna.layout
        y = np.zeros((s.size, point.system.n + len(point.active)), complex)
        for h, part, factor in parts:
            if h == home:
                y += factor * adjoint(point, point.mna.functional(part), s)
        if analysis.source in point.stimulated.columns:
            value, rate = point.drive({analysis.source: 1.0})
            gain += y @ value + s * (y @ rate)
        noisy = [d for d in island.devices if d.name not in silent]
        flickers = {d.name: Flicker.of(elements.get(d.name)) for d in noisy}
        found = [(d.name, n) for d in noisy for n in d.noise(layout, flickers[d.name])]
        signals = sorted({n.signal for _, n in found if n.signal})
        bias = run_op(circuit, replace(request, signals=signals, extra=(), sink=None))
        judge([bias], "raise")
        for name, one in found:
            size = one.density * np.ones(s.size)
            if one.signal:
                size *= abs(float(bias[one.signal][0])) ** one.exponent
            elif one.function is not None:
                size *= abs(_of_function(point, one.function, one.gate)) ** one.exponent
            if one.flickers:
                with np.errstate(divide="ignore"):
                    size /= analysis.frequencies
            response = np.zeros(s.size, complex)
            for row, factor in layout.voltage(one.a, one.b, 1.0):
                response += factor * y[:, row]
            density = size * np.abs(response) ** 2
            densities[name] = densities.get(name, np.zeros(s.size)) + density
    total = np.sum(list(densities.values()), axis=0) if densities else np.zeros(s.size)
    with np.errstate(divide="ignore", invalid="ignore"):
        back = np.where(total > 0.0, total / np.abs(gain) ** 2, 0.0)
    table = {"onoise": np.sqrt(total), "inoise": np.sqrt(back)}
    table |= {f"onoise({name})": np.sqrt(part) for name, part in densities.items()}
    solution = Solution(
        "noise",
        circuit.deck.title,
        "frequency",
        analysis.frequencies,
        table,
        list(table),
        warnings=_left_out(circuit, analysis),
        wall_time=clock.perf_counter() - begin,
    )
    solution.measures["onoise_total"] = math.sqrt(integral(analysis.frequencies, total))
    solution.measures["inoise_total"] = math.sqrt(integral(analysis.frequencies, back))
    hand_over(solution, request.sink)
    return solution


def _of_function(point: Point, number: int, gate: str) -> float:
    """Return a smooth function at the operating point, or its slope by the voltage of a node."""
    if not gate:
        return float(point.functions[number])
    rows = point.mna.layout.voltage(gate, "0", 1.0)
    return math.fsum(factor * float(point.slopes[number, row]) for row, factor in rows)


def integral(x: Floats, y: Floats) -> float:
    """Return the integral of a positive curve whose pieces are powers of the abscissa.

    Examples
    --------
    >>> import numpy as np
    >>> x = np.array([1.0, 10.0, 100.0])
    >>> bool(abs(integral(x, 1.0 / x) - np.log(100.0)) < 1e-12)
    True
    """
    total = 0.0
    for a, b, f, g in zip(x[:-1], x[1:], y[:-1], y[1:], strict=True):
        if not (a > 0.0 and f > 0.0 and g > 0.0):
            total += 0.5 * (b - a) * (f + g)
            continue
        # a f (r^(p + 1) - 1)/(p + 1) with r = b/a and the power p = ln(g/f)/ln r
        ratio = math.log(b / a)
        power = (math.log(g / f) + ratio) if ratio else 1.0
        total += a * f * ratio * (math.expm1(power) / power if power else 1.0)
    return total


def _check(circuit: Circuit, analysis: Noise) -> None:
    """Refuse what cannot be meant."""
    source = next((d for d in circuit.devices if d.name == analysis.source), None)
    if source is None or source.letter not in "vi":
        message = (
            f"the noise is referred to {analysis.source}, which is not a V or I of the circuit"
        )
        raise UsageError(Diagnostic("NS4005", message, analysis.span, "name a source"))
    if any(isinstance(card, PssCard) for card in circuit.deck.analyses):
        raise UsageError(
            Diagnostic(
                "NS4022",
                "the noise of a switching circuit is not computed",
                analysis.span,
                "remove .pss: .noise is about the operating point",
            )
        )


def _left_out(circuit: Circuit, analysis: Noise) -> list[Diagnostic]:
    """Return a warning about flicker noise that is not simulated."""
    flickering = {e.name for e in circuit.deck.elements if Flicker.of(e).kf}
    names = [d.name for d in circuit.devices if d.name in flickering and "flicker" not in d.NOISE]
    if not names:
        return []
    message = f"the flicker noise (kf) of {', '.join(names)} is omitted: they are set-valued"
    return [Diagnostic("NS4023", message, analysis.span, severity="warning")]


def _silent(element: Element) -> bool:
    """Return whether the line of a resistor says that it makes no noise."""
    given = (element.params.get(key) for key in ("noisy", "noise"))
    return any(param is not None and param.value == 0.0 for param in given)
