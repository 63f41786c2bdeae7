"""One logical line as items: words, expressions, groups, calls and ``key=value`` pairs.

The grammar is ``grammar.lark``.  A parse depends on the kinds of the tokens only, not on their
texts, and a large deck repeats a few shapes (``R1 a b 1k`` is *word word word word*).  So a line is
cut into tokens by the grammar's own terminals, and lark parses each new shape once; after that the
same tree is filled with the next line's tokens.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from .findings import Unreadable
from .grammar import line_parser

if TYPE_CHECKING:
    from lark import Token, Tree

    from .lines import Line

#: longer shapes (a PWL source with many points) are parsed each time: they hardly repeat
_MAX_SHAPE = 60
_MAX_SHAPES = 5000
_MAX_NESTING = 20

#: (kind, token index of start, token index of end, children) or a pair of two such plans
Plan = tuple[str, int, int, tuple["Plan", ...]]


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
        Where it stands in the line, braces and parentheses included.
    items : tuple of Item
        Content of a group or call; a pair holds its two sides.
    """

    kind: str
    text: str
    start: int
    end: int
    items: tuple[Item, ...] = ()


_shapes: dict[str, tuple[Plan, ...]] = {}


@cache
def _scanner() -> tuple[re.Pattern[str], str]:
    """Return one pattern of all terminals, and a letter for each of its groups."""
    terminals = sorted(line_parser().terminals, key=lambda t: -t.priority)
    pattern = "|".join(f"({t.pattern.to_regexp()})" for t in terminals) + "|(.)"
    letters = {"CALL": "C", "WORD": "W", "BRACED": "B", "QUOTED": "Q", "STRING": "S"}
    letters |= {"LPAR": "(", "RPAR": ")", "EQUAL": "=", "SEPARATOR": " "}
    return re.compile(pattern, re.DOTALL), "?" + "".join(letters[t.name] for t in terminals) + "?"


def items(line: Line) -> list[Item]:
    """Return the items of a line.

    Raises
    ------
    Unreadable
        If parentheses or quotes do not match, or ``=`` stands without a key or a value.

    Examples
    --------
    >>> from nsspice.netlist.lines import Line
    >>> [(i.kind, i.text) for i in items(Line("R1 a 0 1k tc1=2", "x.net", 2, ""))]
    [('word', 'r1'), ('word', 'a'), ('word', '0'), ('word', '1k'), ('pair', 'tc1')]
    """
    text = line.text
    pattern, letters = _scanner()
    spans: list[tuple[int, int]] = []
    shape = ""
    kinds: list[str] = []
    for found in pattern.finditer(text):
        kind = letters[found.lastindex or 0]
        if kind != " ":
            kinds.append(kind)
            spans.append(found.span())
    shape = "".join(kinds)
    if not shape.strip("W"):  # nothing but words: the commonest line needs no plan
        return [Item("word", text[s:e], s, e) for s, e in spans]
    plans = _shapes.get(shape)
    if plans is None:
        plans = _parse(line, shape, spans)
        if len(shape) <= _MAX_SHAPE and len(_shapes) < _MAX_SHAPES:
            _shapes[shape] = plans
    return [_fill(plan, text, spans) for plan in plans]


def _fill(plan: Plan, text: str, spans: list[tuple[int, int]]) -> Item:
    """Put a line's tokens into the tree of its shape."""
    kind, first, last, children = plan
    start = spans[first][0]
    end = spans[last][1]
    if kind == "word":
        return Item(kind, text[start:end], start, end)
    if kind == "expr" or kind == "string":
        return Item(kind, text[start + 1 : end - 1], start, end)
    inner = tuple([_fill(child, text, spans) for child in children])
    if kind == "call":
        return Item(kind, text[start : spans[first][1] - 1], start, end, inner)
    if kind == "pair":
        key = inner[0]
        return Item(kind, key.text if key.kind == "word" else "", start, end, inner)
    return Item(kind, "", start, end, inner)


def _parse(line: Line, shape: str, spans: list[tuple[int, int]]) -> tuple[Plan, ...]:
    """Let lark parse a line of a new shape, and keep the tree by token numbers."""
    from lark import UnexpectedInput

    depth = 0
    for index, kind in enumerate(shape):
        depth += (kind in "(C") - (kind == ")")
        if depth > _MAX_NESTING:
            where = line.span(*spans[index])
            raise Unreadable("NS1007", "parentheses are nested too deeply", where)
    try:
        tree = line_parser().parse(line.text)
    except UnexpectedInput as error:
        place = getattr(error, "pos_in_stream", None)
        raise _explain(line, shape, spans, place) from None
    numbers = {start: index for index, (start, _) in enumerate(spans)}
    return tuple([_plan(child, numbers, spans) for child in tree.children if _is_tree(child)])


def _is_tree(child: object) -> bool:
    return not isinstance(child, str)


def _plan(tree: Tree[Token] | Token, numbers: dict[int, int], spans: list[tuple[int, int]]) -> Plan:
    """Turn lark's tree into token numbers."""
    assert not isinstance(tree, str)
    kind = str(tree.data)
    if kind == "single":
        return _plan(tree.children[0], numbers, spans)
    if kind in ("word", "braced", "quoted", "string"):
        index = numbers[_position(tree.children[0])]
        name = kind if kind in ("word", "string") else "expr"
        return (name, index, index, ())
    if kind == "pair":
        left, right = (_plan(c, numbers, spans) for c in tree.children if _is_tree(c))
        return ("pair", left[1], right[2], (left, right))
    tokens = [child for child in tree.children if isinstance(child, str)]
    children = tuple([_plan(c, numbers, spans) for c in tree.children if _is_tree(c)])
    return (kind, numbers[_position(tokens[0])], numbers[_position(tokens[-1])], children)


def _position(token: Tree[Token] | Token) -> int:
    position = getattr(token, "start_pos", None)
    assert position is not None
    return int(position)


def _explain(
    line: Line, shape: str, spans: list[tuple[int, int]], place: int | None
) -> Unreadable:
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
        hint = "a long line continues on the next one with + in its first column"
        return Unreadable("NS1007", "opening parenthesis without a closing one", where, hint)
    start = place if place is not None and place >= 0 else len(line.raw)
    hint = "write name=value; an expression goes into braces: name={a*2}"
    return Unreadable("NS1007", "= needs a name before it and a value after it",
                      line.span(start, start + 1), hint)  # fmt: skip
