"""What the trials of a deck's effects have shown, as a table, as data and as a picture."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from ..netlist.deck import Deck
from .edits import SET_VALUED, Edit

#: the beginning of a model card up to its parameters
_TYPE = re.compile(r"\s*\.model\s+\S+\s+[^\s(]+\s*\(?", re.IGNORECASE)

Verdict = Literal["drop", "keep", "no cost", "needed", "not tried"]

#: ratio of times beyond which a picture has a logarithmic axis
_FAR = 5.0


@dataclass(frozen=True, slots=True)
class EffectRow:
    """One effect of a deck.

    Parameters
    ----------
    edit : Edit
    change : float
        Largest relative change of a measure when this effect alone is left out.
    worst : str
        The measure that changes most.
    factor : float
        Time of the whole deck over the time without this effect.
    alone : float
        Time of the ideal circuit with this effect over its time without any, nan if not known.
    verdict : {"drop", "keep", "no cost", "needed", "not tried"}
        ``needed``: the deck cannot be run without it; ``no cost``: leaving it out saves nothing.
    reason : str
    """

    edit: Edit
    change: float
    worst: str
    factor: float
    alone: float
    verdict: Verdict
    reason: str = ""


@dataclass(slots=True, eq=False)
class EffectsReport:
    """Which effects of a deck matter, and what they cost.

    Parameters
    ----------
    title : str
    tol : float
        Largest relative change of any measure that the recommendation may make.
    rows : list of EffectRow
        Dropped ones first, by what they save.
    reference : mapping of str to float
        Measures of the deck as it is.
    values : mapping of str to float
        Those of the recommended deck, which has been run.
    seconds : (float, float)
        Processor time of the deck as it is, and of the recommended one [s].
    methods : tuple of (tuple of str, tuple of str)
        The methods of both.
    change : float
        Largest relative change of a measure by the recommendation.
    runs : int
        Runs that were made.
    interrupted : bool
        True if Ctrl-C ended the search: what was known by then is shown.
    compared : float
        Effects were compared up to this time [s], and the recommended deck run to its end; infinite
        if each run went to the end.
    """

    title: str
    tol: float
    rows: list[EffectRow] = field(default_factory=list)
    reference: Mapping[str, float] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    seconds: tuple[float, float] = (math.nan, math.nan)
    methods: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
    change: float = 0.0
    runs: int = 0
    interrupted: bool = False
    compared: float = math.inf

    @property
    def dropped(self) -> list[Edit]:
        """The effects that the recommendation leaves out."""
        return [row.edit for row in self.rows if row.verdict == "drop"]

    @property
    def factor(self) -> float:
        """By how much the recommended deck is faster."""
        return self.seconds[0] / self.seconds[1]

    def text(self) -> str:
        """Return the table that ``nsspice effects`` prints."""
        from ..output.si import number

        width = max((len(r.edit.name) for r in self.rows), default=10)
        lines = [f"{self.title}: {len(self.rows)} effects, {self.runs} runs"]
        if math.isfinite(self.compared):
            until = number(self.compared, "s", 3)
            lines.append(f"  compared up to {until}; the recommendation is confirmed by a full run")
        lines.append("")
        lines.append(
            f"  {'effect':<{width}}  {'parameter':<22} {'change':>9}  {'faster':>7}  verdict"
        )
        for row in self.rows:
            change = "-" if math.isnan(row.change) else f"{row.change:.1e}"
            factor = "-" if math.isnan(row.factor) else f"{row.factor:.2f}x"
            why = f" ({row.reason})" if row.reason else ""
            lines.append(
                f"  {row.edit.name:<{width}}  {row.edit.parameter[:22]:<22} {change:>9}  "
                f"{factor:>7}  {row.verdict}{why}"
            )
        lines.append("")
        if self.interrupted:
            lines.append("  interrupted: the search is not complete")
        if self.dropped:
            before, after = (", ".join(m) for m in self.methods)
            lines.append(
                f"  without the effects that can be dropped: {self.factor:.1f} times faster "
                f"({number(self.seconds[0], 's', 3)}, {before} -> "
                f"{number(self.seconds[1], 's', 3)}, {after}), measures within {self.change:.1e}"
            )
            switches = [edit.owner for edit in self.dropped if edit.kind == "switch"]
            if switches:
                lines.append(
                    f"  {', '.join(switches)}: switches without gate charge; delays and dead times "
                    "change with it, and only measures of what depends on them show that"
                )
        else:
            lines.append("  no effect can be dropped within the tolerance and save time")
        for name, value in self.reference.items():
            lines.append(
                f"    {name} = {value:.9g}, recommended {self.values.get(name, math.nan):.9g}"
            )
        return "\n".join(lines) + "\n"

    def to_dict(self) -> dict[str, Any]:
        """Return everything as a JSON-ready mapping."""
        return {
            "title": self.title,
            "tol": self.tol,
            "runs": self.runs,
            "interrupted": self.interrupted,
            "compared_up_to": _finite(self.compared),
            "effects": [
                {
                    "owner": row.edit.owner,
                    "effect": row.edit.effect,
                    "parameter": row.edit.parameter,
                    "change": _finite(row.change),
                    "worst_measure": row.worst or None,
                    "faster": _finite(row.factor),
                    "cost_alone": _finite(row.alone),
                    "verdict": row.verdict,
                    "reason": row.reason or None,
                }
                for row in self.rows
            ],
            "measures": {k: _finite(v) for k, v in self.reference.items()},
            "recommended": {
                "dropped": [edit.name for edit in self.dropped],
                "measures": {k: _finite(v) for k, v in self.values.items()},
                "change": _finite(self.change),
                "faster": _finite(self.factor),
                "seconds": [_finite(s) for s in self.seconds],
                "methods": [list(m) for m in self.methods],
            },
        }

    def deck(self, source: str, deck: Deck) -> str:
        """Return the text of the deck with the dropped effects as comments.

        Parameters
        ----------
        source : str
            Text of the deck's own file; effects that other files bring are only reported.
        deck : Deck
        """
        lines = source.splitlines()
        notes: list[str] = []
        above: dict[int, list[str]] = {}
        rows = {row.edit: row for row in self.rows}
        bare = _made_bare(deck, self.dropped)
        replaced = _replaced(self.dropped)
        for edit in sorted(self.dropped, key=lambda e: (e.span.line, e.span.column), reverse=True):
            note = (
                f"* removed: {edit.name} ({edit.parameter}), "
                f"which changes measures by {rows[edit].change:.1e}"
            )
            if edit.kind == "lines":
                notes += [note, f".options {edit.parameter}"]
            elif edit.span.file != deck.file:
                notes.append(f"{note}: to be removed in {edit.span.file}")
            else:
                if replaced.get(edit.target, edit) == edit:
                    _leave_out(lines, edit, "ideal" if edit in bare else "")
                above.setdefault(_first_line(lines, edit.span.line - 1), []).append(note)
        for k in sorted(above, reverse=True):
            lines[k:k] = above[k]
        head = (
            f"* recommended by nsspice effects, tolerance {self.tol:g}: {self.factor:.1f} times "
            f"faster, measures within {self.change:.1e}"
        )
        return "\n".join([lines[0], head, *notes, *lines[1:]]) + "\n"

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw importance against cost: what is to the right and below can be removed.

        Returns
        -------
        matplotlib.figure.Figure
        """
        from ..output.axes import decades, label_apart
        from ..output.plot import COLOURS, check_format, new_figure, plain_text, save_figure

        if path is not None:
            check_format(path)
        figure = new_figure()
        panel = figure.subplots()
        figure.set_size_inches(8.0, 5.5)
        labels = []
        shades = {"drop": COLOURS[2], "keep": COLOURS[1], "no cost": COLOURS[0]}
        for row in self.rows:
            if math.isnan(row.factor) or math.isnan(row.change):
                continue
            x, y = max(row.factor, 0.5), max(row.change, 1e-12)
            panel.plot(x, y, "o", color=shades.get(row.verdict, "0.5"))
            labels.append((row.edit.name, (x, y)))
        panel.axhline(self.tol, color="0.4", linestyle="--", linewidth=1.0)
        panel.text(0.99, self.tol, "tolerance ", ha="right", va="bottom", fontsize=8,
                   transform=panel.get_yaxis_transform())  # fmt: skip
        factors = [row.factor for row in self.rows if row.factor > 0.0]
        if factors and max(factors) > _FAR * min(factors):
            decades(panel.xaxis)
        panel.set_yscale("log")
        panel.set_xlabel("faster without it")
        panel.set_ylabel("change of measures without it")
        panel.grid(visible=True, color="0.92")
        for verdict, colour in shades.items():
            panel.plot([], [], "o", color=colour, label=verdict)
        panel.legend(loc="upper left", frameon=False, fontsize="small")
        panel.set_title(plain_text(self.title, 70), fontsize=11)
        label_apart(figure, panel, labels)
        if path is not None:
            save_figure(figure, Path(path))
        return figure


def _leave_out(lines: list[str], edit: Edit, instead: str) -> None:
    """Change the line of an edit."""
    k = edit.span.line - 1
    text = lines[k]
    if edit.kind in ("ideal", "straight"):
        lines[k] = f".model {edit.target} D({edit.key or 'ideal'})"
        for j in range(k + 1, len(lines)):
            if not lines[j].lstrip().startswith("+"):
                break
            lines[j] = f"* {lines[j]}"
    elif edit.kind == "switch":
        lines[k] = _TYPE.sub(r"\g<0> switch ", text, count=1)
    elif edit.kind == "open" and "." not in edit.target:
        lines[k] = f"* {text}"
    else:
        first, last = edit.span.column - 1, edit.span.column - 1 + edit.span.length
        lines[k] = (text[:first] + instead + text[last:]).replace("  ", " ")


def _first_line(lines: list[str], k: int) -> int:
    """Return where the statement of a line begins: a comment goes above all its continuations."""
    while k > 0 and lines[k].lstrip().startswith("+"):
        k -= 1
    return k


def _replaced(dropped: list[Edit]) -> dict[str, Edit]:
    """Return the edit that decides about each card that is replaced as a whole, as `without` does.

    Anything else that is left out of such a card is no longer there.
    """
    whole = [e for e in dropped if e.kind in ("ideal", "straight")]
    return {e.target: e for e in sorted(whole, key=lambda e: e.name)}


def _made_bare(deck: Deck, dropped: list[Edit]) -> set[Edit]:
    """Return one edit of each card that loses all its set-valued parameters.

    Such a card has to say ``ideal``, or it would become that of a junction.
    """
    found = set()
    for element in deck.elements:
        model = element.model
        if model is None or model.type != "d":
            continue
        own = [e for e in dropped if e.kind == "parameter" and e.target == model.name]
        had = {k for k in SET_VALUED if k in model.params}
        if own and had and had <= {e.key for e in own}:
            found.add(next(e for e in own if e.key in had))
    return found


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
