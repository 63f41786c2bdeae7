"""What a run did, as text for people and as a mapping for programs."""

from __future__ import annotations

import cmath
import math
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ..analyses.certificate.certificate import MISSED
from ..analyses.signals.signal_names import unit
from .si import number

if TYPE_CHECKING:
    from ..analyses.certificate.certificate import Certificate
    from ..analyses.results.jumps import JumpReport, Moved
    from ..analyses.results.loop_report import LoopReport
    from ..analyses.results.loss_table import LossTable
    from ..analyses.results.periodic import Periodic
    from ..analyses.results.sensitivity import Sensitivity
    from ..analyses.results.spectrum import Spectrum
    from ..analyses.solution.solution import IslandRun, Solution

_COUNTERS = (
    ("segments", "segment"),
    ("fixed_steps", "implicit step"),
    ("steps", "step"),
    ("events", "event"),
    ("modes", "mode"),
)
_DOUBTFUL = 1e-6  # relative error of a derivative that is reported
_POWERS = 30  # elements listed with their power
_LINES = 30  # harmonics listed
_LISTED = 8  # impulses and islands listed before "... and N more"


def describe(solution: Solution, details: bool = True) -> str:
    """Return some lines: what was asked for, the verdict, and how it was computed.

    Parameters
    ----------
    solution : Solution
    details : bool
        Also islands with method and counters, the balance of energy and Floquet multipliers.
    """
    lines = [_headline(solution)]
    if solution.measures:
        width = max(map(len, solution.measures))
        lines.append("  measures:")
        for name, value in solution.measures.items():
            text = "not found" if math.isnan(value) else f"{value:.9g}"
            lines.append(f"    {name:<{width}} = {text}")
    if solution.analysis in ("op", "tf", "pz") and solution.axis.size:
        lines += _operating_point(solution)
    if solution.loop is not None:
        lines += _loop(solution.loop)
    for spectrum in solution.spectra:
        lines += _spectrum(spectrum)
    if solution.powers is not None:
        lines += _powers(solution.powers)
    if solution.sensitivities:
        lines += _sensitivities(solution.sensitivities)
    if solution.error is not None:
        lines.append(f"  {solution.error.describe()}")
    if solution.periodic is not None:
        lines += _periodic(solution.periodic)[: None if details else 1]
    for jump in solution.jumps[:_LISTED]:
        lines += _jump(jump)
    if len(solution.jumps) > _LISTED:
        lines.append(f"  ... and {len(solution.jumps) - _LISTED} more jumps")
    if solution.certificate is not None:
        lines += _certificate(solution.certificate)
        if details:
            lines += _energy(solution.certificate)
    if details:
        lines += _islands(solution)
    return "\n".join(lines)


def _islands(solution: Solution) -> list[str]:
    """Return how each island was solved, and what decided the cost."""
    lines = []
    for island in solution.islands[:_LISTED]:
        lines.append(f"  {_island(island)}")
        if island.regularity is not None:
            lines.append(f"    solution {island.regularity}")
    if len(solution.islands) > _LISTED:
        lines.append(f"  ... and {len(solution.islands) - _LISTED} more islands")
    if cost := _cost(solution.islands):
        lines.append(f"  cost: {cost}")
    return lines


def _certificate(c: Certificate) -> list[str]:
    """Return the verdict, and what qualifies it."""
    verdict = "holds" if c.passed else "FAILS"
    lines = [
        f"  certificate {verdict}: laws {c.laws:.1e}, complementarity {c.complementarity:.1e} "
        f"(relative, worst of {_count(c.checks, 'point')})"
    ]
    if not c.passed and c.worst:
        lines[0] += f", worst at {c.worst}"
    if c.skipped:
        lines.append(
            f"  not simulated: {c.skipped}: no saved or measured signal depends on them (--all "
            f"simulates them)"
        )
    if c.late > 1.0:
        lines.append(
            "  tolerance not met: the control of a chattering switch overshot its threshold by "
            f"{c.late:.2g} times the tolerance before it was sampled"
        )
    if not c.missed <= MISSED:
        lines.append(f"  tolerance not met: a step errs by {c.missed:.2g} times what was asked")
    if c.several:
        names = ", ".join(c.several[:_LISTED]) + (", ..." if len(c.several) > _LISTED else "")
        lines.append(
            f"  several solutions are possible ({names}): the one nearest to the previous step "
            f"was chosen"
        )
    if c.undetermined:
        lines.append(
            f"  not unique in {_count(c.undetermined, 'step')}: the laws do not determine a "
            f"voltage or current there; the value nearest to the previous step was chosen"
        )
    return lines


def _energy(c: Certificate) -> list[str]:
    """Return the balance of energy."""
    e = c.energy
    if e is None or not (e.steps or e.complete):
        return []
    part = "" if e.complete else f" in {e.steps} of {e.of} steps"
    parts = e.delivered, e.dissipated, e.stored, e.lost, e.scheme
    nothing = sys.float_info.epsilon * max(map(abs, parts))
    shown = [number(v if abs(v) > nothing else 0.0, "J") for v in parts]
    return [
        f"  energy{part}: delivered {shown[0]}, dissipated {shown[1]}, stored {shown[2]}, "
        f"lost in jumps {shown[3]}, numerical damping {shown[4]} "
        f"(error {e.drift:.1e})"
    ]


def _periodic(p: Periodic) -> list[str]:
    """Return the period, the verdict and the largest multipliers."""
    shown = ", ".join(_multiplier(m) for m in p.multipliers[:_LISTED])
    more = ", ..." if len(p.multipliers) > _LISTED else ""
    return [
        f"  periodic steady state: period {number(p.period, 's', 9)}, {p.verdict}; "
        f"{_count(p.steps, 'Newton step')}, {_count(p.periods, 'period')} run, "
        f"residual {p.residual:.1e}",
        f"    Floquet multipliers: {shown or 'none'}{more}",
    ]


def _powers(table: LossTable) -> list[str]:
    """Return the powers of all elements and the efficiency."""
    efficiency = "" if table.efficiency is None else f", efficiency {100 * table.efficiency:.6g} %"
    switching = f", in switching {number(table.switching, 'W')}" if table.switching else ""
    lines = [
        f"  average powers: delivered {number(table.delivered, 'W')}, useful "
        f"{number(table.useful, 'W')}, lost {number(table.lost, 'W')}, in jumps "
        f"{number(table.jumps, 'W')}{switching}{efficiency} (sum of all {table.imbalance:.1e})"
    ]
    largest = max((abs(row.power) for row in table.rows), default=0.0)
    rows = [r for r in table.rows if abs(r.power) > 1e-12 * largest or r.switching]
    width = max((len(row.element) for row in rows), default=0)
    for row in rows[:_POWERS]:
        current = "" if math.isnan(row.current) else f"  rms {number(row.current, 'A')}"
        more = f"  switching {number(row.switching, 'W')}" if row.switching else ""
        more += "" if math.isnan(row.junction) else f"  junction {row.junction:.6g} °C"
        lines.append(f"    {row.element:<{width}} {number(row.power, 'W'):>14}{current}{more}")
    if len(rows) > _POWERS:
        lines.append(f"    ... and {len(rows) - _POWERS} more")
    return lines


def _spectrum(spectrum: Spectrum) -> list[str]:
    """Return the harmonics of a signal, the largest first: order, amplitude, phase."""
    symbol = unit(spectrum.signal)
    thd = "" if math.isnan(spectrum.distortion) else f", THD {100 * spectrum.distortion:.6g} %"
    mean, *others = spectrum.coefficients
    known = mean.real if spectrum.has_line(abs(mean)) else 0.0
    lines = [
        f"  {spectrum.signal} at {number(spectrum.frequency, 'Hz', 9)}: mean "
        f"{number(known, symbol, 9)}, rms {number(spectrum.rms, symbol, 9)}{thd}"
    ]
    amplitudes = {k: 2.0 * abs(c) for k, c in enumerate(others, 1)}
    seen = [k for k, size in amplitudes.items() if spectrum.has_line(size)]
    for k in sorted(seen, key=lambda k: -amplitudes[k])[:_LINES]:
        phase = f"{math.degrees(cmath.phase(others[k - 1])):.4g}°"
        lines.append(f"    {k:>3} {number(amplitudes[k], symbol, 9):>16} {phase:>9}")
    if len(seen) > _LINES:
        lines.append(f"    ... and {len(seen) - _LINES} smaller ones")
    if len(seen) < len(others):
        lines.append(f"    {_count(len(others) - len(seen), 'other')} zero to rounding")
    return lines


def _sensitivities(found: list[Sensitivity]) -> list[str]:
    """Return what a change of each element by 1 % does to averages."""
    what = "measures" if found[0].error is not None else "averages"
    lines = [f"  {what}, and their change for a change of 1 % (for a source of 0: by 1 unit):"]
    for s in found[:_POWERS]:
        symbol = unit(s.signal) if s.error is None else ""
        change = 0.01 * s.relative if s.value else s.derivative
        line = f"    {s.signal} = {number(s.average, symbol, 9)}: {s.element} "
        line += number(change, symbol)
        if s.error is not None and s.error > _DOUBTFUL * abs(s.derivative):
            line += f" (to {number(0.01 * s.error * abs(s.value), symbol)})"
        lines.append(line)
    if len(found) > _POWERS:
        lines.append(f"    ... and {len(found) - _POWERS} more")
    return lines


def _loop(report: LoopReport) -> list[str]:
    """Return crossovers and margins of a loop gain."""
    lines = [
        f"  crossover at {number(c.frequency, 'Hz')}, phase margin {c.margin:.4g}°"
        for c in report.crossovers[:_LISTED]
    ] or ["  no crossover within these frequencies"]
    return lines + [
        f"  phase -180° at {number(c.frequency, 'Hz')}, gain margin {c.margin:.4g} dB"
        for c in report.reversals[:_LISTED]
    ]


def _multiplier(m: complex) -> str:
    if m.imag == 0.0:
        return f"{m.real:.6g}"
    return f"{m.real:.6g}{'+' if m.imag > 0 else '-'}{abs(m.imag):.6g}i"


def _jump(jump: JumpReport) -> list[str]:
    """Return what a jump moved and what it cost."""
    given = f" + {number(jump.delivered, 'J')} from sources" if jump.delivered else ""
    lost = "" if abs(jump.lost) < 1e-12 * max(jump.before, jump.after) else number(jump.lost, "J")
    lines = [
        f"  jump at {number(jump.time, 's')}: energy {number(jump.before, 'J')}{given} -> "
        f"{number(jump.after, 'J')}, lost {lost or '0 J'}"
    ]
    for kind, items in (
        ("", [f"{m.element} {_change(m)}" for m in jump.stores]),
        ("impulse of ", [f"{p.element} {number(p.value, p.unit)}" for p in jump.impulses]),
    ):
        if items:
            more = f", ... ({len(items)})" if len(items) > _LISTED else ""
            lines.append(f"    {kind}{', '.join(items[:_LISTED])}{more}")
    return lines


def _change(moved: Moved) -> str:
    return f"{number(moved.before, moved.unit)} -> {number(moved.after, moved.unit)}"


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
    if island.reltol is not None and island.step is not None:
        how += f", reltol = {island.reltol:g}, h <= {number(island.step, 's')}"
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
    if stats.get("grid_residual"):
        text += f", laws hold to {stats['grid_residual']:.1e} at the points"
    return text


def _cost(islands: Sequence[IslandRun]) -> str:
    """Return what decides the cost of the island that had most to do."""

    def work(island: IslandRun) -> float:
        return island.unknowns * sum(float(island.stats.get(k, 0)) for k in ("steps", "segments"))

    most = max(islands, key=work, default=None)
    if most is None or not most.cost:
        return ""
    return most.cost if len(islands) == 1 else f"island {most.number}: {most.cost}"


def _operating_point(solution: Solution) -> list[str]:
    if solution.analysis == "pz":
        return _roots(solution)
    names = solution.columns[:40]
    width = max(map(len, names), default=0)
    lines = [f"    {n:<{width}} = {number(float(solution[n][0]), unit(n), 9)}" for n in names]
    if len(solution.columns) > len(names):
        lines.append(f"    ... and {len(solution.columns) - len(names)} more")
    return lines


def _roots(solution: Solution) -> list[str]:
    """Return poles and zeros, conjugate pairs in one line."""
    lines = []
    for name in (column[3:-1] for column in solution.columns[::2]):
        value = complex(solution[name][0])
        if value.imag < 0.0:
            continue
        text = f"{value.real:.9g} +- {value.imag:.9g}j" if value.imag else f"{value.real:.9g}"
        lines.append(f"    {name} = {text} rad/s")
    return lines or ["    none"]


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
                "reltol": i.reltol,
                "unknowns": i.unknowns,
                "pairs": i.pairs,
                "stats": i.stats,
                "regularity": i.regularity.to_dict() if i.regularity else None,
                "note": i.note,
                "cost": i.cost,
                "unwatched": i.unwatched,
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
        "jumps": [
            {
                "time": j.time,
                "energy_before": j.before,
                "energy_after": j.after,
                "delivered": j.delivered,
                "lost": j.lost,
                "stores": [
                    {"element": m.element, "before": m.before, "after": m.after, "unit": m.unit}
                    for m in j.stores
                ],
                "impulses": [
                    {"element": p.element, "value": p.value, "unit": p.unit} for p in j.impulses
                ],
            }
            for j in solution.jumps
        ],
        "error": solution.error.to_dict() if solution.error else None,
        "sensitivities": [
            {
                "signal": s.signal,
                "element": s.element,
                "value": s.value,
                "average": s.average,
                "derivative": s.derivative,
                "error": s.error,
            }
            for s in solution.sensitivities
        ],
        "powers": solution.powers.to_dict() if solution.powers else None,
        "spectra": [spectrum.to_dict() for spectrum in solution.spectra],
        "loop": solution.loop.to_dict() if solution.loop else None,
        "periodic": solution.periodic.to_dict() if solution.periodic else None,
        "measures": solution.measures,
        "warnings": [w.to_dict() for w in solution.warnings],
    }
    if solution.analysis in ("op", "tf", "pz") and axis.size:
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
