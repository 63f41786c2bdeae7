"""Figures and decks of the pages `docs/gallery/dvi`: their code is run, and draws what it names.

A page holds one block of code, and a second one that sets ``panels``: a mapping of the title of a
panel to its abscissa and its curves by label.  Panels whose title begins with "error" have a
logarithmic axis.
"""

from __future__ import annotations

import io
import os
import re
import textwrap
from pathlib import Path
from typing import Any

import numpy as np

_BLOCK = re.compile(r"^( *)```python\n(.*?)^ *```", flags=re.MULTILINE | re.DOTALL)
_DECK = re.compile(r"^\{\{ deck (\S+) \}\}$", flags=re.MULTILINE)
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")


def pictures(root: Path) -> dict[str, str | bytes]:
    """Return the figures of all pages by the name of their file in the site."""
    pages = sorted((root / "docs" / "gallery" / "dvi").glob("*.md"))
    return {
        f"gallery/dvi/{page.stem}.svg": picture(page, root)
        for page in pages
        if page.stem != "index"
    }


def blocks(text: str) -> list[str]:
    """Return the blocks of Python of a page in their order."""
    return [textwrap.dedent(code) for _, code in _BLOCK.findall(text)]


def picture(page: Path, root: Path) -> bytes:
    """Return the figure of a page."""
    names: dict[str, Any] = {"__name__": page.stem}
    here = Path.cwd()
    os.chdir(root)  # pages name netlists from there
    try:
        for code in blocks(page.read_text("utf-8")):
            exec(compile(code, page.name, "exec"), names)
    finally:
        os.chdir(here)
    return draw(names["panels"])


def draw(panels: dict[str, Any]) -> bytes:
    """Return a picture of panels side by side, two in a row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = (len(panels) + 1) // 2
    figure = Figure(figsize=(9.0, 2.7 * rows), layout="constrained")
    FigureCanvasAgg(figure)
    wide = 1 if len(panels) == 1 else 2
    axes = figure.subplots(rows, wide, squeeze=False).ravel()
    for panel in axes[len(panels) :]:
        panel.set_visible(False)
    for panel, (title, (x, curves)) in zip(axes, panels.items(), strict=False):
        for k, (label, y) in enumerate(curves.items()):
            colour = _COLOURS[k % len(_COLOURS)]
            values = np.asarray(y, dtype=float)
            if title.startswith("error"):
                values = np.where(values > 0.0, values, np.nan)
            panel.plot(x, values, label=label, color=colour, linewidth=1.3)
        if title.startswith("error"):
            panel.set_yscale("log")
        panel.set_title(title, fontsize=10)
        panel.grid(visible=True, color="0.9", linewidth=0.7)
        panel.spines[["top", "right"]].set_visible(False)
        if len(curves) > 1:
            panel.legend(frameon=False, fontsize="small")
    stream = io.BytesIO()
    figure.savefig(stream, format="svg")
    return stream.getvalue()


def with_decks(markdown: str, root: Path) -> str:
    """Return a page with the netlists that it names."""

    def deck(match: re.Match[str]) -> str:
        path = root / "netlists" / f"{match[1]}.net"
        return f'```spice title="{path.name}"\n{path.read_text("utf-8").strip()}\n```'

    return _DECK.sub(deck, markdown)
