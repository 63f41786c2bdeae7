"""Bode plots: magnitude and phase of responses over the frequency, margins of a loop gain."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analyses.solution.solution import part_of
from ..errors import Diagnostic, UsageError
from .axes import decades, degrees

if TYPE_CHECKING:
    from ..analyses.solution.solution import Floats, Solution

_DRAWN = 12  # curves at most: beyond that nothing can be distinguished
_RUNS = 200  # of a family
_FINE = 600  # points of a curve, between which no corner is seen
_MARK = {"color": "0.35", "linewidth": 1.6}
_LABEL = {"textcoords": "offset points", "fontsize": "small"}


def responses_shown(solution: Solution) -> list[str]:
    """Return the complex signals of a default picture: outputs and inductor currents.

    What a source of the deck dictates does not respond: an input is a straight line.
    """
    known = [name[3:-1] for name in solution.columns if name.startswith("re(")]
    view = solution.view
    wanted = [name for name in known if view is not None and name in view.shown]
    outputs = [name for name in known if name.startswith("v(") and "out" in name]
    names = list(dict.fromkeys([*outputs, *wanted])) or known
    bending = [name for name in names if np.ptp(np.abs(solution[name])) > 0.0]
    return bending or names


def drawn_phase(solution: Solution, name: str, frequency: float, angle: float) -> float:
    """Return an angle plus the whole turns that put it on the drawn phase at a frequency [deg]."""
    kept = solution.axis > 0.0
    response = np.asarray(solution[name][kept], dtype=np.complex128)
    there = float(np.interp(np.log(frequency), np.log(solution.axis[kept]), part_of(response, "p")))
    return angle + 360.0 * round((there - angle) / 360.0)


def smooth(f: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return a smooth curve through points of a response, without extremes of its own.

    Examples
    --------
    >>> x, y = smooth(np.geomspace(1.0, 100.0, 9), np.array([0, 0, 1, 4, 9, 4, 1, 0, 0.0]))
    >>> x.size > 50, float(y.max())
    (True, 9.0)
    """
    from scipy.interpolate import PchipInterpolator

    if f.size < 3 or f.size > _FINE or not np.all(np.isfinite(values)) or np.any(np.diff(f) <= 0):
        return f, values
    between = np.geomspace(f[0], f[-1], _FINE)
    x = np.unique(np.concatenate([f, between[1:-1]]))
    return x, PchipInterpolator(np.log(f), values)(np.log(x))


def draw_bode(
    solutions: Solution | Sequence[Solution], columns: Sequence[str] | None = None
) -> Any:
    """Return the figure of a response, or of those of a ``.step``: decibels above degrees.

    Parameters
    ----------
    solutions : Solution or sequence of Solution
        Of ``.ac`` or ``.loop``.
    columns : sequence of str, optional
        Complex signals, ``v(out)``; outputs and inductor currents by default.

    Raises
    ------
    UsageError
        NS4009 with fewer than two frequencies above zero.
    """
    from .colours import Scale
    from .plot import COLOURS, new_figure, plain_text, title_of

    runs = [solutions] if not isinstance(solutions, Sequence) else list(solutions)
    if len(runs) > _RUNS:
        runs = [runs[k] for k in np.linspace(0, len(runs) - 1, _RUNS).round().astype(int)]
    names = list(responses_shown(runs[0]) if columns is None else columns)
    if int((runs[0].axis > 0.0).sum()) < 2 or not names:
        raise UsageError(
            Diagnostic(
                "NS4009",
                "there is nothing to draw: a response needs at least two frequencies above zero",
                hint="add frequencies to the card",
            )
        )
    # what does not respond has no decibels
    shown = [n for n in names if any(np.any(np.abs(s[n]) > 0.0) for s in runs)][:_DRAWN]
    family = len(runs) > 1
    figure = new_figure()
    count = max(1, len(shown)) if family else 1
    figure.set_size_inches(9.0, 0.8 + 5.2 * count)
    panels = figure.subplots(2 * count, 1, sharex=True)
    scale = Scale([s.parameters for s in runs])
    for k, name in enumerate(shown):
        top, bottom = panels[2 * k : 2 * k + 2] if family else panels
        for j, run in enumerate(runs):
            kept = run.axis > 0.0
            f, response = run.axis[kept], np.asarray(run[name][kept], dtype=np.complex128)
            colour = scale.colour(j) if family else COLOURS[k % len(COLOURS)]
            label = scale.label(j) if family else name
            if np.any(np.abs(response) > 0.0):
                for panel, which in ((top, "db"), (bottom, "p")):
                    curve = smooth(f, part_of(response, which))
                    panel.plot(*curve, color=colour, label=label, linewidth=1.5)
    for k in range(count):
        label = f"{shown[k]}: " if family and shown else ""
        panels[2 * k].set_ylabel(f"{label}magnitude [dB]" if label else "Magnitude [dB]")
        panels[2 * k + 1].set_ylabel(f"{label}phase [°]" if label else "Phase [°]")
    for panel in panels:
        decades(panel.xaxis, "Hz")
        panel.grid(visible=True, which="major", color="0.85", linewidth=0.8)
        panel.grid(visible=True, which="minor", color="0.94", linewidth=0.5)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
        panel.margins(x=0.0)
    if not family:
        _margins(runs[0], *panels)
    for panel in panels[1::2]:
        degrees(panel)
    panels[-1].set_xlabel("Frequency [Hz]")
    if family:
        scale.legend(figure, panels)
    elif shown:
        panels[0].legend(frameon=False, fontsize="small")
    figure.align_ylabels(panels)
    figure.suptitle(plain_text(runs[0].title) if family else title_of(runs[0]), fontsize=11)
    return figure


def _margins(solution: Solution, top: Any, bottom: Any) -> None:
    """Mark the margins of a loop gain: their length, from the curve to 0 dB and to -180 degrees."""
    if solution.loop is None:
        return
    gain = next(name[3:-1] for name in solution.columns if name.startswith("re("))
    top.axhline(0.0, color="0.5", linewidth=0.9)
    critical = set()
    for c in solution.loop.crossovers:
        phase = drawn_phase(solution, gain, c.frequency, c.margin - 180.0)
        critical.add(phase - c.margin)
        for panel in (top, bottom):
            panel.axvline(c.frequency, color="0.5", linewidth=0.8, linestyle=":")
        bottom.plot([c.frequency] * 2, [phase - c.margin, phase], **_MARK)
        middle = (c.frequency, phase - 0.5 * c.margin)
        bottom.annotate(f"phase margin {c.margin:.1f}°", middle, xytext=(6, -4), **_LABEL)
    for c in solution.loop.reversals:
        critical.add(drawn_phase(solution, gain, c.frequency, -180.0))
        for panel in (top, bottom):
            panel.axvline(c.frequency, color="0.5", linewidth=0.8, linestyle=":")
        top.plot([c.frequency] * 2, [-c.margin, 0.0], **_MARK)
        middle = (c.frequency, -0.5 * c.margin)
        top.annotate(f"gain margin {c.margin:.1f} dB", middle, xytext=(6, -4), **_LABEL)
    for level in critical or {-180.0}:
        bottom.axhline(level, color="#CF222E", linewidth=0.9, linestyle="--", zorder=1.0)
