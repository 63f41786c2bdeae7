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


def write_report(circuit: Circuit, solutions: Sequence[Solution], path: str | Path) -> None:
    """Write a self-contained HTML page of some runs.

    It holds the verdict, the waveforms at the engine's own points with exact envelopes, who
    conducts when, measures, jumps, the balance of energy, and the deck with its warnings.  It loads
    nothing from elsewhere.

    Parameters
    ----------
    circuit : Circuit
    solutions : sequence of Solution
        Of one deck; each is a tab of the page.
    path : str or Path

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    assets = files(__package__) / "assets"
    parts = {name: (assets / name).read_text("utf-8") for name in (
        "uplot.min.css", "report.css", "uplot.min.js", "report.js"
    )}  # fmt: skip
    data = content(circuit, solutions)
    text = _PAGE.format(
        version=__version__,
        title=html.escape(str(data["title"])),
        style=parts["uplot.min.css"] + parts["report.css"],
        data=embedded(data),
        script=parts["uplot.min.js"] + "\n" + parts["report.js"],
    )
    try:
        with whole(path) as part:
            part.write_text(text, "utf-8")
    except OSError as error:
        raise output_error(error, str(path)) from error


def embedded(data: object) -> str:
    r"""Return JSON that cannot end the script element it is in.

    Examples
    --------
    >>> embedded("</script>")
    '"\\u003c/script>"'
    """
    return json.dumps(data, allow_nan=False, ensure_ascii=False).replace("<", "\\u003c")
