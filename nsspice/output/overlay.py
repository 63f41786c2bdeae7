"""Pictures of several tables above one axis: runs of a sweep, versions of a deck."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ..analyses.signals.signal_names import unit
from ..analyses.solution.plot_points import drawn
from ..errors import Diagnostic, UsageError
from .bode import draw_bode
from .chosen import axis_limits, limits, moves
from .colours import Scale
from .envelope import envelope
from .plot import check_format, draw, finished, new_figure, plain_text
from .si import number, prefix

if TYPE_CHECKING:
    from ..analyses.solution.solution import Solution

Floats = npt.NDArray[np.float64]

#: panels of a family for which nobody has chosen signals, and curves of one
PANELS, _CURVES = 6, 200
#: so few runs are drawn on the points of the engine, more on their output points
_FINE = 16
_DASHES = ("-", "--", "-.", ":")


@dataclass(frozen=True, slots=True)
class Series:
    """One table to draw.

    Parameters
    ----------
    label : str
        What the legend calls it.
    axis_name : str
    axis : ndarray, shape (k,)
    signals : mapping of str to ndarray, shape (k,)
    parameter : float or None
        Value of the swept parameter: all tables with one share a colour scale.
    """

    label: str
    axis_name: str
    axis: Floats
    signals: Mapping[str, Floats]
    parameter: float | None = None


def overlay(
    series: Sequence[Series],
    names: Sequence[str],
    path: str | Path | None = None,
    title: str = "",
    *,
    dark: bool = False,
) -> Any:
    """Draw the signals that several tables share: a panel a signal, a line a table.

    Parameters
    ----------
    series : sequence of Series
    names : sequence of str
        One panel each, in this order.
    path : str or Path, optional
        Where to save the picture: .png, .svg or .pdf.
    title : str
    dark : bool
        For a dark page.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    UsageError
        NS4009 if no table has one of the signals.
    """
    if path is not None:
        check_format(path)
    shown = [name for name in names if any(name in s.signals for s in series)]
    if not shown:
        raise UsageError(
            Diagnostic(
                "NS4009",
                "there is nothing to draw: no table has these signals",
                hint="name signals from the header lines with --signals",
            )
        )
    figure = new_figure()
    figure.set_size_inches(9.0, 1.2 + 2.2 * len(shown))
    axes = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    factor, letter = prefix(max(float(np.abs(s.axis).max()) for s in series))
    ordered = all(s.parameter is not None for s in series)
    key = series[0].label.partition(" = ")[0]
    known = [{key: float(s.parameter)} for s in series if s.parameter is not None]
    scale = Scale(known if ordered else [{}] * len(series), [s.label for s in series], dark)
    for panel, name in zip(axes, shown, strict=True):
        _panel(panel, series, name, factor, scale)
    symbol = unit(series[0].axis_name)
    word = "Time" if series[0].axis_name == "time" else series[0].axis_name
    axes[-1].set_xlabel(f"{word} [{letter}{symbol}]" if symbol else word)
    if len(series) > 1:
        scale.legend(figure, axes)
    figure.align_ylabels(axes)
    if title:
        figure.suptitle(title, fontsize=11)
    return finished(figure, path, dark)


def plot(
    solutions: Solution | Sequence[Solution],
    path: str | Path | None = None,
    columns: Sequence[str] | None = None,
    *,
    dark: bool = False,
) -> Any:
    """Draw a run, or the runs of a ``.step``: a panel for each signal, the parameter as colour.

    Parameters
    ----------
    solutions : Solution or sequence of Solution
        What :func:`nsspice.run` returns, of one analysis.
    path, columns, dark
        As for :meth:`Solution.plot`.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    UsageError
        NS4009 if none of them has waveforms.
    """
    if not isinstance(solutions, Sequence):
        return draw(solutions, path, columns, dark=dark)
    if len(solutions) == 1:
        return draw(solutions[0], path, columns, dark=dark)
    runs = [s for s in solutions if s.axis_name and s.axis.size > 1]
    if runs and runs[0].analysis in ("ac", "loop", "sp"):
        if path is not None:
            check_format(path)
        return finished(draw_bode(runs, columns), path, dark)
    if len(runs) > _CURVES:
        runs = [runs[k] for k in np.linspace(0, len(runs) - 1, _CURVES).round().astype(int)]
    if columns is None:
        view = runs[0].view if runs else None
        shown = [n for s in runs[:1] for n in (s.columns if view is None else view.shown)]
        varying = [n for n in shown if any(moves(s[n]) for s in runs)]
        apart = [n for n in varying if not _same([s[n] for s in runs])]  # the input is not a family
        names = [n for n in apart or varying or shown if unit(n)][:PANELS]
    else:
        names = list(columns)
    series = []
    for run in runs:
        fine = drawn(run if len(runs) <= _FINE else replace(run, again=None), names)
        values = list(run.parameters.values())
        label = ", ".join(f"{k} = {number(v)}" for k, v in run.parameters.items())
        signals = {n: fine[n] for n in names}
        alone = float(values[0]) if len(values) == 1 else None
        series.append(Series(label or run.title, run.axis_name, fine.axis, signals, alone))
    return overlay(series, names, path, plain_text(runs[0].title) if runs else "", dark=dark)


def _same(waveforms: Sequence[Floats]) -> bool:
    """Return whether all runs have one waveform."""
    first = waveforms[0]
    near = 1e-9 * float(np.ptp(first))
    return len(waveforms) > 1 and all(
        w.shape == first.shape and bool(np.all(np.abs(w - first) <= near)) for w in waveforms[1:]
    )


def _panel(panel: Any, series: Sequence[Series], name: str, factor: float, scale: Scale) -> None:
    """Draw one signal of all tables."""
    symbol = unit(name)
    values = [np.abs(s.signals[name]) for s in series if name in s.signals]
    size, letter = prefix(max(float(np.nanmax(v)) for v in values)) if symbol else (1.0, "")
    for k, one in enumerate(series):
        if name in one.signals:
            x, y = envelope(one.axis, one.signals[name])
            style = {
                "color": scale.colour(k),
                # tables without an order are distinguished in print, too
                "linestyle": _DASHES[k % 4 if len(series) < 5 and one.parameter is None else 0],
            }
            panel.plot(x / factor, y / size, label=one.label, linewidth=1.4, **style)
    ends = [limits(s.signals[name]) for s in series if name in s.signals]
    low, high = min(e[0] for e in ends), max(e[1] for e in ends)
    panel.set_ylim(*axis_limits(low / size, high / size))
    panel.ticklabel_format(axis="y", useOffset=False)
    panel.set_ylabel(f"{name} [{letter}{symbol}]" if symbol else name)
    panel.grid(visible=True, color="0.9", linewidth=0.8)
    panel.spines[["top", "right"]].set_visible(False)
    panel.margins(x=0.01)
