"""Pictures of a sweep: families of curves, contours over two names, histograms."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Diagnostic, UsageError
from ..output.axes import decades
from ..output.plot import check_format, finished, new_figure, plain_text
from ..output.si import number, prefix
from .points import Floats

if TYPE_CHECKING:
    from .table import SweepTable

#: values over several decades go on a logarithmic scale
_DECADES = 30.0
_CURVES = 24  # of one panel; more cannot be distinguished
_LEVELS = 16  # of contours
_QUANTILES = (0.05, 0.5, 0.95)


def family(
    table: SweepTable, measures: Sequence[str] | None, path: str | Path | None = None
) -> Any:
    """Draw measures over the last swept name, a curve for each combination of the others."""
    names = list(measures or table.measures)
    if path is not None:
        check_format(path)
    if not names:
        raise _nothing("the sweep measures nothing")
    figure = new_figure()
    figure.set_size_inches(7.0, 1.2 + 2.2 * len(names))
    last = table.swept[-1]
    x = table[last]
    curves = _curves(table)
    panels = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    colours = _colours(len(curves))
    for axes, name in zip(panels, names, strict=True):
        y = table[name]
        factor, unit = _scale(table, name, y)
        for (label, rows), colour in zip(curves.items(), colours, strict=True):
            order = rows[np.argsort(x[rows], kind="stable")]
            axes.plot(x[order], y[order] / factor, marker=".", color=colour, label=label)
        axes.set_ylabel(_shown(_named(name, unit)))
        axes.grid(alpha=0.3)
    if _is_logarithmic(x):
        decades(panels[-1].xaxis, table.units.get(last, ""))
    panels[-1].set_xlabel(_shown(_named(last, table.units.get(last, ""))))
    if len(curves) > 1:
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside right upper")
    figure.suptitle(_shown(table.title))
    return finished(figure, path, False)


def contours(table: SweepTable, measure: str, path: str | Path | None = None) -> Any:
    """Draw a measure over the two swept names of a grid."""
    if path is not None:
        check_format(path)
    axes_of = table.points.axes
    if axes_of is None or len(axes_of) != 2 or min(a.size for a in axes_of) < 2:
        raise _nothing("a map needs a grid over two names, two values each at least")
    y, x = axes_of
    values = table.grid(measure)
    if not np.isfinite(values).any():
        raise _nothing(f"{measure} has no value at any point")
    figure = new_figure()
    figure.set_size_inches(7.0, 5.0)
    axes = figure.subplots()
    factor, unit = _scale(table, measure, values)
    filled = axes.contourf(x, y, values / factor, _LEVELS, cmap="viridis")
    lines = axes.contour(x, y, values / factor, _LEVELS, colors="white", linewidths=0.4)
    axes.clabel(lines, inline=True, fontsize=7)
    bar = figure.colorbar(filled, ax=axes)
    bar.set_label(_shown(_named(measure, unit)))
    failed = ~np.isfinite(values)
    if failed.any():
        down, right = np.nonzero(failed)
        axes.plot(x[right], y[down], "x", color="red", label="no result")
        axes.legend(loc="upper right")
    for axis, column, label in ((axes.xaxis, x, table.swept[1]), (axes.yaxis, y, table.swept[0])):
        if _is_logarithmic(column):
            decades(axis, table.units.get(label, ""))
        axis.set_label_text(_shown(_named(label, table.units.get(label, ""))))
    axes.set_title(_shown(table.title))
    return finished(figure, path, False)


def histogram(table: SweepTable, measure: str, path: str | Path | None = None) -> Any:
    """Draw how often values of a measure occur."""
    if path is not None:
        check_format(path)
    values = table[measure]
    values = values[np.isfinite(values)]
    if values.size < 2:
        raise _nothing(f"{measure} has fewer than two values")
    unit = table.units.get(measure, "")
    factor, scaled = _scale(table, measure, values)
    figure = new_figure()
    figure.set_size_inches(7.0, 4.0)
    axes = figure.subplots()
    axes.hist(values / factor, bins="auto", color="C0", alpha=0.7)
    for share in _QUANTILES:
        axes.axvline(float(np.quantile(values, share)) / factor, color="black", linestyle="--")
    mean, deviation = float(values.mean()), float(values.std(ddof=1))
    spread = f"mean {number(mean, unit)}, deviation {number(deviation, unit, 3)}"
    text = f"{values.size} points: {spread}; dashed: 5 %, 50 %, 95 %"
    axes.set_title(f"{_shown(table.title)}\n{text}", fontsize=9)
    axes.set_xlabel(_shown(_named(measure, scaled)))
    axes.set_ylabel("points")
    return finished(figure, path, False)


def _curves(table: SweepTable) -> dict[str, Any]:
    """Return the points of each curve by its label: those that share all names but the last."""
    others = table.swept[:-1]
    rows: dict[tuple[float, ...], list[int]] = {}
    for k, point in enumerate(table.points.values[:, :-1].tolist()):
        rows.setdefault(tuple(point), []).append(k)
    if len(rows) > _CURVES:  # samples: every point would be a curve of its own
        return {"": np.arange(len(table))}
    return {
        ", ".join(f"{n} = {v:g}" for n, v in zip(others, key, strict=True)): np.array(found)
        for key, found in rows.items()
    }


def _colours(count: int) -> list[Any]:
    from matplotlib import colormaps

    if count == 1:
        return ["C0"]
    return [colormaps["viridis"](0.9 * k / (count - 1)) for k in range(count)]


def _size(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(np.abs(finite).max(initial=0.0))


def _scale(table: SweepTable, measure: str, values: Floats) -> tuple[float, str]:
    """Return by what a measure is divided, and its unit then: numbers near 1 stay as they are."""
    unit, size = table.units.get(measure, ""), _size(values)
    if measure == "efficiency":
        return 0.01, "%"
    if not unit and 1e-3 <= size < 1e4:
        return 1.0, ""
    factor, letter = prefix(size)
    return factor, letter + unit


def _is_logarithmic(x: Floats) -> bool:
    """Return whether points span decades, or have equal ratios."""
    if x.min() <= 0.0:
        return False
    steps = np.diff(np.log(np.unique(x)))
    return bool(x.max() > _DECADES * x.min() or (steps.size > 1 and np.ptp(steps) < 1e-6))


def _shown(text: str) -> str:
    return plain_text(text)


def _named(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def _nothing(message: str) -> UsageError:
    hint = "name measures in the deck (.measure) or in measures=, and lists of values to sweep"
    return UsageError(Diagnostic("NS4009", message, hint=hint))
