"""The way from text to deck: files, lines, blocks, bodies, elements, cards."""

from __future__ import annotations

import gc
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import NamedTuple

from ..errors import Diagnostic, NetlistError, Span, suggest
from .cards.control import CardReader
from .cards.noise_sources import draw_waveforms
from .deck import Deck
from .elements.reading import Reader
from .expansion.body import Body, BodyReader
from .expansion.draws import Draws
from .expansion.expand import Expander
from .expansion.parts import Parts
from .expansion.scope import Scope
from .expansion.wound import wound
from .expressions import expression_parser
from .findings import Findings, Unreadable
from .text import statement
from .text.files import FileReader
from .text.lines import logical_lines, physical_lines
from .text.numbers import as_float
from .text.schematic import schematic_of
from .text.script import Script
from .text.source import read_text
from .text.structure import build

#: where messages place lines that a caller has added to a deck
_ADDED = "<added>"
#: a title that is an element line was most likely meant as one
_ELEMENT_LIKE = re.compile(
    r"\s*(?:[rlcvi]\w*\d\w*[\s,]+\S+[\s,]+\S+[\s,]+[-+{'.\d]|[rlcvi]\d*\s+\S+\s+0\s+[-+{'.\d])",
    re.I,
)


class Reading(NamedTuple):
    """A deck with what it was made of.

    Parameters
    ----------
    deck : Deck
    body : Body
        The lines of the deck outside of subcircuits, read and not yet evaluated.
    scope : Scope
        The names of the deck; what was used of them is evaluated.
    scripts : list of Script
        The ``.control`` blocks.
    """

    deck: Deck
    body: Body
    scope: Scope
    scripts: list[Script]


def parse_text(
    text: str,
    file: str = "<netlist>",
    params: Mapping[str, float] | None = None,
    directory: Path | None = None,
    confined: bool = False,
    added: Sequence[str] = (),
    seed: int = 0,
) -> Deck:
    r"""Read a netlist from a text.

    Parameters
    ----------
    text : str
        The deck; its first line is the title, always.
    file : str
        Name for messages.
    params : mapping of str to float, optional
        Values that take the place of ``.param`` definitions of the same names.
    directory : Path, optional
        Where ``.include`` looks; the current folder by default.
    confined : bool
        Whether files outside of that folder are refused.
    added : sequence of str
        Lines that are read after those of the deck, as if they stood in it.
    seed : int
        Of the random numbers that the deck draws.

    Returns
    -------
    Deck
        Expanded and evaluated; ``deck.warnings`` holds what was doubtful.

    Raises
    ------
    NetlistError
        With everything that is wrong.

    Examples
    --------
    >>> deck = parse_text('''divider
    ... V1 in 0 {2*half}
    ... R1 in out 1k
    ... R2 out 0 1k
    ... .param half=5
    ... .op''')
    >>> [(element.name, element.nodes, element.value) for element in deck.elements[1:]]
    [('r1', ('in', 'out'), 1000.0), ('r2', ('out', '0'), 1000.0)]
    >>> deck.elements[0].source.dc
    10.0
    >>> parse_text("divider\nR1 in 0 1k\nR2 in 0")
    Traceback (most recent call last):
    ...
    nsspice.errors.NetlistError: <netlist>:3:1: error NS1008: r2: the resistance is missing
      R2 in 0
      ^^^^^^^
      hint: write Rname node node value
    """
    where = directory or Path()
    return reading_of(text, file, params or {}, where, confined, added, seed).deck


def parse_file(
    path: Path | str,
    params: Mapping[str, float] | None = None,
    confined: bool = False,
    seed: int = 0,
) -> Deck:
    """Read a netlist file: UTF-8, Latin-1, or LTspice's UTF-16.

    Parameters
    ----------
    path : Path or str
        The file; ``.include`` is relative to its folder.
    params : mapping of str to float, optional
        Values that take the place of ``.param`` definitions of the same names.
    confined : bool
        Whether files outside of its folder are refused.
    seed : int
        Of the random numbers that the deck draws.

    Returns
    -------
    Deck
        As from ``parse_text``.

    Raises
    ------
    NetlistError
        With everything that is wrong, or when the file cannot be read.

    Examples
    --------
    >>> parse_file("no-such-file.net")
    Traceback (most recent call last):
    ...
    nsspice.errors.NetlistError: error NS1050: file no-such-file.net does not exist
      hint: check the path
    """
    path = Path(path)
    text = text_of(path)
    return parse_text(text, str(path), params, path.parent, confined, seed=seed)


def text_of(path: Path) -> str:
    """Return the text of a netlist file.

    Raises
    ------
    NetlistError
        NS1050 if it cannot be read.
    """
    try:
        return read_text(path)
    except FileNotFoundError:
        message = f"file {path} does not exist"
        raise NetlistError(Diagnostic("NS1050", message, None, "check the path")) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        message = f"file {path} cannot be read: {reason}"
        raise NetlistError(Diagnostic("NS1050", message, None)) from None


@contextmanager
def _no_collection() -> Iterator[None]:
    """Keep Python's cycle collector off: a deck makes many objects and no cycles.

    It would walk over all of them again and again, a third of the time of a large deck.
    """
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def reading_of(
    text: str,
    file: str,
    params: Mapping[str, float],
    directory: Path,
    confined: bool = False,
    added: Sequence[str] = (),
    seed: int = 0,
) -> Reading:
    """Return the deck of ``parse_text`` with its lines, for those who write them again."""
    with _no_collection():
        return _parse(text, file, params, directory, confined, added, seed)


def _parse(
    text: str,
    file: str,
    params: Mapping[str, float],
    directory: Path,
    confined: bool,
    added: Sequence[str],
    seed: int,
) -> Reading:
    return _evaluated(_outline(text, file, directory, confined, added), params, seed)


class Outline(NamedTuple):
    """What a text says for any values of its parameters.

    Parameters
    ----------
    title, file : str
    first : str
        The first line as it is written.
    reader : Reader
        Reports into ``findings``.
    findings : Findings
    body : Body
    scripts : list of Script
    included : tuple of Path
    """

    title: str
    file: str
    first: str
    reader: Reader
    findings: Findings
    body: Body
    scripts: list[Script]
    included: tuple[Path, ...]


def outline_of(
    text: str,
    file: str = "<netlist>",
    directory: Path | None = None,
    confined: bool = False,
    added: Sequence[str] = (),
) -> Outline:
    r"""Read the lines of a netlist once, for decks with different values of its parameters.

    Parameters
    ----------
    text, file, directory, confined, added
        As for :func:`parse_text`.

    Raises
    ------
    NetlistError
        If the text is not a netlist.  What lines of it cannot be read is an error of each deck.

    Examples
    --------
    >>> lines = outline_of("divider\n.param r=1k\nR1 a 0 {r}\n.op")
    >>> [deck_of(lines, {"r": r}).elements[0].value for r in (1.0, 2.0)]
    [1.0, 2.0]
    """
    with _no_collection():
        return _outline(text, file, directory or Path(), confined, added)


def deck_of(outline: Outline, params: Mapping[str, float] | None = None, seed: int = 0) -> Deck:
    """Return the deck of an outline, as from :func:`parse_text`.

    Raises
    ------
    NetlistError
        With everything that is wrong; subcircuits of an outline are read when they are first used,
        so that another deck of the same outline may not repeat it.
    """
    with _no_collection():
        return _evaluated(outline, params or {}, seed).deck


def _outline(
    text: str, file: str, directory: Path, confined: bool, added: Sequence[str]
) -> Outline:
    """Do the first part of the work of ``parse_text``."""
    findings = Findings()
    rows = physical_lines(text)
    drawn = schematic_of(text)
    if drawn is not None:
        place = Span(file, 1, 1, max(len(rows[0]), 1), rows[0])
        message = f"{file} is a schematic of {drawn.program}, not a netlist"
        raise NetlistError(Diagnostic("NS1094", message, place, drawn.export))
    if _ELEMENT_LIKE.match(rows[0]) or re.match(r"\s*\.(?!title)[a-z]+", rows[0], re.I):
        place = Span(file, 1, 1, max(len(rows[0]), 1), rows[0])
        hint = "put a title line above it"
        findings.warning(
            "NS1092", "the first line is treated as the title, so it is not simulated", place, hint
        )
    files = FileReader(findings, directory if confined else None)
    lines = chain(files.main(rows, file, directory), logical_lines(list(added), _ADDED))
    block = build(lines, findings)
    reader = Reader(findings)
    body = BodyReader(reader).read(block)
    title = rows[0].strip().lstrip("\ufeff")
    return Outline(title, file, rows[0], reader, findings, body, files.scripts, files.included)


def _evaluated(outline: Outline, params: Mapping[str, float], seed: int) -> Reading:
    """Do the second part of the work of ``parse_text``."""
    file, body, scripts = outline.file, outline.body, outline.scripts
    findings = outline.findings.copied()
    reader = outline.reader.reporting(findings)
    bodies, deck = BodyReader(reader), Deck(outline.title, file)
    draws = Draws(seed, params)
    scope = Scope(None, "", {}, set(), draws=draws)
    scope.fixed.update({name.lower(): as_float(value) for name, value in params.items()})
    swept = scope.fixed.pop("temper", None)
    scope.parts = Parts(reader)
    expander = Expander(findings, bodies)
    items = expander.choose(scope, body)
    cards = CardReader(deck, reader, scope, expander)
    cards.prepare()
    if swept is not None:
        deck.temperature = scope.temperature = swept
    expander.expand(scope, items)
    expander.check_controls()
    expander.coded.finish(expander.elements)
    _evaluate_all(deck, scope, findings)
    deck.initial.update(expander.initial)
    deck.integrators = frozenset(expander.initial)
    deck.sampled, deck.delays = expander.sampled, expander.delays
    deck.elements = wound(expander.elements, findings)
    deck.included = outline.included
    deck.seed = seed
    if scripts:
        from .script.plan import computes, plan

        cards.read(computes(scripts))
        plan(deck, cards, scripts, findings, seed)
    else:
        cards.read()
    draw_waveforms(deck, findings)
    _check_given(deck, scope, findings)
    deck.thermal = scope.used_temper
    if draws.used:
        message = "the deck draws random values: they are the same in each run"
        hint = "--seed draws others, and so does each .step; nsspice tolerance shows a spread"
        findings.warning("NS1096", message, Span(file, 1, 1, 1, outline.first), hint)
    findings.settle_absent()
    if not deck.elements and not findings.errors:
        where = Span(file, 1, 1, 1, outline.first)
        hint = "the first line is the title; elements start in line 2"
        findings.error("NS1091", "the netlist contains no elements", where, hint)
    statement.SHAPES.keep()
    expression_parser.SHAPES.keep()
    findings.raise_errors(deck)
    deck.warnings = findings.warnings
    return Reading(deck, body, scope, scripts)


def _check_given(deck: Deck, scope: Scope, findings: Findings) -> None:
    """Warn about given and stepped parameters that the deck does not have: most likely misspelt."""
    stepped = {sweep.name: sweep.span for sweep in deck.steps}
    for name in scope.fixed:
        if name not in scope.params and name not in scope.asked:
            message = f"the netlist has no parameter {name}: the value given for it has no effect"
            hint = suggest(name, scope.params)
            findings.warning("NS1083", message, stepped.get(name), hint)


def _evaluate_all(deck: Deck, scope: Scope, findings: Findings) -> None:
    """Evaluate all parameters of the deck, also those that nothing uses."""
    for name in scope.params:
        try:
            value = scope.parameter(name)
        except Unreadable as found:
            findings.record(found)
            continue
        assert value is not None
        deck.parameters[name] = value
    deck.parameters.update(scope.fixed)
