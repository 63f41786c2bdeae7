"""Bode plots: magnitude and phase of responses over the frequency, margins of a loop gain."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analyses.solution.solution import part_of
from ..errors import Diagnostic, UsageError

if TYPE_CHECKING:
    from ..analyses.solution.solution import Solution

_DRAWN = 12  # curves at most: beyond that nothing can be distinguished


def draw_bode(solution: Solution, columns: Sequence[str] | None = None) -> Any:
    """Return the figure of a response: decibels above degrees.

    Parameters
    ----------
    solution : Solution
        Of ``.ac`` or ``.loop``.
    columns : sequence of str, optional
        Complex signals, ``v(out)``; all by default.

    Raises
    ------
    UsageError
        NS4009 with fewer than two frequencies above zero.
    """
    from .plot import COLOURS, new_figure, plain_text

    known = [name[3:-1] for name in solution.columns if name.startswith("re(")]
    names = list(known if columns is None else columns)
    kept = solution.axis > 0.0
    if int(kept.sum()) < 2 or not names:
        raise UsageError(
            Diagnostic(
                "NS4009",
                "there is nothing to draw: a response needs at least two frequencies above zero",
                hint="add frequencies to the card",
            )
        )
    figure = new_figure()
    figure.set_size_inches(9.0, 6.0)
    top, bottom = figure.subplots(2, 1, sharex=True)
    f = solution.axis[kept]
    # what does not respond has no decibels
    shown = [n for n in names if np.any(np.abs(solution[n][kept]) > 0.0)][:_DRAWN]
    for k, name in enumerate(shown):
        response = np.asarray(solution[name][kept], dtype=np.complex128)
        top.semilogx(f, part_of(response, "db"), color=COLOURS[k % len(COLOURS)], label=name)
        bottom.semilogx(f, part_of(response, "p"), color=COLOURS[k % len(COLOURS)], label=name)
    top.set_ylabel("Magnitude [dB]")
    bottom.set_ylabel("Phase [°]")
    bottom.set_xlabel("Frequency [Hz]")
    for panel in (top, bottom):
        panel.grid(visible=True, which="major", color="0.85", linewidth=0.8)
        panel.grid(visible=True, which="minor", color="0.94", linewidth=0.5)
        panel.set_axisbelow(True)
        panel.spines[["top", "right"]].set_visible(False)
        panel.margins(x=0.0)
    if solution.loop is not None:
        for c in solution.loop.crossovers:
            top.axhline(0.0, color="0.6", linewidth=0.7)
            for panel in (top, bottom):
                panel.axvline(c.frequency, color="0.4", linewidth=0.8, linestyle=":")
            bottom.annotate(
                f"phase margin {c.margin:.1f}°",
                (c.frequency, c.margin - 180.0),
                textcoords="offset points",
                xytext=(6, 6),
                fontsize="small",
            )
        for c in solution.loop.reversals:
            top.annotate(
                f"gain margin {c.margin:.1f} dB",
                (c.frequency, -c.margin),
                textcoords="offset points",
                xytext=(6, 6),
                fontsize="small",
            )
    if shown:
        top.legend(frameon=False, fontsize="small")
    figure.align_ylabels([top, bottom])
    figure.suptitle(plain_text(solution.title, 90), fontsize=11)
    return figure
