"""Pictures of several tables above one axis: runs of a sweep, versions of a deck."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..analyses.names import unit
from ..errors import Diagnostic, UsageError
from .envelope import envelope
from .plot import check_format, new_figure, save_figure
from .si import prefix

Floats = npt.NDArray[np.float64]

_DASHES = ("-", "--", "-.", ":")
_QUANTITY = {"V": "Voltage", "A": "Current", "W": "Power"}


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
                "there is nothing to draw: no table has such a signal",
                hint="name signals of the header lines with --signals",
            )
        )
    figure = new_figure()
    figure.set_size_inches(9.0, 1.2 + 2.2 * len(shown))
    axes = figure.subplots(len(shown), 1, sharex=True, squeeze=False)[:, 0]
    factor, letter = prefix(max(float(np.abs(s.axis).max()) for s in series))
    for panel, name in zip(axes, shown, strict=True):
        _panel(panel, series, name, factor)
    symbol = unit(series[0].axis_name)
    word = "Time" if series[0].axis_name == "time" else series[0].axis_name
    axes[-1].set_xlabel(f"{word} [{letter}{symbol}]" if symbol else word)
    if len(series) > 1:
        _legend(figure, axes, series)
    figure.align_ylabels(axes)
    if title:
        figure.suptitle(title, fontsize=11)
    if path is not None:
        save_figure(figure, Path(path))
    return figure


def _panel(panel: Any, series: Sequence[Series], name: str, factor: float) -> None:
    """Draw one signal of all tables."""
    symbol = unit(name)
    values = [np.abs(s.signals[name]) for s in series if name in s.signals]
    scale, letter = prefix(max(float(np.nanmax(v)) for v in values)) if symbol else (1.0, "")
    for k, one in enumerate(series):
        if name in one.signals:
            x, y = envelope(one.axis, one.signals[name])
            style = {
                "color": _colour(series, k),
                "linestyle": _DASHES[k % 4 if len(series) < 5 else 0],
            }
            panel.plot(x / factor, y / scale, label=one.label, linewidth=1.4, **style)
    panel.set_ylabel(f"{name} [{letter}{symbol}]" if symbol else name)
    panel.grid(visible=True, color="0.9", linewidth=0.8)
    panel.spines[["top", "right"]].set_visible(False)
    panel.margins(x=0.01)


def _colour(series: Sequence[Series], k: int) -> Any:
    """Return the colour of a table: that of its parameter on a common scale, else its own."""
    from matplotlib import colormaps

    from .plot import COLOURS

    parameters = [s.parameter for s in series]
    if len(series) > 1 and all(p is not None for p in parameters):
        low, high = min(parameters), max(parameters)  # type: ignore[type-var]
        part = (parameters[k] - low) / (high - low) if high > low else 0.5  # type: ignore[operator]
        return colormaps["viridis"](0.05 + 0.85 * float(part))
    if len(series) <= len(COLOURS):
        return COLOURS[k]
    return colormaps["viridis"](0.9 * k / (len(series) - 1))


def _legend(figure: Any, axes: Any, series: Sequence[Series]) -> None:
    """Name the tables: beside the first panel, or by a colour bar where a parameter orders them."""
    parameters = [s.parameter for s in series]
    if len(series) > 8 and all(p is not None for p in parameters):
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        known = [float(p) for p in parameters if p is not None]
        bar = ScalarMappable(Normalize(min(known), max(known)), cmap="viridis")
        figure.colorbar(bar, ax=list(axes), label=series[0].label.partition(" = ")[0])
        return
    axes[0].legend(
        loc="upper left",
        bbox_to_anchor=(1.005, 1.02),
        borderaxespad=0.0,
        frameon=False,
        fontsize="small",
    )
