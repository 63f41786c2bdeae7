"""The work-precision plot."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...output.plot import check_format, new_figure, plain_text, save_figure
from ...output.si import number
from .measure import OWN

if TYPE_CHECKING:
    from .report import CostReport

# distinguishable also with colour-blind eyes and in print (after Okabe and Ito)
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
_MARKERS = "os^Dv<>PX*h"
#: lines of the other programs: thin, with hollow marks; own methods are thick and filled
_LINES = {"ngspice": "--", "pulsim": "-.", "siconos": ":"}


def _styles(names: Iterable[str]) -> Iterator[dict[str, Any]]:
    """Yield the look of each ladder: the line style shows the program, the colour its method."""
    counts = Counter[str]()
    for k, name in enumerate(names):
        line = next((line for peer, line in _LINES.items() if name.startswith(peer)), "-")
        place = OWN.index(name) if name in OWN else counts[line]
        counts[line] += 1
        colour = _COLOURS[place % len(_COLOURS)]
        own = {"linewidth": 2.2, "markersize": 6, "zorder": 3}
        peer = {"linewidth": 1.0, "markersize": 5, "markerfacecolor": "none", "alpha": 0.8}
        look: dict[str, Any] = own if name in OWN else peer
        yield {"linestyle": line, "color": colour, "marker": _MARKERS[k % len(_MARKERS)], **look}


def draw(report: CostReport, path: str | Path | None = None, target: float | None = None) -> Any:
    """Draw error against time for each method.

    Parameters
    ----------
    report : CostReport
    path : str or Path, optional
        Where to save it: .png, .svg or .pdf.
    target : float, optional
        An error that is wanted: a line, with a ring around the cheapest run that reaches it.
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
        axes.loglog(errors, [row.seconds for row in rows], label=name, **style)
    axes.axvline(floor, color="0.6", linestyle=":", linewidth=1)
    _note(axes, floor, "error of the reference", "0.45")
    if target is not None:
        _mark(axes, report, target)
    axes.invert_xaxis()
    axes.set_xlabel("largest error, relative to the range")
    axes.set_ylabel("time inside the process [s]")
    axes.set_title(plain_text(report.title, 70), fontsize=10)
    axes.grid(True, which="major", color="0.9")
    axes.margins(y=0.1)
    _legend(figure, axes)
    if path is not None:
        save_figure(figure, Path(path))
    return figure


def _note(axes: Any, x: float, text: str, colour: str) -> None:
    """Write along a vertical line."""
    axes.text(x, 0.98, f" {text}", rotation=90, ha="right", va="top", fontsize=7, color=colour,
              transform=axes.get_xaxis_transform())  # fmt: skip


def _mark(axes: Any, report: CostReport, target: float) -> None:
    """Draw the target, the errors that meet it, and a ring around the cheapest run among them."""
    axes.axvline(target, color="0.2", linewidth=1.2)
    beyond = min(target, *axes.get_xlim()) / 10.0
    axes.axvspan(beyond, target, color="#009E73", alpha=0.06)
    axes.set_xlim(left=beyond)
    _note(axes, target, f"target {target:g}", "0.2")
    good = [r for rows in report.ladders().values() for r in rows if r.error <= target]
    if good:
        best = min(good, key=lambda r: r.seconds)
        place = max(best.error, report.reference.error), best.seconds
        axes.plot(*place, "o", markersize=14, markerfacecolor="none", markeredgecolor="0.2",
                  label="_", zorder=4)  # fmt: skip
        what = f"{best.method} {best.setting}".strip()
        axes.annotate(f"{what}, {number(best.seconds, 's', 3)}", place, xytext=(-11, 9),
                      textcoords="offset points", ha="right", fontsize=8)  # fmt: skip


def _legend(figure: Any, axes: Any) -> None:
    """Name the methods next to the points, ours first, other programs under a heading."""
    from matplotlib.lines import Line2D

    handles, labels = axes.get_legend_handles_labels()
    own = [h for h, name in zip(handles, labels, strict=True) if name in OWN]
    peers = [h for h, name in zip(handles, labels, strict=True) if name not in OWN]
    shown = [Line2D([], [], linestyle="none", label="nsspice"), *own] if own else []
    if peers:
        shown += [Line2D([], [], linestyle="none", label="other programs"), *peers]
    legend = figure.legend(handles=shown, loc="outside right upper", fontsize=7, frameon=False)
    for text in legend.get_texts():
        if text.get_text() in ("nsspice", "other programs"):
            text.set_fontweight("bold")
