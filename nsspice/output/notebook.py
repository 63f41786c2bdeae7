"""What a notebook shows of solutions and circuits: a few lines, a table, a small picture."""

from __future__ import annotations

import base64
import io
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING

from ..analyses.signals.signal_names import unit
from ..errors import UsageError
from .si import number

if TYPE_CHECKING:
    from ..analyses.solution.solution import Solution
    from ..circuit import Circuit

#: rows of a table before "... and N more"
_LISTED = 12


def solution_html(solution: Solution) -> str:
    """Return verdict, measures or operating point, and the default picture of a solution."""
    certificate = solution.certificate
    if certificate is None:
        verdict = "not certified"
    else:
        word = "holds" if certificate.passed else "<strong>FAILS</strong>"
        verdict = f"certificate {word}"
    methods = ", ".join(dict.fromkeys(island.method for island in solution.islands))
    parts = [
        f"<p><strong>{escape(solution.title or solution.analysis)}</strong><br>"
        f"{escape(solution.analysis)}, {solution.row_count} points of "
        f"{len(solution.columns)} signals; {escape(methods)}; {verdict}</p>"
    ]
    rows = [(name, f"{value:.9g}") for name, value in solution.measures.items()]
    if solution.analysis == "op" and solution.axis.size:
        rows += [(n, number(float(solution[n][0]), unit(n), 9)) for n in solution.columns]
    parts.append(_table(rows))
    try:
        figure = replace(solution, again=None).plot()  # output points will do, without another run
    except UsageError:  # an operating point has no waveform
        return "".join(parts)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=80)
    picture = base64.b64encode(stream.getvalue()).decode("ascii")
    parts.append(f'<img alt="waveforms" src="data:image/png;base64,{picture}">')
    return "".join(parts)


def circuit_html(circuit: Circuit) -> str:
    """Return title, size and effects of a circuit."""
    title = escape(circuit.deck.title or "circuit")
    rows = [(d.name, "; ".join(str(e) for e in d.effects)) for d in circuit.devices]
    return f"<p><strong>{title}</strong><br>{circuit.size}</p>" + _table(rows)


def _table(rows: list[tuple[str, str]]) -> str:
    if not rows:
        return ""
    body = "".join(f"<tr><td>{escape(a)}</td><td>{escape(b)}</td></tr>" for a, b in rows[:_LISTED])
    if len(rows) > _LISTED:
        body += f"<tr><td colspan=2>... and {len(rows) - _LISTED} more</td></tr>"
    return f"<table>{body}</table>"
