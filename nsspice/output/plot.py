"""Pictures of a solution: voltages, currents and powers in panels above a common axis."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analyses.solution.plot_points import drawn
from ..errors import Diagnostic, UsageError
from ..lazy import need_library
from .atomic_write import whole
from .chosen import (
    CROWD,
    axis_limits,
    chosen,
    default_shown,
    flat,
    limits,
    panels_of,
    pieces_of,
    swept_unit,
)
from .dark import darken
from .envelope import band, envelope
from .files import output_error
from .si import number, prefix
from .spectrum_plot import draw_spectrum
from .strips import MOST, Strip, conducting, draw_strips, logic
from .tail import last_periods, part

if TYPE_CHECKING:
    from ..analyses.solution.solution import Floats, Solution

#: Picture formats by file name ending.
FORMATS = (".png", ".svg", ".pdf")

_QUANTITY = {"V": "voltage", "A": "current", "W": "power", "s": "time", "°C": "temperature"}
# distinguishable also with colour-blind eyes and in print (after Okabe and Ito)
COLOURS = (
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C564B",
)  # fmt: skip
_DASHES = ("-", "--", ":")
_LEGEND = CROWD  # more curves than this take a colour scale and thinner lines
_SPECTRA = 4  # below the waveforms
_DRAWN = 60  # curves in one panel at most: beyond that nothing can be distinguished


def check_format(path: str | Path) -> None:
    """Raise UsageError unless the file name ends in .png, .svg or .pdf."""
    if Path(path).suffix.lower() not in FORMATS:
        raise UsageError(
            Diagnostic(
                "NS4008",
                f"the picture format is not clear from the name {path}",
                hint="use the extension .png, .svg or .pdf",
            )
        )


def draw(
    solution: Solution,
    path: str | Path | None = None,
    columns: Sequence[str | Sequence[str]] | None = None,
    *,
    dark: bool = False,
) -> Any:
    """Draw the waveforms of a solution, as :meth:`Solution.plot` does."""
    if path is not None:
        check_format(path)
    if solution.analysis == "noise":
        from .noise_plot import draw_noise

        return finished(draw_noise(solution), path, dark)
    if solution.axis_name == "frequency":
        from .bode import draw_bode

        figure = draw_bode(solution, None if columns is None else flat(columns))
        return finished(figure, path, dark)
    names, gates = chosen(solution, columns)
    if not names or not solution.axis_name or solution.axis.size < 2:
        raise UsageError(
            Diagnostic(
                "NS4009",
                "there is nothing to draw: the solution has fewer than two rows or no signals",
                hint="plot a .tran or .dc analysis",
            )
        )
    fine = drawn(solution, [*flat(names), *gates])
    if columns is None and solution.view is not None:
        names = list(default_shown(fine))
    panels = panels_of(fine, names)
    strips = _strips(solution, fine, gates, columns is None)
    window = last_periods(solution)
    tail = None if window is None else part(fine, *window)
    spectra = solution.spectra[:_SPECTRA] if columns is None else []
    heights = [2.6] * len(panels) + ([0.35 + 0.2 * min(len(strips), MOST)] if strips else [])
    figure = new_figure()
    figure.set_size_inches(9.0, 1.4 + sum(heights) + 2.4 * len(spectra))
    grid = figure.add_gridspec(
        len(heights) + len(spectra),
        1 if tail is None else 2,
        height_ratios=heights + [2.2] * len(spectra),
        width_ratios=None if tail is None else (2.2, 1.0),
    )
    _column(figure, grid[: len(heights), 0], fine, panels, strips, heights, tail is None)
    if tail is not None:
        strips = _strips(solution, tail, gates, columns is None)
        _column(figure, grid[: len(heights), 1], tail, panels, strips, heights, True)
    for k, spectrum in enumerate(spectra):
        draw_spectrum(figure.add_subplot(grid[len(heights) + k, :]), spectrum)
    figure.suptitle(title_of(solution), fontsize=11)
    return finished(figure, path, dark)


def _strips(solution: Solution, shown: Solution, gates: Sequence[str], all_: bool) -> list[Strip]:
    """Return the strips of what is shown: gates, and who conducts."""
    begin, end = float(shown.axis[0]), float(shown.axis[-1])
    return [
        *(logic(shown, gates) if gates else []),
        *(conducting(solution, begin, end) if all_ else []),
    ]


def _column(
    figure: Any,
    place: Any,
    shown: Solution,
    panels: Sequence[tuple[str, list[str]]],
    strips: Sequence[Strip],
    heights: Sequence[float],
    named: bool,
) -> None:
    """Draw panels and strips above a common axis; ``named`` with a legend."""
    grid = place.subgridspec(len(heights), 1, height_ratios=heights)
    axes: list[Any] = []
    for k in range(len(panels) + bool(strips)):
        axes.append(figure.add_subplot(grid[k], sharex=axes[0] if axes else None))
        axes[-1].tick_params(labelbottom=k == len(heights) - 1)
    factor, label = _axis_scale(shown)
    pieces = pieces_of(shown.axis)
    for panel, (symbol, members) in zip(axes, panels, strict=False):
        _panel(panel, shown, symbol, members, factor, pieces, named)
    if strips:
        begin, end = float(shown.axis[0]), float(shown.axis[-1])
        draw_strips(axes[-1], strips[:MOST], begin / factor, end / factor)
        label += f"   ({len(strips) - MOST} more elements)" if len(strips) > MOST else ""
    axes[-1].set_xlabel(label)
    figure.align_ylabels(axes[: len(panels)])


def finished(figure: Any, path: str | Path | None, dark: bool) -> Any:
    """Return a figure in its colours, saved if it has a path."""
    if dark:
        darken(figure)
    if path is not None:
        save_figure(figure, Path(path))
    return figure


def new_figure() -> Any:
    """Return an empty figure that needs no display and touches no global state."""
    backend = need_library("matplotlib.backends.backend_agg")

    class Picture(need_library("matplotlib.figure").Figure):  # type: ignore[misc]
        """A figure that a notebook shows without any setting."""

        def _repr_png_(self) -> bytes:
            stream = io.BytesIO()
            self.savefig(stream, format="png")
            return stream.getvalue()

    figure = Picture(layout="constrained", dpi=120)
    backend.FigureCanvasAgg(figure)
    return figure


def title_of(solution: Solution) -> str:
    """Return the title of a run: that of the deck, and the values of its parameters."""
    text = plain_text(solution.title or {"dc": "DC sweep"}.get(solution.analysis, "Transient"))
    if solution.parameters:
        text += "\n" + ", ".join(f"{k} = {number(v)}" for k, v in solution.parameters.items())
    return text


def plain_text(text: str, width: int = 88) -> str:
    """Return a text of a deck as a title: in lines of so many characters, no formulas.

    Examples
    --------
    >>> plain_text("Boost converter at 5 $", 15)
    'Boost converter\\nat 5 \\\\$'
    """
    lines = "\n".join(textwrap.wrap(text, width))
    return lines.replace("$", r"\$")  # a dollar sign would start matplotlib's formula mode


def _axis_scale(solution: Solution) -> tuple[float, str]:
    symbol = swept_unit(solution.axis_name)
    factor, letter = prefix(float(np.max(np.abs(solution.axis)))) if symbol else (1.0, "")
    if symbol == "°C":
        factor, letter = 1.0, ""
    name = "Time" if solution.axis_name == "time" else solution.axis_name
    return factor, f"{name} [{letter}{symbol}]" if symbol else name


def _panel(
    panel: Any,
    solution: Solution,
    symbol: str,
    members: list[str],
    x_factor: float,
    pieces: list[slice],
    named: bool,
) -> None:
    """Draw the signals of one unit."""
    total = len(members)
    members = _spread(members, _DRAWN)
    ends = [limits(solution[name]) for name in members]
    low, high = min(e[0] for e in ends), max(e[1] for e in ends)
    peak = max(abs(low), abs(high))
    factor, letter = prefix(peak) if symbol else (1.0, "")
    crowded = len(members) > _LEGEND
    for k, name in enumerate(members):
        style = _style(k, len(members))
        for j, piece in enumerate(pieces):
            x, y = solution.axis[piece] / x_factor, solution[name][piece] / factor
            _curve(panel, x, y, name if j == 0 else "_", style, crowded)
    if symbol:
        panel.set_ylabel(f"{_QUANTITY[symbol].capitalize()} [{letter}{symbol}]")
    panel.grid(visible=True, color="0.9", linewidth=0.8)
    panel.set_axisbelow(True)
    panel.spines[["top", "right"]].set_visible(False)
    if low <= 0.0 <= high:
        panel.axhline(0.0, color="0.6", linewidth=0.7, zorder=0.5)
    panel.margins(x=0.01)
    panel.set_ylim(*axis_limits(low / factor, high / factor))
    panel.ticklabel_format(axis="y", useOffset=False)  # ripple on a mean: the whole number
    if not named:
        return
    handles, labels = panel.get_legend_handles_labels()
    if crowded:
        handles, labels = _spread(handles, 2 * _LEGEND), _spread(labels, 2 * _LEGEND)
    heading = f"{len(members)} of {total} drawn" if total > len(members) else None
    if len(labels) < len(members):
        heading = f"{heading or f'{total} signals'}, {len(labels)} named"
    panel.legend(
        handles,
        labels,
        title=heading,
        title_fontsize="x-small",
        loc="upper left",
        bbox_to_anchor=(1.005, 1.02),
        borderaxespad=0.0,
        frameon=False,
        fontsize="small" if not crowded else "xx-small",
        ncols=1 if len(labels) <= _LEGEND else 2,
        handlelength=1.6,
    )


def _curve(
    panel: Any, x: Floats, y: Floats, label: str, style: dict[str, Any], crowded: bool
) -> None:
    """Draw one curve: as a line, or as a pale band below the others if it oscillates too fast."""
    filled = None if crowded else band(x, y)
    if filled is None:
        panel.plot(*envelope(x, y), label=label, **style)
        return
    colour = style["color"]
    panel.fill_between(
        filled.x,
        filled.low,
        filled.high,
        where=filled.fast,
        label=label,
        facecolor=colour,
        edgecolor=colour,
        linewidth=0.6,
        alpha=0.25,
        zorder=1.5,
    )
    if filled.slow.any():
        panel.plot(*envelope(x, np.where(filled.slow, y, np.nan)), label="_", **style)


def _spread(items: list[Any], most: int) -> list[Any]:
    """Return at most so many items, evenly taken, with the first and the last."""
    if len(items) <= most:
        return items
    return [items[round(k * (len(items) - 1) / (most - 1))] for k in range(most)]


def _style(k: int, count: int) -> dict[str, Any]:
    """Return colour, dash and width of the k-th of some curves."""
    if count <= _LEGEND:
        colour = COLOURS[k % len(COLOURS)]
        dash = _DASHES[k // len(COLOURS)]
        return {"color": colour, "linestyle": dash, "linewidth": 1.5, "alpha": 0.95}
    from matplotlib import colormaps

    return {"color": colormaps["viridis"](0.95 * k / (count - 1)), "linewidth": 0.9}


def save_figure(figure: Any, path: Path) -> None:
    """Write a figure into a file, whose extension gives the format."""
    from matplotlib import rc_context

    # fixed metadata and identifiers: two runs of a deck give the same picture file
    ending = path.suffix.lower()
    # the name of the program shows a later run that it may replace the file
    known: dict[str, dict[str, Any]] = {
        ".png": {"Software": "nsspice"},
        ".svg": {"Date": None, "Creator": "nsspice"},
        ".pdf": {"CreationDate": None, "Creator": "nsspice"},
    }
    metadata = known.get(ending, {})
    try:
        with rc_context({"svg.hashsalt": "nsspice"}), whole(path) as part:
            figure.savefig(part, metadata=metadata, format=ending[1:])
    except OSError as error:
        raise output_error(error, str(path)) from error
