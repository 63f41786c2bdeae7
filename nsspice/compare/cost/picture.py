"""The work-precision plot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...output.plot import check_format, new_figure, plain_text, save_figure
from .measure import OWN

if TYPE_CHECKING:
    from .report import CostReport

# distinguishable also with colour-blind eyes and in print (after Okabe and Ito)
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_MARKERS = "os^Dv<>PX*h"
#: lines of the other programs; methods of our own have a colour each in all pictures
_LINES = {"ngspice": "--", "pulsim": "-.", "siconos": ":"}


def _styles(names: Iterable[str]) -> Iterator[dict[str, str]]:
    """Yield the look of each ladder: the line tells the program, the colour its method."""
    counts = Counter[str]()
    for k, name in enumerate(names):
        line = next((line for peer, line in _LINES.items() if name.startswith(peer)), "-")
        place = OWN.index(name) if name in OWN else counts[line]
        counts[line] += 1
        colour = _COLOURS[place % len(_COLOURS)]
        yield {"linestyle": line, "color": colour, "marker": _MARKERS[k % len(_MARKERS)]}


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
    figure = new_figure()
    figure.set_size_inches(7.2, 4.2)
    axes = figure.add_subplot()
    floor = report.reference.error
    ladders = report.ladders()
    for (name, rows), style in zip(ladders.items(), _styles(ladders), strict=True):
        errors = [max(row.error, floor) for row in rows]
        axes.loglog(errors, [row.seconds for row in rows], markersize=5, label=name, **style)
    axes.axvline(floor, color="0.6", linestyle=":", linewidth=1)
    axes.invert_xaxis()
    axes.set_xlabel("largest error, share of the range")
    axes.set_ylabel("time inside the process [s]")
    axes.set_title(plain_text(report.title, 70), fontsize=10)
    axes.grid(True, which="major", color="0.9")
    figure.legend(loc="outside right upper", fontsize=7)  # beside the points, not on them
    if path is not None:
        save_figure(figure, Path(path))
    return figure
