"""Failures of the solvers, described with the names of the circuit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...errors import (
    Diagnostic,
    InfeasibleError,
    NumericalError,
    RegularityError,
    Span,
    StepError,
)
from ...solvers.stepper import UnsolvedStep

#: a voltage so many times above all sources is not one of the circuit
_AWAY = 1e3
#: a residual that falls below this while a voltage grows has no zero, only a limit
_VANISHES = 1e-8
#: the square of more is not a number, and energies are such squares
RANGE = 1e150
_NAMED = 6  # elements or nodes spelt out in one sentence


def named_failure(
    circuit: Circuit,
    mna: MnaSystem,
    problem: UnsolvedStep,
    *,
    starting: bool = False,
    given: bool = False,
    where: str | None = None,
) -> NumericalError:
    """Return the error to raise for a step without a solution.

    Parameters
    ----------
    circuit : Circuit
    mna : MnaSystem
        The island whose step failed.
    problem : UnsolvedStep
    starting : bool
        True if the first state could not be found.
    given : bool
        True if the run begins with given charges and fluxes (``uic``).
    where : str, optional
        The swept values, instead of the time.
    """
    static = where is not None
    if where is None:
        where = "at the start" if starting else f"at t = {problem.time:.9g} s"
    else:
        where = f"at {where}" if where else "in the DC solution"
    if problem.restless is not None:
        return _restless(circuit, mna, problem, where)
    certificate = problem.certificate
    if certificate is None and problem.worst_row is not None:
        return _no_convergence(circuit, mna, problem, where, starting and not given)
    far = None if problem.point is None or static else _beyond_range(mna, problem)
    if far is not None:
        message, hint = grown(*far)
        return StepError(
            Diagnostic("NS3003", message, None, hint), time=problem.time, residual=problem.residual
        )
    if certificate is None:
        message = (
            f"no solution was found {where}, and no contradiction either: the best relative "
            f"residual is {problem.residual:.1e}"
        )
        return StepError(
            Diagnostic("NS3002", message, None, "try another step; please report this deck"),
            time=problem.time,
            residual=problem.residual,
        )
    rows = [int(j) for j in certificate.rows]
    pairs = [int(j) for j in certificate.pairs]
    elements = _unique(
        [mna.row_elements[j] for j in rows if j < len(mna.row_elements)]
        + [mna.pair_elements[j] for j in pairs]
    )
    nodes = _unique(mna.row_nodes[j] for j in rows if j < len(mna.row_nodes))
    elements += _across(mna, nodes, elements)
    parts = []
    if elements:
        parts.append(_list(elements))
    if nodes:
        parts.append(f"node{'s' if len(nodes) > 1 else ''} {_list(nodes)}")
    conflict = " at ".join(parts) or "the elements"
    message = f"the laws of {conflict} contradict each other {where}"
    advice = _advice(elements, nodes, starting and not given, static)
    return InfeasibleError(
        Diagnostic("NS3001", message, _span(circuit, elements), advice),
        elements=elements,
        nodes=nodes,
        time=problem.time,
        residual=problem.residual,
    )


def grown(name: str, time: float) -> tuple[str, str]:
    """Return message and hint for a signal that leaves the range of numbers at a time [s]."""
    return (
        f"{name} exceeds the range of numbers at t = {time:.6g} s: nothing in the circuit "
        f"limits its growth",
        "look for feedback of the wrong sign; stop earlier to see how it grows",
    )


def _beyond_range(mna: MnaSystem, problem: UnsolvedStep) -> tuple[str, float] | None:
    """Return the largest signal and the time [s], None if it is within the range of energies."""
    assert problem.point is not None
    with np.errstate(invalid="ignore"):  # potentials are sums of voltages
        values = {name: abs(value) for name, value in mna.values(problem.point).items()}
    name = max(values, key=lambda name: (math.isnan(values[name]), values[name]))
    return None if values[name] <= RANGE else (name, problem.time)


def _restless(circuit: Circuit, mna: MnaSystem, problem: UnsolvedStep, where: str) -> StepError:
    """Return the error of a switch whose law holds in neither state."""
    name = mna.pair_elements[problem.restless or 0]
    return StepError(
        Diagnostic(
            "NS3007",
            f"{name} has no consistent state {where}: its control closes it when it is open and "
            f"opens it when it is closed",
            _span(circuit, [name]),
            "no stored quantity delays its control: give it hysteresis (VH), or a capacitor that "
            "delays its control",
        ),
        time=problem.time,
        residual=problem.residual,
    )


def chatter(circuit: Circuit, elements: Sequence[str], interval: float) -> Diagnostic:
    """Return the warning of switches that react at multiples of an interval [s] only."""
    one = len(elements) == 1
    chatters, reacts = ("chatters", "it reacts") if one else ("chatter", "they react")
    return Diagnostic(
        "NS3052",
        f"{_list(elements)} {chatters}: without hysteresis, each change immediately drives its "
        f"own control back across the threshold; {reacts} at multiples of {interval:.3g} s "
        "instead",
        _span(circuit, elements),
        "give it hysteresis (VH), or reduce the longest step (the last number of .tran) to let "
        "it react sooner",
        severity="warning",
    )


def resting(circuit: Circuit, found: Mapping[str, float]) -> list[Diagnostic]:
    """Return the warnings of controls that stay at thresholds, first at these times [s] by element.

    Parameters
    ----------
    circuit : Circuit
    found : mapping of str to float
    """
    compared = [name for name in found if circuit.device(name).expressions]
    switches = [name for name in found if name not in compared]
    out = []
    for names, message, hint in (
        (
            switches,
            "a control stays at its threshold, where its switch changes on arrival: ",
            "put the thresholds between the levels of the control (VT, VH)",
        ),
        (
            compared,
            "the two sides of a comparison stay equal, so it has the value that its operator "
            "gives: ",
            "compare with a value between the levels of the signal",
        ),
    ):
        if names:
            times = [f"{name} from t = {found[name]:.9g} s on" for name in names]
            reason = ", so that the result does not depend on rounding"
            place, text = _span(circuit, names), message + _list(times)
            out.append(Diagnostic("NS3056", text, place, hint + reason, severity="warning"))
    return out


def unbounded(circuit: Circuit, mna: MnaSystem, row: int, time: float) -> Diagnostic:
    """Return the warning of a voltage that no step follows, at an unknown and a time [s].

    Junctions are blamed where there are any: else all that is known is that the error of the
    shortest steps is at that unknown.
    """
    node, named = _at_row(mna, row)
    if any(d.smooth and d.letter in ("d", "m", "q") for d in mna.devices):
        place = _list(named or ["a junction"]) if node is None else _node(node, named)
        message = (
            f"the voltage at {place} has no bound at t = {time:.9g} s: junctions without charge "
            f"in the blocking state interrupt the current of a winding, and the result may "
            f"depend on the steps"
        )
        hint = "give the diodes there a capacitance (CJO), or the winding a snubber; compare with "
        hint += "another reltol"
    else:
        place = _list(named or ["an element"]) if node is None else _node(node, named)
        message = (
            f"no step with error control could follow {place} at t = {time:.9g} s, however short: "
            "an implicit step covers the instant, and the result may depend on the steps"
        )
        exact = mna.system.smooth is None
        element = "resistor in series with a capacitor or inductor" if exact else "capacitor"
        hint = f"add a small {element} there; compare with another method or reltol"
    return Diagnostic("NS3053", message, _span(circuit, named), hint, severity="warning")


def high_index(
    circuit: Circuit, mna: MnaSystem, time: float, conducting: Sequence[bool]
) -> StepError:
    """Return the error of a mode with an index above 2 that steps have entered at a time [s]."""
    pairs = zip(mna.pair_elements, conducting, strict=True)
    blocking = _unique(name for name, on in pairs if not on)
    mode = f"while {_list(blocking)} block{'s' * (len(blocking) == 1)} " if blocking else ""
    message = (
        f"from t = {time:.9g} s on {mode}the circuit has an index above 2: some voltage or "
        f"current is a second derivative of a source, and sdirk cannot estimate its errors"
    )
    hint = "put a small resistor in series with the capacitor or inductor there; method=modewise "
    hint += "uses implicit steps, and its certificate shows their numerical damping"
    return StepError(Diagnostic("NS3011", message, _span(circuit, blocking), hint), time=time)


def _at_row(mna: MnaSystem, row: int) -> tuple[str | None, list[str]]:
    """Return the node of a law, None for that of a branch, and the elements in it."""
    node = mna.row_nodes[row] if row < len(mna.row_nodes) else None
    if node is None:
        element = mna.row_elements[row] if row < len(mna.row_elements) else None
        return None, [] if element is None else [element]
    touching = (d for d in mna.devices if node in (d.nodes if d.letter in "mq" else d.ends))
    # the culprits are nonlinear: they are named first
    return node, [d.name for d in sorted(touching, key=lambda d: not d.smooth)]


def _no_convergence(
    circuit: Circuit, mna: MnaSystem, problem: UnsolvedStep, where: str, resting: bool
) -> NumericalError:
    """Return the error of Newton's method, with the law that its best point violates most.

    Of a run whose first state is ``resting``, a static solution, it says how to do without one.
    """
    node, named = _at_row(mna, problem.worst_row or 0)
    if node is not None:
        place = f"the current law of {_node(node, named)}" if named else _node(node, named)
    else:
        place = f"the law of {_list(named)}" if named else "the circuit"
    if math.isfinite(problem.residual):
        amount = f"is violated most, by {problem.residual:.1e} of its terms"
    else:
        amount = "has no finite value at any point tried"
    message = f"Newton's method found no solution {where}: {place} {amount}"
    hint = "check the values there; give .nodeset voltages near the solution, or try another step"
    away = _runaway(mna, problem)
    if away is not None:
        node, volts = away
        if problem.residual <= _VANISHES:
            return _unbounded_solution(problem, where, node, volts)
        message += f"; v({node}) is {volts:.1e} V at the best point, far beyond all sources"
        hint = (
            f"if nothing can carry the current at {node}, put a resistor from there to ground; "
            f"otherwise give .nodeset voltages near the solution, or try another step"
        )
    jumping = [d.name for d in mna.devices if any(e.jumps() for e in d.expressions)]
    if jumping:
        hint = (
            f"{_list(jumping)} may jump back and forth there (if, u, sgn, comparisons): "
            "use a switch with hysteresis (VH), or a gain with limits, limit(1e6*x, low, high)"
        )
    if resting:
        hint += "; a circuit with integrators may have no DC solution: start with uic then"
    return StepError(
        Diagnostic("NS3004", message, _span(circuit, named), hint),
        time=problem.time,
        residual=problem.residual,
    )


def _unbounded_solution(
    problem: UnsolvedStep, where: str, node: str, volts: float
) -> RegularityError:
    """Return the error of a point to which no solution extends: the voltage has no bound there."""
    message = (
        f"the solution loses regularity {where}: v({node}) grows without bound ({volts:.1e} V at "
        f"the last point tried), and no solution exists there"
    )
    hint = "stop the run earlier, or use values for which a solution exists"
    return RegularityError(
        Diagnostic("NS3009", message, None, hint), time=problem.time, residual=problem.residual
    )


def lost_path(method: str, problem: UnsolvedStep) -> StepError:
    """Return the error of a path-following method that has left the path of solutions."""
    message = (
        f"{method} has lost the path of solutions at t = {problem.time:.9g} s: the equations are "
        f"off by {problem.residual:.1e} of their terms there, although they have a solution"
    )
    hint = "use a smaller --step or more correctors (.options correctors=3), or omit the method"
    return StepError(
        Diagnostic("NS3008", message, None, hint), time=problem.time, residual=problem.residual
    )


def _runaway(mna: MnaSystem, problem: UnsolvedStep) -> tuple[str, float] | None:
    """Return a node and its voltage [V] at the best point that no source can give, None without.

    Where nothing carries a current the search continues to ever larger voltages.
    """
    if problem.point is None:
        return None
    most = _AWAY * mna.largest_source
    volts = {
        row: volt
        for row, node in enumerate(mna.row_nodes)
        if node is not None and abs(volt := mna.voltage(node, problem.point)) > most
    }
    if not volts:
        return None
    row = problem.worst_row
    if row not in volts:
        row = max(volts, key=lambda r: abs(volts[r]))
    return str(mna.row_nodes[row]), volts[row]


def _across(mna: MnaSystem, nodes: Sequence[str], known: Sequence[str]) -> list[str]:
    """Return the elements that lead out of the conflicting nodes: the cut-set, sources first."""
    inside = set(nodes)
    cut = [
        device
        for device in mna.devices
        if device.name not in known
        and device.letter != "k"
        and len(inside & set(device.ends)) == 1
        and device.ends[0] != device.ends[1]
    ]
    cut.sort(key=lambda device: device.letter not in "igf")
    return [device.name for device in cut]


def _advice(elements: Sequence[str], nodes: Sequence[str], resting: bool, static: bool) -> str:
    letters = {name.split(".")[-1][0] for name in elements}
    if (nodes and "i" in letters) or ("l" in letters and nodes):
        text = "give the current a path, such as a resistor or a freewheeling diode"
        if resting:
            text += "; or start from initial values with uic"
        return text
    if (resting or static) and nodes:
        path = "give every node a DC path to ground"
        return f"start from initial values with uic, or {path}" if resting else path
    return "put a resistor in series, or check the polarity"


def _unique(names: Iterable[str | None]) -> list[str]:
    return list(dict.fromkeys(name for name in names if name is not None))


def _node(node: str, elements: Sequence[str]) -> str:
    return f"node {node} ({_list(elements)})" if elements else f"node {node}"


def _list(names: Sequence[str]) -> str:
    if len(names) > _NAMED:
        return f"{', '.join(names[:_NAMED])} and {len(names) - _NAMED} more"
    if len(names) > 1:
        return f"{', '.join(names[:-1])} and {names[-1]}"
    return names[0]


def _span(circuit: Circuit, elements: Sequence[str]) -> Span | None:
    """Return the place of the first conflicting element."""
    return circuit.device(elements[0]).span if elements else None
