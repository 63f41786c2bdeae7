"""Colours of a family of runs: the parameter on a scale, linear or logarithmic."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from .si import number

_NAMED = 24  # in a legend
_BAR = 8  # more runs than this are named by a colour bar
_DECADES = 30.0  # values over several decades, one ratio apart, go on a logarithmic scale
_PLAIN = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C564B")


def is_logarithmic(values: Sequence[float]) -> bool:
    """Return whether values spread over decades.

    Examples
    --------
    >>> is_logarithmic([1, 10, 100]), is_logarithmic([1, 2, 3]), is_logarithmic([0, 100])
    (True, False, False)
    """
    return min(values) > 0.0 and max(values) > _DECADES * min(values)


class Scale:
    """What distinguishes the runs of a family: colours, labels, and a legend or a colour bar.

    Parameters
    ----------
    parameters : sequence of mapping
        Values of each run by name; one name orders the runs on a scale.
    labels : sequence of str, optional
        Names of runs without parameters.
    dark : bool
        For a dark page.
    """

    def __init__(
        self,
        parameters: Sequence[Mapping[str, float]],
        labels: Sequence[str] | None = None,
        dark: bool = False,
    ) -> None:
        self.labels = list(
            labels or [", ".join(f"{k} = {number(v)}" for k, v in p.items()) for p in parameters]
        )
        # the dark end of the map would not be seen on dark ground
        self.ends = (0.3, 1.0) if dark else (0.0, 0.9)
        self.values: list[float] | None = None
        self.name = ""
        if len(parameters) > 1 and all(len(p) == 1 for p in parameters):
            self.name = next(iter(parameters[0]))
            self.values = [next(iter(p.values())) for p in parameters]

    def norm(self) -> Any:
        """Return the map from values to 0 .. 1."""
        from matplotlib.colors import LogNorm, Normalize

        values = self.values or [0.0, 1.0]
        return (LogNorm if is_logarithmic(values) else Normalize)(min(values), max(values))

    def map(self) -> Any:
        """Return the colours that lines and bar share."""
        import numpy as np
        from matplotlib import colormaps
        from matplotlib.colors import ListedColormap

        return ListedColormap(colormaps["viridis"](np.linspace(*self.ends, 256)))

    def colour(self, k: int) -> Any:
        """Return the colour of a run."""
        if self.values is not None:
            part = self.norm()(self.values[k]) if max(self.values) > min(self.values) else 0.5
            return self.map()(float(part))
        if len(self.labels) <= len(_PLAIN):
            return _PLAIN[k]
        return self.map()(k / (len(self.labels) - 1))

    def label(self, k: int) -> str:
        """Return the name of a run."""
        return self.labels[k]

    def legend(self, figure: Any, panels: Any) -> None:
        """Name the runs: next to the first panel, or by a bar if one parameter orders them."""
        if self.values is not None and len(self.values) > _BAR:
            from matplotlib.cm import ScalarMappable

            bar = figure.colorbar(ScalarMappable(self.norm(), self.map()), ax=list(panels))
            bar.set_label(self.name)
            if is_logarithmic(self.values):
                from .axes import decades

                decades(bar.ax.yaxis)
            return
        handles, labels = panels[0].get_legend_handles_labels()
        panels[0].legend(
            handles[:_NAMED],
            labels[:_NAMED],
            title=f"{len(labels)} runs, {_NAMED} named" if len(labels) > _NAMED else None,
            title_fontsize="x-small",
            loc="upper left",
            bbox_to_anchor=(1.005, 1.02),
            borderaxespad=0.0,
            frameon=False,
            fontsize="small",
        )
