"""Pictures for dark pages: light text and lines on a dark ground, the same colours of curves."""

from __future__ import annotations

from typing import Any

_GROUND, _TEXT, _GRID, _AXIS = "#1b1e24", "#d9dce1", "#343842", "#7b818c"


def darken(figure: Any) -> None:
    """Turn a finished figure into its dark form."""
    from matplotlib.colors import to_rgb
    from matplotlib.text import Text

    figure.set_facecolor(_GROUND)
    for text in figure.findobj(Text):
        text.set_color(_TEXT)
    for axes in figure.axes:
        axes.set_facecolor(_GROUND)
        axes.tick_params(colors=_TEXT, which="both")
        for spine in axes.spines.values():
            spine.set_edgecolor(_AXIS)
        for line in [*axes.get_xgridlines(), *axes.get_ygridlines()]:
            line.set_color(_GRID)
        for line in axes.lines:
            colour = to_rgb(line.get_color())
            if len(set(colour)) == 1:  # black is one of the colours of curves, grey that of axes
                line.set_color("#f5f5f5" if colour[0] < 0.2 else _GRID)
        for image in axes.images:
            _lighten(image)


def _lighten(image: Any) -> None:
    """Turn the dark grey of gates into a light one."""
    from .strips import GATE

    colours = image.get_array()
    if colours.ndim == 3 and tuple(colours[0, 0, :3]) == GATE:
        colours[:, :, :3] = 0.8
        image.set_data(colours)
