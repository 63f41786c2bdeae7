"""``.tf`` and ``.sens`` about the operating point: DC gains, and derivatives by elements."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...circuit import Circuit
from ...devices.sources.isource import CurrentSource
from ...devices.sources.vsource import VoltageSource
from ...errors import Diagnostic, Span, UsageError
from ...netlist.deck import TfCard
from ..request.request import Request
from ..request.row_sinks import hand_over
from ..request.sampled import refuse_sampled
from ..results.sensitivity import Sensitivity
from ..signals.signal_names import canonical
from ..solution.solution import Solution
from ..static.statics import op
from .adjoint import adjoint
from .linearised import Complexes, Point, operating_point, respond
from .sensitivity import Slopes, parameters_of, summed
from .stimuli import injection

_DC: Complexes = np.zeros(1, complex)


@dataclass(frozen=True, slots=True)
class Tf:
    """What is asked for.

    Parameters
    ----------
    output : str
        A voltage, or the current of a voltage source.
    source : str
    span : Span or None
        Of the card.
    """

    output: str
    source: str
    span: Span | None = None

    @classmethod
    def from_card(cls, card: TfCard) -> Tf:
        """Return the analysis of a card."""
        return cls(card.output, card.source, card.span)


def run_tf(circuit: Circuit, analysis: Tf, request: Request) -> Solution:
    """Find DC gain, input resistance and output resistance about the operating point.

    Returns
    -------
    Solution
        One row: ``transfer_function``, ``input_resistance`` and ``output_resistance`` [Ohm].
    """
    refuse_sampled(circuit.deck, ".tf", delays=True)
    begin = clock.perf_counter()
    output, name = canonical(analysis.output), analysis.source
    source = next((d for d in circuit.devices if d.name == name), None)
    if not isinstance(source, VoltageSource | CurrentSource):
        message = f".tf: {name} is not a V or I of the circuit"
        raise UsageError(Diagnostic("NS4005", message, analysis.span, "name a source"))
    a, b = source.ends
    own = f"i({name})" if isinstance(source, VoltageSource) else _voltage(a, b)
    gain, seen = _gains(circuit, {name: 1.0}, [output, own], request)
    found = {
        "transfer_function": gain,
        "input_resistance": _over(-1.0, seen) if isinstance(source, VoltageSource) else -seen,
    }
    if output.startswith("v("):
        nodes = [*output[2:-1].split(","), "0"][:2]
        push = {injection(n): sign for n, sign in zip(nodes, (1.0, -1.0), strict=True) if n != "0"}
        found["output_resistance"] = _gains(circuit, push, [output], request)[0]
    else:
        (through,) = _gains(circuit, {output[2:-1]: 1.0}, [output], request)
        found["output_resistance"] = _over(-1.0, through)
    solution = Solution(
        "tf",
        circuit.deck.title,
        "",
        np.zeros(1),
        {k: np.array([v + 0.0]) for k, v in found.items()},
        list(found),
        wall_time=clock.perf_counter() - begin,
    )
    hand_over(solution, request.sink)
    return solution


def _voltage(a: str, b: str) -> str:
    return f"v({a},{b})" if b != "0" else f"v({a})"


def _over(one: float, other: float) -> float:
    return one / other if other else float("inf")


def _gains(
    circuit: Circuit,
    stimuli: Mapping[str, complex],
    outputs: Sequence[str],
    request: Request,
) -> list[float]:
    """Return what stimuli make of signals at 0 Hz."""
    parts = [circuit.parts(name) for name in outputs]
    found = [0.0] * len(outputs)
    for home in sorted({h for terms in parts for h, _, _ in terms}):
        point = operating_point(circuit, circuit.islands[home], stimuli, request, False)
        if not point.stimulated.columns:
            continue
        local = [n for terms in parts for h, n, _ in terms if h == home]
        functionals = [point.stimulated.functional(point.mna, n) for n in local]
        response = iter(respond(point, functionals, _DC, stimuli)[0].real)
        for k, terms in enumerate(parts):
            for h, _, factor in terms:
                if h == home:
                    found[k] += factor * float(next(response))
    return found


def op_sensitivities(
    circuit: Circuit,
    signals: Sequence[str],
    elements: Sequence[str] | None = None,
    *,
    temperature: float | None = None,
    values: Mapping[str, float] | None = None,
) -> list[Sensitivity]:
    """Find how signals of the operating point depend on R, V and I.

    Parameters
    ----------
    circuit : Circuit
    signals : sequence of str
        Voltages and currents.
    elements : sequence of str, optional
        All by default.
    temperature, values
        As for :func:`nsspice.tran`.

    Returns
    -------
    list of Sensitivity
        Signal by signal, the elements with the largest effect first; of C and L it is zero.
    """
    keys = [canonical(name) for name in signals]
    parts = {key: circuit.parts(key) for key in keys}
    wanted = None if elements is None else {name.lower() for name in elements}
    homes: dict[int, dict[str, None]] = {}
    for terms in parts.values():
        for home, part, _ in terms:
            homes.setdefault(home, {})[part] = None
    bias = op(
        circuit,
        signals=[part for local in homes.values() for part in local] or keys,
        temperature=temperature,
        values=values,
    )
    request = Request(temperature=temperature, values=values or {})
    islands: dict[int, Slopes] = {}
    for home, local in homes.items():
        island = circuit.islands[home]
        sources = {
            d.name: 1.0 for d in island.devices if isinstance(d, VoltageSource | CurrentSource)
        }
        point = operating_point(circuit, island, sources, request)
        islands[home] = {
            (name, part): (value, float(bias[part][0]), slope)
            for part in local
            for name, value, slope in _slopes(point, part, wanted, sources)
        }
    for key, terms in parts.items():
        known = {name for home, _, _ in terms for name, _ in islands[home]}
        missing = sorted((wanted or set()) - known)
        if missing:
            message = (
                f"{missing[0]} has no value with respect to which {key} could be differentiated"
            )
            hint = "use R, C, uncoupled L, V and I in the same island"
            raise UsageError(Diagnostic("NS4005", message, hint=hint))
    return summed(circuit, keys, islands)


def _slopes(
    point: Point, signal: str, wanted: set[str] | None, sources: Mapping[str, float]
) -> list[tuple[str, float, float]]:
    """Return element, value and derivative of a signal of an island."""
    mna, n = point.mna, point.system.n
    functional = point.stimulated.functional(mna, signal)
    y = adjoint(point, functional, _DC)[0].real
    found = []
    for parameter in parameters_of(mna, wanted):
        name = parameter.name
        if parameter.driver is None:
            column = point.stimulated.columns[name]
            drive = point.drive({other: float(other == name) for other in sources})[0].real
            slope = float(y @ drive) + sum(f for c, f in functional.u if c == column)
        else:
            seen = sum(f * point.z[j] for j, f in parameter.driver.z)
            slope = seen * sum(y[row] * f for row, f in parameter.entries if row < n)
            if signal == f"i({name})" and parameter.letter == "r":
                slope += seen  # its own law depends on the value, too
        found.append((name, parameter.value, float(slope)))
    return found
