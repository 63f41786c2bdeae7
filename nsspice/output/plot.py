"""Pictures of a solution: voltages, currents and powers in panels above a common axis."""

from __future__ import annotations

import io
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analyses.signals.signal_names import unit
from ..analyses.solution.plot_points import drawn
from ..errors import Diagnostic, UsageError
from .atomic_write import whole
from .dark import darken
from .envelope import band, envelope
from .files import output_error
from .si import number, prefix
from .strips import MOST, conducting, draw_strips, logic

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
_PANELS = 8  # panels of signals without a unit
_LEGEND = 12  # more curves than this take a colour scale and thinner lines
_STILL = 1e-9  # part of a peak: a millionth of a pixel
_SCALE = 25.0  # a signal lower than this part of a panel is a flat line in it
_SCALES = 3  # panels of one unit at most
_MOST = 4  # signals of one unit in a picture for which nobody has chosen
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
    names, gates = _chosen(solution, columns)
    if not names or not solution.axis_name or solution.axis.size < 2:
        raise UsageError(
            Diagnostic(
                "NS4009",
                "there is nothing to draw: the solution has fewer than two rows or no signals",
                hint="plot a .tran or .dc analysis",
            )
        )
    fine = drawn(solution, [*flat(names), *gates])
    if columns is None:
        names = _varying(fine, names)
    panels = panels_of(fine, names)
    begin, end = float(fine.axis[0]), float(fine.axis[-1])
    strips = logic(fine, gates) if gates else []
    if columns is None:
        strips += conducting(solution, begin, end)
    figure = new_figure()
    low = 0.35 + 0.2 * min(len(strips), MOST)
    heights = [2.6] * len(panels) + ([low] if strips else [])
    figure.set_size_inches(9.0, 1.4 + sum(heights))
    grid = {"height_ratios": heights}
    axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, gridspec_kw=grid)[:, 0]
    factor, label = _axis_scale(solution)
    pieces = _pieces(fine)
    for panel, (symbol, members) in zip(axes, panels, strict=False):
        _panel(panel, fine, symbol, members, factor, pieces)
    if strips:
        draw_strips(axes[-1], strips[:MOST], begin / factor, end / factor)
        label += f"   ({len(strips) - MOST} more elements)" if len(strips) > MOST else ""
    axes[-1].set_xlabel(label)
    figure.align_ylabels(axes[: len(panels)])
    figure.suptitle(_title(solution), fontsize=11)
    return finished(figure, path, dark)


def finished(figure: Any, path: str | Path | None, dark: bool) -> Any:
    """Return a figure in its colours, saved if it has a path."""
    if dark:
        darken(figure)
    if path is not None:
        save_figure(figure, Path(path))
    return figure


def flat(columns: Sequence[str | Sequence[str]]) -> list[str]:
    """Return the names of signals and of groups of signals in one list."""
    return [n for item in columns for n in ([item] if isinstance(item, str) else item)]


def _chosen(
    solution: Solution, columns: Sequence[str | Sequence[str]] | None
) -> tuple[list[str | Sequence[str]], Sequence[str]]:
    """Return what is drawn, and which of the signals are gates."""
    if columns is not None:
        return list(columns), ()
    view = solution.view
    if view is not None and solution.axis_name == "time" and view.shown:
        return list(view.shown), view.gates
    shown: list[str | Sequence[str]] = list(solution.columns if view is None else view.shown)
    # of a circuit what has a unit; other systems have none, and a panel for each signal
    return [name for name in shown if unit(str(name))] or list(solution.columns), ()


def _varying(solution: Solution, names: list[str | Sequence[str]]) -> list[str | Sequence[str]]:
    """Return the signals of a default picture that change, and not too many of a unit."""
    if solution.view is None:
        return names
    all_ = flat(names)
    moving = [n for n in all_ if moves(solution[n])]
    units = {unit(n) for n in moving}
    # an output that does not move is shown if nothing else has its unit
    still = [n for n in all_ if "out" in n and unit(n) not in units]
    found = [n for n in all_ if n in moving or n in still] or all_
    return [n for k, n in enumerate(found) if [unit(m) for m in found[:k]].count(unit(n)) < _MOST]


def panels_of(
    solution: Solution, names: Sequence[str | Sequence[str]]
) -> list[tuple[str, list[str]]]:
    """Return the signals of each panel with their unit: one panel for each unit and scale.

    A group of names is a panel as it is.  Signals that would be flat next to larger ones of the
    same unit have a panel of their own.
    """
    panels: list[tuple[str, list[str]]] = []
    loose = [n for n in names if isinstance(n, str)]
    for group in names:
        if not isinstance(group, str):
            units = {unit(n) for n in group}
            panels.append((units.pop() if len(units) == 1 else "", list(group)))
    for symbol in ("V", "A", "W"):
        members = [n for n in loose if unit(n) == symbol]
        panels += [(symbol, part) for part in _by_scale(solution, members)]
    panels += [("", [n]) for n in loose[:_PANELS] if not unit(n)]
    return panels


def _by_scale(solution: Solution, members: list[str]) -> list[list[str]]:
    """Return signals in groups whose peaks are within ``_SCALE`` of each other, largest first."""
    if len(members) > _LEGEND:  # so many are a picture of the whole
        return [members]
    peaks = {name: _peak(solution[name]) for name in members}
    groups: list[list[str]] = []
    top = 0.0
    for name in sorted(members, key=lambda n: -peaks[n]):
        if groups and (peaks[name] == 0.0 or peaks[name] * _SCALE >= top or len(groups) == _SCALES):
            groups[-1].append(name)
        else:
            groups.append([name])
            top = peaks[name]
    return [sorted(group, key=members.index) for group in groups]


def moves(values: Floats) -> bool:
    """Return whether a signal varies by more than its rounding, which cannot be seen."""
    return float(np.ptp(values)) > _STILL * _peak(values)


def _peak(values: Floats) -> float:
    """Return the largest finite magnitude, 0 without any."""
    sizes = np.abs(values)
    sizes = sizes[np.isfinite(sizes)]
    return float(sizes.max()) if sizes.size else 0.0


def new_figure() -> Any:
    """Return an empty figure that needs no display and touches no global state."""
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise UsageError(
            Diagnostic(
                "NS4010",
                "plots need the package matplotlib, which is not installed",
                hint="pip install matplotlib",
            )
        ) from error

    class Picture(Figure):
        """A figure that a notebook shows without any setting."""

        def _repr_png_(self) -> bytes:
            stream = io.BytesIO()
            self.savefig(stream, format="png")
            return stream.getvalue()

    figure = Picture(layout="constrained", dpi=120)
    FigureCanvasAgg(figure)
    return figure


def _title(solution: Solution) -> str:
    title = solution.title or {"tran": "Transient", "dc": "DC sweep"}.get(solution.analysis, "")
    text = plain_text(title, 90)
    if solution.parameters:
        text += "\n" + ", ".join(f"{k} = {number(v)}" for k, v in solution.parameters.items())
    return text


def plain_text(text: str, most: int) -> str:
    """Return a text of a deck as a title: so many characters at most, no formulas."""
    if len(text) > most:
        text = text[: most - 3] + "..."
    return text.replace("$", r"\$")  # a dollar sign would start matplotlib's formula mode


def _axis_unit(name: str) -> str:
    """Return the unit of the axis; that of a swept source follows from its letter."""
    return unit(name) or {"v": "V", "i": "A", "r": "Ω"}.get(name.split(".")[-1][:1], "")


def _axis_scale(solution: Solution) -> tuple[float, str]:
    symbol = _axis_unit(solution.axis_name)
    factor, letter = prefix(float(np.max(np.abs(solution.axis)))) if symbol else (1.0, "")
    if symbol == "°C":
        factor, letter = 1.0, ""
    name = "Time" if solution.axis_name == "time" else solution.axis_name
    return factor, f"{name} [{letter}{symbol}]" if symbol else name


def _pieces(solution: Solution) -> list[slice]:
    """Return the runs of the axis: one for a transient, one per curve of a nested sweep."""
    steps = np.sign(np.diff(solution.axis))
    # the first two rows may be both sides of a jump
    direction = steps[np.flatnonzero(steps)[:1]].sum()
    breaks = [0, *(np.flatnonzero(steps == -direction) + 1).tolist(), solution.axis.size]
    return [slice(a, b) for a, b in pairwise(breaks)]


def _panel(
    panel: Any,
    solution: Solution,
    symbol: str,
    members: list[str],
    x_factor: float,
    pieces: list[slice],
) -> None:
    """Draw the signals of one unit."""
    total = len(members)
    members = _spread(members, _DRAWN)
    peak = max(_peak(solution[name]) for name in members)
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
    panel.axhline(0.0, color="0.6", linewidth=0.7, zorder=0.5)
    panel.margins(x=0.01)
    _flat_limits(panel, peak / factor)
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


def _flat_limits(panel: Any, peak: float) -> None:
    """Keep rounding noise of a constant signal from filling the panel."""
    low, high = panel.get_ylim()
    least = 1e-3 * peak if peak else 1.0
    if high - low < least:
        middle = (low + high) / 2.0
        panel.set_ylim(middle - least, middle + least)


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
