"""Writing the page: content, style and scripts in one file that needs nothing else."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from ... import __version__
from ..atomic_write import whole
from ..files import output_error
from .content import content
from .waveforms import ALONE

if TYPE_CHECKING:
    from ...analyses.solution.solution import Solution
    from ...circuit import Circuit

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="nsspice {version}">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<main id="report"><noscript>The report needs its own script.</noscript></main>
<script id="data" type="application/json">{data}</script>
<script>{script}</script>
</body>
</html>
"""

#: style, library, and the scripts of the page in the order in which each uses those before it
_ASSETS = (
    ("uplot.min.css", "report.css"),
    ("uplot.min.js",),
    ("numbers.js", "curves.js", "panel.js", "tables.js", "explorer.js", "report.js"),
)


def write_report(circuit: Circuit, solutions: Sequence[Solution], path: str | Path) -> None:
    """Write a self-contained HTML page of some runs.

    It holds the verdict, the curves at the engine's own points with exact envelopes, who conducts
    when, measures, margins, spectra, losses, jumps, the balance of energy, and the deck with its
    warnings.  Runs of a ``.step`` are drawn together.  It loads nothing from elsewhere.

    Parameters
    ----------
    circuit : Circuit
    solutions : sequence of Solution
        Of one deck; each analysis is a tab of the page.
    path : str or Path

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    text = page_of(circuit, solutions)
    try:
        with whole(path) as part:
            part.write_text(text, "utf-8")
    except OSError as error:
        raise output_error(error, str(path)) from error


def page_of(circuit: Circuit, solutions: Sequence[Solution], room: int = ALONE) -> str:
    """Return the text of the page; ``room`` is the largest size of the curves of a run [bytes]."""
    assets = files(__package__) / "assets"
    style, library, own = (
        "\n".join((assets / name).read_text("utf-8") for name in names) for names in _ASSETS
    )
    data = content(circuit, solutions, room)
    return _PAGE.format(
        version=__version__,
        title=html.escape(str(data["title"])),
        style=style,
        data=embedded(data),
        script=f'{library}\n(() => {{\n"use strict";\n{own}\n}})();',
    )


def embedded(data: object) -> str:
    r"""Return JSON that cannot end the script element it is in.

    Examples
    --------
    >>> embedded("</script>")
    '"\\u003c/script>"'
    """
    return json.dumps(data, allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")
