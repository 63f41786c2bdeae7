"""From a deck of any dialect to a clean one, with a note for each difference."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

from ...circuit.build import build, completed, read_devices
from ...errors import Diagnostic, NetlistError, Span, UsageError
from ...netlist.cards.options import OWN
from ...netlist.deck import Deck, Param
from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import show
from ...netlist.findings import Findings
from ...netlist.parsing import Reading, reading_of, text_of
from .deck_text import deck_text

#: what of a deck says where it comes from, and nothing of what is computed
_ORIGIN = {"title", "file", "warnings", "source", "included", "confined", "overrides", "seed"}


@dataclass(frozen=True, slots=True)
class Conversion:
    """A clean deck.

    Parameters
    ----------
    text : str
    notes : tuple of str
        What the first deck said and the clean one does not, or says in other words.
    """

    text: str
    notes: tuple[str, ...]


def convert(source: str | Path, *, confined: bool = False) -> Conversion:
    """Return what was understood of a deck as a clean one, which depends on no other file.

    Parameters
    ----------
    source : str or Path
        A file, or the text of a deck.
    confined : bool
        Whether files outside of the deck's folder are refused.

    Raises
    ------
    NetlistError, TopologyError
        For a deck that cannot be simulated.
    UsageError
        NS4032 if the clean deck would not be the same circuit.

    Examples
    --------
    >>> clean = convert('''lamp
    ... R1 a 0 2k2 tol=5
    ... V1 a 0 SINE(0 10
    ... + 50)
    ... .options gmin=1e-12
    ... .tran 1m 20m
    ... ''')
    >>> print(clean.text)
    lamp
    R1 a 0 2k
    V1 a 0 SIN(0 10 50)
    .tran 1m 20m
    .end
    <BLANKLINE>
    >>> [note.partition(": ")[2] for note in clean.notes]
    ['2k2 is read as 2000: digits after the suffix are ignored', 'option gmin is ignored']
    """
    if isinstance(source, Path):
        text, file, folder = text_of(source), str(source), source.parent
    else:
        text, file, folder = source, "<netlist>", Path()
    first = _read(text, file, folder, confined)
    findings = Findings()
    read_devices(first.deck, findings)
    warnings = build(first.deck).warnings
    written = deck_text(first, findings.idle)
    second = _read(written.text, file, folder, confined)
    difference = _difference(_content(first.deck, findings.idle), _content(second.deck, ()))
    if difference:
        message = f"the deck cannot be written so that it reads back the same: {difference}"
        hint = "keep the deck as it is, and report this"
        raise UsageError(Diagnostic("NS4032", message, hint=hint))
    left = {(w.code, w.message) for w in build(second.deck).warnings}
    notes = [_note(w, file) for w in warnings if (w.code, w.message) not in left]
    notes += [f"{path.name} is no longer needed: what was used of it is in the deck"
              for path in first.deck.included]  # fmt: skip
    notes += [f"{name} is not used, and left out" for name in written.unused]
    return Conversion(written.text, tuple(dict.fromkeys(notes)))


def _read(text: str, file: str, folder: Path, confined: bool) -> Reading:
    try:
        return reading_of(text, file, {}, folder, confined)
    except NetlistError as error:
        raise completed(error) from error


def _note(warning: Diagnostic, deck: str) -> str:
    span = warning.span
    if span is None:
        return warning.message
    place = "" if span.file == deck else f"{Path(span.file).name}, "
    return f"{place}line {span.line}: {warning.message}"


def _content(item: Any, idle: Container[Span]) -> Any:
    """Return what an item of a deck says, without where it says it."""
    if isinstance(item, Expression):
        return show(item.node)
    if isinstance(item, Deck):
        found = {f.name: getattr(item, f.name) for f in fields(item) if f.name not in _ORIGIN}
        found["options"] = {k: p for k, p in item.options.items() if k in OWN}
        return _content(found, idle)
    if isinstance(item, dict):
        kept = {
            key: value
            for key, value in item.items()
            if not (isinstance(value, Param) and value.span in idle)
        }
        return {
            key: None if isinstance(value, Span) else _content(value, idle)
            for key, value in kept.items()
        }
    if is_dataclass(item) and not isinstance(item, type):
        return _content({f.name: getattr(item, f.name) for f in fields(item)}, idle)
    if isinstance(item, tuple) and hasattr(item, "_asdict"):
        return _content(item._asdict(), idle)
    if isinstance(item, list | tuple):
        return [_content(value, idle) for value in item if not isinstance(value, Span)]
    return item


def _difference(one: Any, other: Any, where: str = "") -> str:
    """Return the first place at which two contents differ, empty if there is none."""
    if isinstance(one, dict) and isinstance(other, dict):
        if one.keys() != other.keys():
            names = one.keys() ^ other.keys()
            return f"{where} {', '.join(sorted(map(str, names)))[:80]}".strip()
        places: list[tuple[str, Any, Any]] = [(str(k), one[k], other[k]) for k in one]
    elif isinstance(one, list) and isinstance(other, list):
        if len(one) != len(other):
            return f"{where} ({len(one)} and {len(other)})"
        places = [(_name(v, k), v, other[k]) for k, v in enumerate(one)]
    else:
        same = one == other or (one != one and other != other)
        return "" if same else f"{where} ({one!s:.80} and {other!s:.80})"
    for name, a, b in places:
        found = _difference(a, b, f"{where} {name}".strip())
        if found:
            return found
    return ""


def _name(value: Any, index: int) -> str:
    return str(value["name"]) if isinstance(value, dict) and "name" in value else str(index + 1)
