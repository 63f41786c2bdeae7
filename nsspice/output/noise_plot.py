"""Densities of noise over the frequency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..errors import Diagnostic, UsageError
from .axes import decades

if TYPE_CHECKING:
    from ..analyses.solution.solution import Solution

_DRAWN = 8  # parts at most, the largest


def draw_noise(solution: Solution) -> Any:
    """Return the figure of the noise at the output, of its largest parts, and at the input.

    Parameters
    ----------
    solution : Solution
        Of ``.noise``.

    Raises
    ------
    UsageError
        NS4009 with fewer than two frequencies above zero.
    """
    from .plot import COLOURS, new_figure, title_of

    kept = solution.axis > 0.0
    if int(kept.sum()) < 2:
        raise UsageError(
            Diagnostic(
                "NS4009",
                "there is nothing to draw: noise needs at least two frequencies above zero",
                hint="add frequencies to the card",
            )
        )
    figure = new_figure()
    panel = figure.subplots()
    f = solution.axis[kept]
    parts = [n for n in solution.columns if n.startswith("onoise(")]
    parts.sort(key=lambda n: -float(solution[n][kept].max()))
    for k, name in enumerate(("onoise", "inoise", *parts[:_DRAWN])):
        panel.plot(
            f,
            solution[name][kept],
            color=COLOURS[k % len(COLOURS)],
            linewidth=1.8 if k < 2 else 1.0,
            label=name,
        )
    decades(panel.xaxis, "Hz")
    decades(panel.yaxis, "V")
    panel.set_xlabel("Frequency [Hz]")
    panel.set_ylabel("Noise [V/√Hz; inoise of a current source A/√Hz]")
    panel.grid(visible=True, color="0.9", linewidth=0.6)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    panel.margins(x=0.0)
    panel.legend(frameon=False, fontsize="small")
    figure.suptitle(title_of(solution), fontsize=11)
    return figure
