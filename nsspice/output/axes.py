"""Axes as engineers write them: 1, 10, 100, 1k and not powers of ten; angles in parts of 90."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .si import number


def decades(axis: Any, unit: str = "") -> None:
    """Make an axis logarithmic, its ticks plain numbers with SI prefix.

    Parameters
    ----------
    axis : matplotlib.axis.Axis
    unit : str
        It is not written; without one numbers have prefixes, too.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis._set_axes_scale("log")
    low, high = axis.get_view_interval()
    short = low > 0.0 and high < 30.0 * low

    def text(value: float, _: Any) -> str:
        return number(value, unit or "1", 3).removesuffix(unit or "1").rstrip()

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if short else (1.0,)))
    axis.set_major_formatter(FuncFormatter(text))
    axis.set_minor_locator(LogLocator(subs=tuple(map(float, range(2, 10))), numticks=200))
    axis.set_minor_formatter(NullFormatter())


def degrees(panel: Any) -> None:
    """Put the ticks of a phase at multiples of 90, 45, 15 or 5 degrees, whichever leaves few."""
    from matplotlib.ticker import MultipleLocator

    low, high = panel.get_ylim()
    steps = (5.0, 15.0, 45.0, 90.0, 180.0, 360.0)
    step = next((s for s in steps if (high - low) / s <= 7.0), None)
    if step is not None and high - low > 3.0:
        panel.yaxis.set_major_locator(MultipleLocator(step))


def label_apart(
    figure: Any, panel: Any, labels: Sequence[tuple[str, tuple[float, float]]]
) -> list[Any]:
    """Write the names of points next to them, moved up or down where they would overlap.

    Parameters
    ----------
    figure, panel
        With final limits and scales.
    labels : sequence of (str, (float, float))
        Text, and the place of its point.

    Returns
    -------
    list of matplotlib.text.Annotation
    """
    from matplotlib.text import Text

    style = {"textcoords": "offset points", "fontsize": 8, "va": "center"}
    line = {"arrowstyle": "-", "color": "0.6", "linewidth": 0.6, "shrinkA": 0, "shrinkB": 3}
    texts: list[Any] = []
    taken: list[Any] = []
    figure.canvas.draw()  # the layout decides where points are
    for text, place in sorted(labels, key=lambda item: (item[1][1], item[0])):
        tries = (0, *(s * k for k in range(1, 60) for s in (11, -11)))
        for down in tries:
            note = panel.annotate(
                text,
                place,
                xytext=(7, down),
                arrowprops=line if down else None,
                **style,
            )
            note.get_window_extent()  # puts it next to its point
            box = Text.get_window_extent(note).padded(1.0)  # without the line to its point
            if down == tries[-1] or not any(box.overlaps(other) for other in taken):
                break
            note.remove()
        taken.append(box)
        texts.append(note)
    return texts
