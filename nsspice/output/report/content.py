"""What a report says, as plain data: the page draws it, and nothing is computed there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...analyses.signals.signal_names import unit
from ..si import number
from .waveforms import encode, waveforms

if TYPE_CHECKING:
    from ...analyses.solution.solution import Solution
    from ...circuit import Circuit

#: changes of state that a page holds for each element
_CHANGES = 20_000
#: signals that are switched on when the page is opened
_SHOWN = 4


def content(circuit: Circuit, solutions: Sequence[Solution]) -> dict[str, Any]:
    """Return everything that the page of some runs shows."""
    deck = circuit.deck
    return {
        "title": deck.title or Path(deck.file).name,
        "file": Path(deck.file).name,
        "deck": deck_text(circuit),
        "warnings": [w.render() for w in circuit.warnings],
        "runs": [run(solution) for solution in solutions],
    }


def deck_text(circuit: Circuit) -> str:
    """Return the text of the deck as it was read."""
    path = Path(circuit.deck.file)
    try:
        return path.read_text("utf-8", errors="replace")
    except OSError:  # read from a text or from standard input
        return "\n".join(dict.fromkeys(e.span.text for e in circuit.deck.elements))


def run(solution: Solution) -> dict[str, Any]:
    """Return what is shown of one run."""
    from ..summary import describe

    certificate = solution.certificate
    shown = first_shown(solution)
    signals = waveforms(solution) if solution.axis.size > 1 and solution.axis_name else None
    return {
        "label": label(solution),
        "analysis": solution.analysis,
        "axis": solution.axis_name,
        "axis_unit": unit(solution.axis_name) if solution.axis_name else "",
        "parameters": {k: finite(v) for k, v in solution.parameters.items()},
        "verdict": verdict(solution),
        "summary": describe(solution),
        "waveforms": signals,
        "shown": shown,
        "modes": modes(solution),
        "measures": {k: finite(v) for k, v in solution.measures.items()},
        "jumps": [
            {
                "time": number(j.time, "s"),
                "before": number(j.before, "J"),
                "after": number(j.after, "J"),
                "lost": number(j.lost, "J"),
                "what": ", ".join(
                    [
                        f"{m.element} {number(m.before, m.unit)} → {number(m.after, m.unit)}"
                        for m in j.stores
                    ]
                    + [f"impulse of {p.element} {number(p.value, p.unit)}" for p in j.impulses]
                ),
            }
            for j in solution.jumps[:500]
        ],
        "energy": energy(certificate),
        "values": {
            name: number(float(solution[name][0]), unit(name), 9) for name in solution.columns
        }
        if solution.analysis == "op" and solution.axis.size
        else {},
        "warnings": [w.render() for w in solution.warnings],
    }


def label(solution: Solution) -> str:
    """Return the name of a run: its analysis and the values of its parameters."""
    inner = ", ".join(f"{k} = {number(v)}" for k, v in solution.parameters.items())
    return f"{solution.analysis} {inner}".strip()


def verdict(solution: Solution) -> dict[str, Any]:
    """Return whether the run may be believed, in a word and a sentence."""
    certificate = solution.certificate
    if solution.interrupted:
        return {"state": "partial", "text": "interrupted: valid up to the last point shown"}
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


def modes(solution: Solution) -> list[dict[str, Any]]:
    """Return who conducts when: for each element its first state and the instants of change."""
    times: dict[str, list[float]] = {}
    first: dict[str, bool] = {}
    for event in solution.events:
        if event.element not in first:
            first[event.element] = event.change != "on"
        known = times.setdefault(event.element, [])
        if len(known) < _CHANGES:
            known.append(event.time)
    import numpy as np

    return [
        {"element": name, "on": first[name], "changes": encode(np.array(times[name]), "<f8")}
        for name in sorted(times)
    ]


def first_shown(solution: Solution) -> list[str]:
    """Return the signals that are drawn when the page is opened: outputs and inductor currents."""
    columns: Sequence[str] = solution.columns
    if solution.view is not None:
        columns = [n for n in solution.view.shown if n in solution.columns]
    outputs = [n for n in columns if n.startswith("v(") and "out" in n]
    inductors = [n for n in columns if n.startswith("i(l")]
    voltages = [n for n in columns if n.startswith("v(")]
    currents = [n for n in columns if n.startswith("i(")]
    chosen = outputs[:_SHOWN] or voltages[:_SHOWN]
    return [*chosen, *(inductors[:_SHOWN] or currents[:_SHOWN])]


def finite(value: float) -> float | None:
    """Return a number that JSON knows."""
    return value if math.isfinite(value) else None
