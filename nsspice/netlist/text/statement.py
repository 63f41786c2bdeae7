"""One logical line as items: words, expressions, groups, calls and ``key=value`` pairs.

The grammar is ``grammar.lark``; ``shapes.py`` says how it is used.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from ..findings import Unreadable
from .shapes import Misfit, Shapes, Spans

if TYPE_CHECKING:
    from .lines import Line

_MAX_NESTING = 20
_LONG = 100  # tokens of a line from which on runs of words are looked for
_BESIDE = 2  # words of a run that stay on each side: a = takes one
_RUNS = re.compile("W{64,}")
_new = tuple.__new__  # three times as fast as Item(...), and made for every word of a deck
_MARKS = re.compile(r"[(){}'\"=]")
_WORDS = re.compile(r"[^\s,]+")
SHAPES = Shapes(
    "grammar",
    r"\s,",
    {"CALL": "C", "WORD": "W", "BRACED": "B", "QUOTED": "Q", "STRING": "S", "LPAR": "(",
     "RPAR": ")", "EQUAL": "="},
)  # fmt: skip


class Item(NamedTuple):
    """One item of a line.

    Parameters
    ----------
    kind : str
        ``word expr string group call pair``.
    text : str
        Lower case: the word, the expression without braces, the name of a call, the key of a pair
        (when the key is a word).
    start, end : int
        Where it is in the line, braces and parentheses included.
    items : tuple of Item
        Content of a group or call; a pair holds its two sides.
    """

    kind: str
    text: str
    start: int
    end: int
    items: tuple[Item, ...] = ()


def items(line: Line) -> list[Item]:
    """Return the items of a line.

    Raises
    ------
    Unreadable
        If parentheses or quotes do not match, or ``=`` is without a key or a value.

    Examples
    --------
    >>> from nsspice.netlist.text.lines import Line
    >>> [(i.kind, i.text) for i in items(Line("R1 a 0 1k tc1=2", "x.net", 2, ""))]
    [('word', 'r1'), ('word', 'a'), ('word', '0'), ('word', '1k'), ('pair', 'tc1')]
    """
    text = line.text
    if not _MARKS.search(text):  # nothing but words: the commonest line needs no parser
        line.plain = True
        found = [(m.group(), *m.span()) for m in _WORDS.finditer(text)]
        return [_new(Item, ("word", word, start, end, ())) for word, start, end in found]
    shape, spans = SHAPES.tokens(text)
    cuts: dict[int, Spans] = {}
    if len(shape) > _LONG:
        text, shape, spans, cuts = _without_runs(text, shape, spans)
    if shape.count("(") + shape.count("C") > _MAX_NESTING:
        _check_nesting(line, shape, spans)
    try:
        program = SHAPES.program(text, shape, spans)
    except Misfit as error:
        raise _explain(line, shape, spans, error.position) from None
    stack: list[Item] = []
    open_cuts = list(cuts.values())
    text = line.text
    for rule, count, tokens in program:
        if rule == "word":
            start, end = spans[tokens[0]]
            stack.append(_new(Item, ("word", text[start:end], start, end, ())))
            for start, end in cuts.get(tokens[0], ()):
                stack.append(_new(Item, ("word", text[start:end], start, end, ())))
        elif rule == "pair":
            right = stack.pop()
            left = stack.pop()
            key = left.text if left.kind == "word" else ""
            stack.append(Item("pair", key, left.start, right.end, (left, right)))
        elif rule == "call" or rule == "group":
            start, inner = spans[tokens[0]]
            # the innermost parentheses around a run take its words: they come first
            for cut in [c for c in open_cuts if start < c[0][0] < spans[tokens[1]][1]]:
                open_cuts.remove(cut)
                count += len(cut)
            content = tuple(stack[len(stack) - count :])
            del stack[len(stack) - count :]
            end = spans[tokens[1]][1]
            name = text[start : inner - 1] if rule == "call" else ""
            stack.append(Item(rule, name, start, end, content))
        elif rule != "single" and rule != "start":
            start, end = spans[tokens[0]]
            kind = "string" if rule == "string" else "expr"
            stack.append(Item(kind, text[start + 1 : end - 1], start, end))
    return stack


def _without_runs(text: str, shape: str, spans: Spans) -> tuple[str, str, Spans, dict[int, Spans]]:
    """Return a long line without the middle of long runs of words, and what was left out.

    Words in a row are side by side wherever they are: the parser learns nothing from more of
    them.  They are blank in the text, so that all other places stay what they are.

    Returns
    -------
    tuple
        Text, shape and spans of what is left, and by the number of the word before each gap the
        spans of the words in it.
    """
    pieces: list[str] = []
    kept: list[int] = []
    cuts: dict[int, Spans] = {}
    done = place = 0
    for run in _RUNS.finditer(shape):
        first, last = run.start() + _BESIDE, run.end() - _BESIDE
        kept += range(done, first)
        cuts[len(kept) - 1] = spans[first:last]
        start, end = spans[first][0], spans[last - 1][1]
        pieces += [text[place:start], " " * (end - start)]
        done, place = last, end
    kept += range(done, len(shape))
    pieces.append(text[place:])
    return "".join(pieces), "".join([shape[k] for k in kept]), [spans[k] for k in kept], cuts


def _check_nesting(line: Line, shape: str, spans: Spans) -> None:
    """Refuse parentheses that nobody can count; readers of items may recurse."""
    depth = 0
    for index, kind in enumerate(shape):
        depth += (kind in "(C") - (kind == ")")
        if depth > _MAX_NESTING:
            where = line.span(*spans[index])
            raise Unreadable("NS1007", "parentheses are nested too deeply", where)


def _explain(line: Line, shape: str, spans: Spans, place: int | None) -> Unreadable:
    """Say in words why a line has no parse."""
    opened: list[int] = []
    for index, kind in enumerate(shape):
        start, end = spans[index]
        if kind == "?":
            character = line.raw[start]
            message = f"unmatched {character}"
            return Unreadable("NS1007", message, line.span(start, end), "close it on the same line")
        if kind in "(C":
            opened.append(index)
        elif kind == ")":
            if not opened:
                return Unreadable("NS1007", "closing parenthesis without an opening one",
                                  line.span(start, end))  # fmt: skip
            opened.pop()
    if opened:
        where = line.span(spans[opened[-1]][1] - 1, spans[opened[-1]][1])
        hint = "continue a long line with + in the first column of the next"
        return Unreadable("NS1007", "opening parenthesis without a closing one", where, hint)
    start = place if place is not None and place >= 0 else len(line.raw)
    hint = "write name=value; put an expression in braces: name={a*2}"
    return Unreadable("NS1007", "= needs a name before it and a value after it",
                      line.span(start, start + 1), hint)  # fmt: skip
