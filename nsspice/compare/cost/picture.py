"""The work-precision plot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...output.files import output_error
from ...output.plot import check_format

if TYPE_CHECKING:
    from .report import CostReport

# distinguishable also with colour-blind eyes and in print (after Okabe and Ito)
_COLOURS = (
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C564B",
)  # fmt: skip
_MARKERS = "os^Dv<>PX*h"  # not as many as colours, so that no pair of both comes twice


def draw(report: CostReport, path: str | Path | None = None) -> Any:
    """Draw error against time for each method.

    Parameters
    ----------
    report : CostReport
    path : str or Path, optional
        Where to save it: .png, .svg or .pdf.
    """
    if path is not None:
        check_format(path)
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.add_subplot()
    floor = report.reference.error
    for k, (name, rows) in enumerate(report.ladders().items()):
        errors = [max(row.error, floor) for row in rows]
        axes.loglog(
            errors,
            [row.seconds for row in rows],
            marker=_MARKERS[k % len(_MARKERS)],
            color=_COLOURS[k % len(_COLOURS)],
            linestyle="--" if k >= len(_COLOURS) else "-",
            markersize=5,
            label=name,
        )
    axes.axvline(floor, color="0.6", linestyle=":", linewidth=1)
    axes.invert_xaxis()
    axes.set_xlabel("largest error, share of the range")
    axes.set_ylabel("time inside the process [s]")
    axes.set_title(report.title[:70], fontsize=10)
    axes.grid(True, which="major", color="0.9")
    axes.legend(fontsize=7)
    if path is not None:
        try:
            figure.savefig(path, dpi=100)
        except OSError as error:
            raise output_error(error, str(path)) from error
    return figure
