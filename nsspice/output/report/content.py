"""What a report says, as plain data: the page draws it, and nothing is computed there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...analyses.signals.signal_names import unit
from ...netlist.deck import NoiseCard
from ..chosen import default_shown, pieces_of, swept_unit
from ..colours import is_logarithmic as is_decades
from ..si import number
from .waveforms import ALONE, curves, encode

if TYPE_CHECKING:
    from ...analyses.results.jumps import JumpReport
    from ...analyses.results.spectrum import Spectrum
    from ...analyses.solution.solution import Solution
    from ...circuit import Circuit

#: changes of state that a page holds: of one run, and of all runs where there are several
_CHANGES, _CHANGES_TOGETHER = 400_000, 25_000
#: signals that are switched on when the page is opened, and harmonics of a spectrum
_SHOWN, _HARMONICS = 4, 400
_JUMPS = 500
_PIECES = 200  # curves of a sweep in a sweep
#: analyses whose result is a response about a state that another analysis has certified
_RESPONSES = {
    "ac": "frequency response, linear about the operating point or the periodic steady state",
    "loop": "loop gain, linear about the operating point or the periodic steady state",
    "noise": "noise densities, linear about the operating point",
    "tf": "gain and resistances, linear about the operating point",
    "sp": "scattering parameters, linear about the operating point",
    "pz": "poles and zeros, linear about the operating point",
}


def content(circuit: Circuit, solutions: Sequence[Solution], room: int = ALONE) -> dict[str, Any]:
    """Return everything that the page of some runs shows."""
    deck = circuit.deck
    parts = families(solutions)
    noise = [card for card in deck.analyses if isinstance(card, NoiseCard)]
    return {
        "title": deck.title or Path(deck.file).name,
        "file": Path(deck.file).name,
        "deck": deck_text(circuit),
        "warnings": [w.render() for w in circuit.warnings],
        "input": "A" if noise and noise[0].source.lower().startswith("i") else "V",
        "groups": [group(part, sum(map(len, parts)), room) for part in parts],
    }


def families(solutions: Sequence[Solution]) -> list[list[Solution]]:
    """Return the runs of each analysis card: those of a ``.step`` belong together."""
    parts: list[list[Solution]] = []
    for solution in (s for whole in solutions for s in single_curves(whole)):
        last = parts[-1] if parts else []
        known = [s.parameters for s in last]
        fits = last and last[0].analysis == solution.analysis and solution.parameters
        if fits and solution.parameters not in known:
            last.append(solution)
        else:
            parts.append([solution])
    return parts


def single_curves(solution: Solution) -> list[Solution]:
    """Return a sweep in a sweep as a run for each outer value, anything else as it is."""
    pieces = pieces_of(solution.axis) if solution.analysis == "dc" else []
    if not 1 < len(pieces) <= _PIECES:
        return [solution]
    outer = [n for n in solution.signals if swept_unit(n) and not unit(n)]
    found = []
    for piece in pieces:
        signals = {name: values[piece] for name, values in solution.signals.items()}
        values = {name: float(signals[name][0]) for name in outer}
        changes: dict[str, Any] = {"fine": None, "recording": None, "again": None, "more": None}
        parameters = solution.parameters | values
        axis = solution.axis[piece]
        found.append(
            replace(solution, axis=axis, signals=signals, parameters=parameters, **changes)
        )
    return found


def group(runs: Sequence[Solution], total: int, room: int = ALONE) -> dict[str, Any]:
    """Return what is shown of one analysis: a tab of the page."""
    first = over_parameter(runs) or runs[0]
    name = first.axis_name
    found = [run(solution, total, len(runs), room) for solution in runs]
    if first is not runs[0]:
        found[0]["curves"] = curves(first, first_shown(first))
    return {
        "label": runs[0].analysis,
        "axis": name,
        "axis_unit": unit(name) or swept_unit(name) if name else "",
        "logarithmic": name == "frequency"
        or (first is not runs[0] and is_decades(first.axis.tolist())),
        "parameters": list(runs[0].parameters),
        "shown": first_shown(first),
        "runs": found,
    }


def over_parameter(runs: Sequence[Solution]) -> Solution | None:
    """Return operating points of a ``.step`` as curves over its parameter, None for other runs."""
    single = all(s.analysis == "op" and s.axis.size and len(s.parameters) == 1 for s in runs)
    if not single or len(runs) < 3:
        return None
    name = next(iter(runs[0].parameters))
    ordered = sorted(runs, key=lambda s: s.parameters[name])
    axis = np.array([s.parameters[name] for s in ordered])
    signals = {
        n: np.array([float(s[n][0]) for s in ordered])
        for n in runs[0].columns
        if all(n in s for s in ordered)
    }
    return type(runs[0])("dc", runs[0].title, name, axis, signals)


def deck_text(circuit: Circuit) -> str:
    """Return the text of the deck as it was read."""
    path = Path(circuit.deck.file)
    try:
        return path.read_text("utf-8", errors="replace")
    except OSError:  # read from a text or from standard input
        return "\n".join(dict.fromkeys(e.span.text for e in circuit.deck.elements))


def run(solution: Solution, total: int = 1, siblings: int = 1, room: int = ALONE) -> dict[str, Any]:
    """Return what is shown of one run, of ``total`` runs on the page."""
    from ..summary import describe

    drawable = solution.axis.size > 1 and solution.axis_name
    values = solution.analysis in ("op", "tf", "pz") and solution.axis.size
    shown = first_shown(solution)
    return {
        "label": label(solution, siblings > 1),
        "parameters": {k: finite(v) for k, v in solution.parameters.items()},
        "verdict": verdict(solution),
        "summary": describe(solution),
        "curves": curves(solution, shown, total, room) if drawable else None,
        "modes": modes(solution, total),
        "measures": {k: finite(v) for k, v in solution.measures.items()},
        "jumps": [jump(j) for j in solution.jumps[:_JUMPS]],
        "energy": energy(solution.certificate),
        "values": [
            [name, number(float(solution[name][0]), unit(name), 7)] for name in solution.columns
        ]
        if values
        else [],
        "periodic": periodic(solution),
        "loop": margins(solution),
        "spectra": [spectrum(s) for s in solution.spectra],
        "losses": losses(solution),
        "sensitivities": [
            [s.signal, s.element, finite(0.01 * s.relative if s.value else s.derivative)]
            for s in solution.sensitivities
        ],
        "warnings": [w.render() for w in solution.warnings],
    }


def label(solution: Solution, sibling: bool = False) -> str:
    """Return the name of a run: its analysis, and the values of its parameters."""
    inner = ", ".join(f"{k} = {number(v)}" for k, v in solution.parameters.items())
    return inner if sibling and inner else f"{solution.analysis} {inner}".strip()


def verdict(solution: Solution) -> dict[str, Any]:
    """Return whether the run may be believed, in a word and a sentence."""
    certificate = solution.certificate
    if solution.interrupted:
        return {"state": "partial", "text": "interrupted: valid up to the last point shown"}
    if certificate is None and solution.analysis in _RESPONSES:
        return {"state": "response", "text": _RESPONSES[solution.analysis]}
    if certificate is None:
        return {"state": "none", "text": "no certificate was computed"}
    worst = f"KCL, KVL and constitutive equations to {certificate.laws:.1e}, complementarity to "
    worst += f"{certificate.complementarity:.1e} (relative, {certificate.checks} points)"
    if certificate.passed:
        return {"state": "holds", "text": worst}
    at = f", worst at {certificate.worst}" if certificate.worst else ""
    return {"state": "fails", "text": worst + at}


def energy(certificate: Any) -> list[list[str]]:
    """Return the balance of energy as rows of a table."""
    if certificate is None or certificate.energy is None:
        return []
    e = certificate.energy
    return [
        ["delivered by sources", number(e.delivered, "J")],
        ["dissipated", number(e.dissipated, "J")],
        ["stored, change", number(e.stored, "J")],
        ["lost in jumps", number(e.lost, "J")],
        ["numerical damping", number(e.scheme, "J")],
        ["balance error", f"{e.drift:.1e}"],
    ]


def jump(found: JumpReport) -> dict[str, str]:
    """Return a jump as cells of a table."""
    stores = [
        f"{m.element} {number(m.before, m.unit)} → {number(m.after, m.unit)}" for m in found.stores
    ]
    impulses = [f"impulse of {p.element} {number(p.value, p.unit)}" for p in found.impulses]
    return {
        "time": number(found.time, "s"),
        "before": number(found.before, "J"),
        "after": number(found.after, "J"),
        "lost": number(found.lost, "J"),
        "what": ", ".join(stores + impulses),
    }


def periodic(solution: Solution) -> dict[str, Any] | None:
    """Return period, verdict and multipliers of a steady state."""
    found = solution.periodic
    if found is None or solution.analysis != "pss":
        return None
    shown = [[f"{m.real:.6g}", f"{m.imag:.6g}", f"{abs(m):.6g}"] for m in found.multipliers[:20]]
    return {"period": number(found.period, "s", 9), "verdict": found.verdict, "multipliers": shown}


def margins(solution: Solution) -> dict[str, Any] | None:
    """Return crossovers and reversals of a loop gain, with the phase drawn there."""
    from ..bode import drawn_phase

    if solution.loop is None:
        return None
    gain = next(name[3:-1] for name in solution.columns if name.startswith("re("))
    return {
        "crossovers": [
            [c.frequency, c.margin, drawn_phase(solution, gain, c.frequency, c.margin - 180.0)]
            for c in solution.loop.crossovers
        ],
        "reversals": [
            [c.frequency, c.margin, drawn_phase(solution, gain, c.frequency, -180.0)]
            for c in solution.loop.reversals
        ],
    }


def spectrum(found: Spectrum) -> dict[str, Any]:
    """Return the amplitudes of a signal's harmonics."""
    mean, *amplitudes = found.amplitudes[: _HARMONICS + 1]
    phases = [math.degrees(math.atan2(c.imag, c.real)) for c in found.coefficients[1:]]
    return {
        "signal": found.signal,
        "unit": unit(found.signal),
        "frequency": found.frequency,
        "mean": mean,
        "rms": found.rms,
        "distortion": finite(found.distortion),
        "amplitudes": amplitudes,
        "phases": phases[: len(amplitudes)],
    }


def losses(solution: Solution) -> dict[str, Any] | None:
    """Return the average powers of all elements and their sums."""
    table = solution.powers
    if table is None:
        return None
    return {
        "rows": [
            [r.element, r.power, finite(r.current), r.switching, finite(r.junction)]
            for r in table.rows
        ],
        "delivered": table.delivered,
        "useful": table.useful,
        "lost": table.lost,
        "switching": table.switching,
        "efficiency": table.efficiency,
    }


def modes(solution: Solution, total: int = 1) -> dict[str, Any]:
    """Return who conducts when: for each element its first state and the instants of change.

    An element that changes more often than a page can hold is only counted.
    """
    times: dict[str, list[float]] = {}
    first: dict[str, bool] = {}
    for event in solution.events:
        if event.element not in first:
            first[event.element] = event.change != "on"
        times.setdefault(event.element, []).append(event.time)
    room = _CHANGES if total == 1 else _CHANGES_TOGETHER // total
    kept: list[dict[str, Any]] = []
    for name in sorted(times):
        if len(times[name]) <= room:
            room -= len(times[name])
            changes = encode(np.array(times[name]), "<f8")
            kept.append({"element": name, "on": first[name], "changes": changes})
    return {"elements": kept, "left_out": len(times) - len(kept)}


def first_shown(solution: Solution) -> list[str]:
    """Return the signals that are drawn when the page is opened."""
    if solution.analysis == "noise":
        return ["onoise", "inoise"]
    if solution.axis_name == "frequency":
        from ..bode import responses_shown

        return responses_shown(solution)[: 2 * _SHOWN]
    return default_shown(solution, _SHOWN)


def finite(value: float) -> float | None:
    """Return a number that JSON knows."""
    return value if math.isfinite(value) else None
