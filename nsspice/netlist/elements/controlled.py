"""E, F, G, H and B lines, and C and L by a law: sources and storage given by an expression."""

from __future__ import annotations

import re
from itertools import combinations_with_replacement

from ...errors import Span, suggest
from ..expressions.expression_parser import voltage
from ..expressions.node import Node, add, call, mul, num, var
from ..findings import Unreadable
from ..text.lines import Line
from ..text.statement import Item
from .reading import Reader, assignments
from .template import Formula, Template, Value
from .terminals import GROUND, Terminals

_PARAMS = {"m", "tc1", "tc2", "temp", "dtemp", "ic"}
#: what the expression of a line may give
_QUANTITIES = {"b": ("v", "i"), "c": ("q",), "l": ("flux",), "r": ("r", "v")}
#: more inputs make more products than anyone can write
_MAX_INPUTS = 50


def controlled(reader: Reader, line: Line, items: list[Item]) -> Template:
    """Read E, F, G or H: a gain, ``VALUE={}``, ``VOL=``/``CUR=``, ``TABLE`` or ``POLY(n)``."""
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(2)
    result = terminals.template()
    quantity = "v" if result.letter in "eh" else "i"
    word = _keyword(terminals, result.letter)
    keys = {pair.text for pair in terminals.pairs}
    if "laplace" in keys | {word} and result.letter in "eg":
        from .transfer import transfer

        return transfer(reader, line, result, terminals)
    if word == "ztrans" and result.letter in "eg":
        from .transfer import sampled_transfer

        return sampled_transfer(reader, line, result, terminals)
    if {"laplace", "freq"} & (keys | {word}):
        message = f"{result.name}: a table of frequencies is not simulated"
        hint = "write its quotient of polynomials: E1 a b LAPLACE {v(in)} = {1/(1 + 1m*s)}"
        raise Unreadable("NS1002", message, result.span, hint)
    if word == "poly":
        terminals.next()
        _poly(terminals, result, quantity)
    elif word == "table" or any(_is_table(pair) for pair in terminals.pairs):
        _table(terminals, result, quantity)
    elif keys & {"value", "vol", "cur"} or word in ("value", "vol", "cur"):
        _given(terminals, result, quantity)
    elif result.letter in "eg":
        terminals.take_nodes(2, "controlling nodes")
        result.nodes, result.controls = terminals.nodes[:2], terminals.nodes[2:]
        result.node_spans = terminals.node_spans
        result.control_kind = "node"
        _gain(terminals, result)
    else:
        item = terminals.next()
        result.controls = (terminals.word(item, "the controlling source"),)
        assert item is not None
        result.node_spans += (line.span(item.start, item.end),)
        result.control_kind = "element"
        _gain(terminals, result)
    for key in ("value", "vol", "cur", "table", "gain", ""):
        terminals.pairs = [pair for pair in terminals.pairs if pair.text != key]
    result.params = terminals.params(_PARAMS)
    terminals.finish(result)
    return result


def _keyword(terminals: Terminals, letter: str) -> str:
    """Return the word that may say in which form the source is given, ``""`` without one.

    None is one where just the nodes (or the source) and a gain of a linear source are left:
    ``E1 a 0 freq 0 2`` senses a node called freq.
    """
    rest = terminals.ahead()
    if not rest or rest[0].kind != "word":
        return ""
    count = 2 if letter in "eg" else 1
    if not any(pair.text in ("gain", "table", "laplace") for pair in terminals.pairs):
        count += 1
    text = terminals.line.text
    named = all(item.kind == "word" for item in rest[:2])
    called = any(text[item.end : item.end + 1] == "(" for item in rest)  # VALUE 2*v(a)
    return "" if len(rest) == count and named and not called else rest[0].text


def _gain(terminals: Terminals, result: Template) -> None:
    """Take the gain of a linear source."""
    item = terminals.next()
    gains = [pair.items[1] for pair in terminals.pairs if pair.text == "gain"]
    if item is None and gains:
        item = gains[0]
    if item is None:
        message = f"{result.name}: the gain is missing"
        raise Unreadable("NS1008", message, result.span)
    result.value = terminals.reader.value(terminals.line, item, "a gain")


def _is_table(pair: Item) -> bool:
    return pair.text == "table" or (pair.text == "" and pair.items[0].kind in ("expr", "group"))


def _given(terminals: Terminals, result: Template, quantity: str) -> None:
    """Read ``VALUE={expr}`` and its relatives, with or without braces and =."""
    line = terminals.line
    for pair in terminals.pairs:
        if pair.text in ("value", "vol", "cur"):
            key, right = pair.text, pair.items[1]
            break
    else:
        item = terminals.next()
        follower = terminals.next()
        assert item is not None
        if follower is None:
            raise Unreadable("NS1008", f"{result.name}: the expression is missing", result.span)
        key, right = item.text, follower
    if key == ("cur" if quantity == "v" else "vol"):
        where = line.span(right.start, right.end)
        message = f"{result.name}: {result.letter.upper()} gives a {_unit(quantity)}"
        raise Unreadable("NS1014", message, where, f"write VALUE= or use {_other(result.letter)}")
    result.quantity = quantity
    if right.kind in ("expr", "string"):
        result.value = terminals.reader.formula(line, right.start + 1, right.end - 1)
        return
    # unbraced: everything up to the next name=
    _, found = assignments(line, terminals_end(terminals))
    for name, _, start, end in found:
        if name == key:
            result.value = terminals.reader.formula(line, start, end)
            terminals.rest()
            return
    result.value = terminals.reader.formula(line, right.start, len(line.raw.rstrip()))
    terminals.rest()


def terminals_end(terminals: Terminals) -> int:
    """Return where the second node of an element line ends."""
    found = re.match(r"\s*\S+?[\s,(]+[^\s,()]+[\s,]+[^\s,()]+[\s)]", terminals.line.text)
    return found.end() if found else 0


def _unit(quantity: str) -> str:
    return "voltage" if quantity == "v" else "current"


def _other(letter: str) -> str:
    return {"e": "G", "g": "E", "f": "H", "h": "F"}[letter]


def _table(terminals: Terminals, result: Template, quantity: str) -> None:
    """Read ``TABLE {expr} = (x,y) (x,y)`` and LTspice's ``nc+ nc- table=(x,y,x,y)``."""
    line = terminals.line
    reader = terminals.reader
    expression: Item | None = None
    points: list[Item] = []
    named = next((p for p in terminals.pairs if p.text == "table"), None)
    bare = next((p for p in terminals.pairs if p.text == "" and _is_table(p)), None)
    item = terminals.peek()
    if item is not None and item.text == "table" and item.kind == "word":
        terminals.next()
    if bare is not None:
        expression = bare.items[0]
        points = [*_words([bare.items[1]]), *terminals.rest()]
    elif named is not None and named.items[1].kind == "expr":  # TABLE={expr} (x,y) ...
        expression = named.items[1]
        points = terminals.rest()
    elif named is not None:
        terminals.take_nodes(2, "controlling nodes")
        points = [*_words([named.items[1]]), *terminals.rest()]
    else:
        rest = terminals.rest()
        exprs = [i for i, item in enumerate(rest) if item.kind == "expr"]
        if exprs and exprs[0] == 0:
            expression, points = rest[0], rest[1:]
        else:
            raise Unreadable("NS1008", f"{result.name}: TABLE needs an expression in braces",
                             result.span, "write TABLE {v(a)} = (x,y) (x,y)")  # fmt: skip
    if expression is not None:
        inner = reader.formula(line, expression.start + 1, expression.end - 1)
        tree = inner.node if isinstance(inner, Formula) else num(inner)
    else:
        tree = voltage(*terminals.nodes[2:4])
    result.value = table_law(terminals, tree, points)
    result.quantity = quantity


def table_law(terminals: Terminals, tree: Node, points: list[Item]) -> Formula:
    """Return a function of straight lines between points.

    Parameters
    ----------
    terminals : Terminals
        Of the line.
    tree : Node
        What the function depends on.
    points : list of Item
        ``x1 y1 x2 y2 ...``

    Raises
    ------
    Unreadable
        If the numbers make no pairs.
    """
    if len(points) < 2 or len(points) % 2:
        message = f"{terminals.name}: TABLE needs pairs (x,y), {len(points)} numbers given"
        raise Unreadable("NS1008", message, terminals.span)
    reader, line = terminals.reader, terminals.line
    values = [_node(reader.value(line, p, "a number of the table")) for p in points]
    return _whole(terminals, call("pwl", tree, *values))


def _words(items: list[Item]) -> list[Item]:
    """Return the words of groups."""
    from .reading import flat

    return list(flat(items))


def _poly(terminals: Terminals, result: Template, quantity: str) -> None:
    """Read ``POLY(n)``: inputs, then coefficients in order of rising degree."""
    line = terminals.line
    reader = terminals.reader
    item = terminals.next()
    count = reader.value(line, item, "a number of inputs") if item is not None else 1.0
    if not isinstance(count, float) or count != int(count) or not 1 <= count <= _MAX_INPUTS:
        message = f"{result.name}: POLY(n) needs a whole number from 1 to {_MAX_INPUTS}"
        raise Unreadable("NS1010", message, result.span)
    inputs, names, spans = _inputs(terminals, result, int(count))
    coefficients = [reader.value(line, i, "a coefficient") for i in terminals.rest()]
    if not coefficients:
        raise Unreadable("NS1008", f"{result.name}: POLY has no coefficients", result.span)
    constant = coefficients[0]
    linear = count == 1 and (len(coefficients) == 1 or (len(coefficients) == 2 and constant == 0.0))
    if linear:  # one coefficient alone is a gain, by the rule of SPICE2
        result.controls = names
        result.node_spans += spans
        result.control_kind = "node" if result.letter in "eg" else "element"
        result.value = coefficients[-1]
        return
    terms = []
    degree, made = 0, 0
    while made < len(coefficients):
        for chosen in combinations_with_replacement(range(int(count)), degree):
            if made == len(coefficients):
                break
            coefficient = _node(coefficients[made])
            made += 1
            terms.append(mul((coefficient, *(inputs[k] for k in chosen))))
        degree += 1
    result.value = _whole(terminals, add(terms))
    result.quantity = quantity


def _inputs(
    terminals: Terminals, result: Template, count: int
) -> tuple[list[Node], tuple[str, ...], tuple[Span, ...]]:
    """Return the controlling signals of POLY with their names and places."""
    line = terminals.line
    nodes: list[Node] = []
    names: list[str] = []
    spans = []
    per = 2 if result.letter in "eg" else 1
    for _ in range(count):
        words = []
        for _ in range(per):
            item = terminals.next()
            what = "a controlling node" if per == 2 else "a controlling source"
            words.append(terminals.word(item, what))
            assert item is not None
            spans.append(line.span(item.start, item.end))
        words = [GROUND.get(w, w) for w in words] if per == 2 else words
        names += words
        nodes.append(voltage(*words) if per == 2 else var(f"i({words[0]})"))
    return nodes, tuple(names), tuple(spans)


def _node(value: Value) -> Node:
    return value.node if isinstance(value, Formula) else num(value)


def _whole(terminals: Terminals, tree: Node) -> Formula:
    """Return a tree made here as a formula that spans the line."""
    line = terminals.line
    start = len(line.raw) - len(line.raw.lstrip())
    return Formula(tree, line, start, len(line.raw.rstrip()), made=True)


def behavioural(reader: Reader, line: Line) -> Template:
    """Read ``B n+ n- V=expr`` or ``I=expr``, ``C n+ n- Q=expr``, ``L n+ n- Flux=expr``.

    Also ``R n+ n- R=expr`` and ``V=expr``.  The expression needs no braces.
    """
    found = re.match(r"\s*(\S+)[\s,(]+([^\s,()=]+)[\s,]+([^\s,()=]+)", line.text)
    name = line.text.split()[0]
    whole = line.whole()
    quantities = _QUANTITIES[name[0]]
    forms = ", or ".join(f"{key.capitalize()}=expression" for key in quantities)
    hint = f"write {name[0].upper()}name n+ n- {forms}"
    if found is None:
        raise Unreadable("NS1008", f"{name}: two nodes are needed", whole, hint)
    _, given = assignments(line, found.end())
    nodes = tuple(GROUND.get(found.group(k), found.group(k)) for k in (2, 3))
    spans = tuple(line.span(*found.span(k)) for k in (2, 3))
    result = Template(name, name[0], whole, nodes, spans)
    known = _PARAMS.union(quantities, ("r", "rpar", "cpar") if name[0] == "b" else ())
    for key, begin, left, right in given:
        if key not in known:
            near = suggest(key, known) or hint
            where = line.span(begin, begin + len(key))
            raise Unreadable("NS1014", f"{name}: unknown parameter {key}", where, near)
        value = reader.formula(line, left, right)
        if key in quantities:
            if result.quantity:
                where = line.span(begin, right)
                both = f"{result.quantity.upper()}= and {key.upper()}="
                message = f"{name}: {both} are given together"
                raise Unreadable("NS1009", message, where, hint)
            result.quantity, result.value = key, value
        else:
            from .template import ParamText

            result.params[key] = ParamText(value, line.span(begin, right))
    if not result.quantity:
        raise Unreadable("NS1008", f"{name}: the expression is missing", whole, hint)
    if result.quantity == "r":  # the value of a resistor as such
        result.quantity = ""
    return result


def is_law(line: Line) -> bool:
    """Return whether ``R=`` or ``V=`` of an R line is an expression without braces."""
    for key, _, left, right in assignments(line, 0)[1]:
        if key in ("r", "v") and line.text[left - 1] not in "{'\"":
            return re.search(r"[(*/^?<>]", line.text[left:right]) is not None
    return False
