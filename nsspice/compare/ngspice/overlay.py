"""Pictures of a cross-check: both waveforms above each other, and their difference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...analyses.signals.signal_names import unit
from ...errors import Diagnostic, UsageError
from ...output.plot import check_format, new_figure, save_figure
from ...output.si import prefix
from .cross_check import CrossCheck
from .verdict import difference

#: more signals than this do not fit on a page; the worst ones are drawn
_PANELS = 8


def overlay(check: CrossCheck, path: str | Path | None = None) -> Any:
    """Draw the signals of a cross-check, those that differ most first.

    Parameters
    ----------
    check : CrossCheck
    path : str or Path, optional
        Where to save it: .png, .svg or .pdf.

    Returns
    -------
    matplotlib.figure.Figure
    """
    if path is not None:
        check_format(path)
    solution, run = check.solution, check.run
    if solution.axis.size < 2:
        raise UsageError(
            Diagnostic("NS4009", "there is nothing to draw: an operating point has a single row")
        )
    rows = sorted(check.rows, key=lambda row: -row.share(check.norm))[:_PANELS]
    figure = new_figure()
    figure.set_size_inches(11.0, 1.2 + 1.9 * len(rows))
    axes = figure.subplots(len(rows), 2, sharex=True, squeeze=False)
    symbol = unit(solution.axis_name)
    factor, letter = prefix(float(np.max(np.abs(solution.axis)))) if symbol else (1.0, "")
    transient = check.solution.analysis == "tran"
    x = solution.axis / factor
    other_x = run.axis / factor if transient else x
    for (left, right), row in zip(axes, rows, strict=True):
        own, other = solution[row.signal], run[row.signal]
        scale, size = prefix(float(np.max(np.abs(other), initial=0.0)))
        left.plot(x, own / scale, color="#0072B2", linewidth=1.8, label="nsspice")
        left.plot(other_x, other / scale, color="#D55E00", linestyle="--", label="ngspice")
        left.set_ylabel(f"{row.signal} [{size}{unit(row.signal)}]")
        instants, off = difference(solution, run, row.signal, check.slack)
        small, tiny = prefix(float(np.max(np.abs(off), initial=0.0)))
        right.plot(instants / factor, off / small, color="#000000", linewidth=1.0)
        right.set_ylabel(f"difference [{tiny}{unit(row.signal)}]")
        for panel in (left, right):
            panel.grid(visible=True, color="0.9", linewidth=0.8)
            panel.spines[["top", "right"]].set_visible(False)
    axes[0][0].legend(frameon=False, loc="best")
    name = "Time" if solution.axis_name == "time" else solution.axis_name
    for panel in axes[-1]:
        panel.set_xlabel(f"{name} [{letter}{symbol}]" if symbol else name)
    hidden = len(check.rows) - len(rows)
    title = solution.title.replace("$", r"\$")[:90]
    figure.suptitle(title + (f"  ({hidden} signals agree better)" if hidden > 0 else ""))
    if path is not None:
        save_figure(figure, Path(path))
    return figure
