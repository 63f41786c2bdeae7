"""What a run did, as text for people and as a mapping for programs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ..analyses.names import unit
from .si import number

if TYPE_CHECKING:
    from ..analyses.solution import IslandRun, Solution

_COUNTERS = (
    ("segments", "segment"),
    ("fixed_steps", "implicit step"),
    ("steps", "step"),
    ("events", "event"),
    ("modes", "mode"),
)
_LISTED = 8  # impulses and islands listed before "... and N more"


def describe(solution: Solution) -> str:
    """Return some lines: rows, islands with method and counters, certificate, measures.

    Parameters
    ----------
    solution : Solution
    """
    lines = [_headline(solution)]
    lines += [f"  {_island(island)}" for island in solution.islands[:_LISTED]]
    if len(solution.islands) > _LISTED:
        lines.append(f"  ... and {len(solution.islands) - _LISTED} more islands")
    if solution.certificate is not None:
        c = solution.certificate
        verdict = "holds" if c.passed else "FAILS"
        lines.append(
            f"  certificate {verdict}: laws {c.laws:.1e}, "
            f"complementarity {c.complementarity:.1e} (relative, worst of {c.checks} checks)"
        )
        if c.undetermined:
            lines.append(
                f"  not unique in {_count(c.undetermined, 'step')}: the laws leave a voltage or "
                "current open there, the value nearest to the step before was taken"
            )
    for impulse in solution.impulses[:_LISTED]:
        lines.append(
            f"  impulse at {number(impulse.time, 's')}: {impulse.element} "
            f"{number(impulse.value, impulse.unit)}"
        )
    if len(solution.impulses) > _LISTED:
        lines.append(f"  ... and {len(solution.impulses) - _LISTED} more impulses")
    if solution.measures:
        width = max(map(len, solution.measures))
        lines.append("  measures:")
        for name, value in solution.measures.items():
            text = "not found" if math.isnan(value) else f"{value:.9g}"
            lines.append(f"    {name:<{width}} = {text}")
    if solution.analysis == "op" and solution.axis.size:
        lines += _operating_point(solution)
    return "\n".join(lines)


def _headline(solution: Solution) -> str:
    parts = [f"{solution.analysis}:"]
    if solution.axis_name:
        symbol = unit(solution.axis_name)
        if solution.axis.size:
            first, last = float(solution.axis[0]), float(solution.axis[-1])
            parts.append(f"{solution.axis_name} {number(first, symbol)} to {number(last, symbol)},")
        parts.append(f"{_count(solution.row_count, 'row')} of")
    parts.append(_count(len(solution.columns), "signal"))
    if solution.parameters:
        inner = ", ".join(f"{k} = {v:.6g}" for k, v in solution.parameters.items())
        parts.append(f"with {inner}")
    parts.append(f"in {number(solution.wall_time, 's', 3)}")
    if solution.interrupted:
        parts.append("- INTERRUPTED, the rows so far are kept")
    return " ".join(parts)


def _island(island: IslandRun) -> str:
    how = island.method
    if island.theta is not None and island.step is not None:
        how += f", theta = {island.theta:g}, h = {number(island.step, 's')}"
    stats = island.stats
    counters = [
        _count(int(stats[key]), word)
        for key, word in _COUNTERS
        if stats.get(key) or (key in stats and key != "fixed_steps")
    ]
    size = f"{_count(island.unknowns, 'unknown')}, {_count(island.pairs, 'pair')}"
    text = f"island {island.number}: {island.problem_class} ({size}); {how}: {', '.join(counters)}"
    if stats.get("jumps"):
        text += f", {_count(int(stats['jumps']), 'jump')}"
    if island.note:
        text += f" ({island.note})"
    return text


def _operating_point(solution: Solution) -> list[str]:
    names = solution.columns[:40]
    width = max(map(len, names), default=0)
    lines = [f"    {n:<{width}} = {number(float(solution[n][0]), unit(n), 9)}" for n in names]
    if len(solution.columns) > len(names):
        lines.append(f"    ... and {len(solution.columns) - len(names)} more")
    return lines


def _count(n: int, word: str) -> str:
    return f"{n} {word}" if n == 1 else f"{n} {word}s"


def to_dict(solution: Solution) -> dict[str, Any]:
    """Return everything but the waveforms, JSON-ready; numbers that are not finite become None."""
    axis = solution.axis
    data: dict[str, Any] = {
        "analysis": solution.analysis,
        "title": solution.title,
        "axis": solution.axis_name or None,
        "from": float(axis[0]) if axis.size and solution.axis_name else None,
        "to": float(axis[-1]) if axis.size and solution.axis_name else None,
        "rows": solution.row_count,
        "signals": solution.columns,
        "parameters": solution.parameters,
        "interrupted": solution.interrupted,
        "wall_time": solution.wall_time,
        "islands": [
            {
                "number": i.number,
                "class": i.problem_class,
                "reason": i.reason,
                "method": i.method,
                "theta": i.theta,
                "step": i.step,
                "unknowns": i.unknowns,
                "pairs": i.pairs,
                "stats": i.stats,
                "note": i.note,
            }
            for i in solution.islands
        ],
        "certificate": solution.certificate.to_dict() if solution.certificate else None,
        "events": [
            {"time": e.time, "element": e.element, "change": e.change} for e in solution.events
        ],
        "impulses": [
            {"time": p.time, "element": p.element, "value": p.value, "unit": p.unit}
            for p in solution.impulses
        ],
        "measures": solution.measures,
        "warnings": [w.to_dict() for w in solution.warnings],
    }
    if solution.analysis == "op" and axis.size:
        data["values"] = {name: float(solution[name][0]) for name in solution.columns}
    return {key: _finite(value) for key, value in data.items()}


def _finite(value: Any) -> Any:
    """Return the value with nan and infinity replaced by None: JSON has neither."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return value
