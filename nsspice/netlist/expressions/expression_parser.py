"""Text to expression trees, with lark (``expression.lark``).

``shapes.py`` says how lark is used; a parsed shape is a flat program, so that a million opening
parentheses are an error message and not a crash.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from ...errors import Span, suggest
from ..findings import Unreadable
from ..text.numbers import read_number
from ..text.shapes import Misfit, Shapes, Spans, Step
from .evaluate import rebuild
from .functions import ALIASES, ARITY, CONSTANTS, UNSUPPORTED, WITH_ZERO, arity_problem
from .node import (
    MAX_DEPTH,
    Node,
    TooLarge,
    add,
    call,
    inv,
    name,
    neg,
    num,
    power,
    var,
)

#: longer texts are data, not formulas
MAX_LENGTH = 100_000

Place = Callable[[int, int], Span | None]
#: receives message, hint and place of a doubtful number
Trap = Callable[[str, str, Span | None], None]
SHAPES = Shapes("expression", r"\s", {})
#: what the grammar calls a comparison
_COMPARISONS = {"<": "lt", "<=": "le", ">": "gt", ">=": "ge", "==": "eq", "!=": "ne"}


def parse(text: str, place: Place, trap: Trap) -> Node:
    """Return the tree of an expression; names are not looked up, user functions stay calls.

    Parameters
    ----------
    text : str
        The expression in its original spelling, without braces.
    place : callable
        Gives the place of ``text[start:end]`` in the netlist.
    trap : callable
        Receives message, hint and place of numbers such as 2k2.

    Raises
    ------
    Unreadable
        With the place and the reason.
    """
    stripped = text.strip()
    if not stripped:
        raise Unreadable("NS1020", "expression is empty", place(0, len(text)))
    if len(text) > MAX_LENGTH:
        message = f"expression has more than {MAX_LENGTH} characters"
        raise Unreadable("NS1023", message, place(0, 1), "use a PWL source for long tables")
    number = read_number(stripped)
    if number is not None and not number.trap and math.isfinite(number.value):
        return num(number.value)
    shape, spans = SHAPES.tokens(text)
    try:
        program = SHAPES.program(text, shape, spans)
    except Misfit as error:
        raise _explain(text, place, error.position) from None
    try:
        return _run(program, text, spans, place, trap)
    except TooLarge:
        message = f"expression is nested deeper than {MAX_DEPTH} operations"
        raise Unreadable("NS1023", message, place(0, len(text)), "split it into steps") from None


def _run(program: tuple[Step, ...], text: str, spans: Spans, place: Place, trap: Trap) -> Node:
    """Make the nodes of a program, operands before operations."""
    stack: list[Node] = []
    for rule, count, tokens in program:
        start, end = spans[tokens[0]] if tokens else (0, 0)
        if rule == "name":
            node = name(text[start:end].lower())
        elif rule == "number":
            node = _number(text, start, end, place, trap)
        elif rule == "probe":
            node = _probe(text[start:end].lower())
        else:
            args = stack[len(stack) - count :]
            del stack[len(stack) - count :]
            if rule == "call":  # built in or a .func of the deck: the scope decides
                node = Node("call", tuple(args), "?" + text[start : end - 1].rstrip().lower())
            else:
                node = _operation(rule, args, [text[spans[t][0] : spans[t][1]] for t in tokens])
            if node.depth > MAX_DEPTH:
                raise TooLarge
        stack.append(node)
    return stack[0]


def _operation(rule: str, args: list[Node], signs: list[str]) -> Node:
    """Return the node of an operation."""
    if rule == "start":
        return args[0]
    if rule == "sum":
        rest = zip(args[1:], signs, strict=True)
        return add([args[0], *[arg if sign == "+" else neg(arg) for arg, sign in rest]])
    if rule == "product":
        # a constant zero times something stays as written: 0*v(a) still names v(a)
        rest = zip(args[1:], signs, strict=True)
        first = args[0].args if args[0].op == "mul" else (args[0],)
        return Node("mul", (*first, *[arg if sign == "*" else inv(arg) for arg, sign in rest]))
    if rule == "sign":
        return neg(args[0]) if signs[0] == "-" else args[0]
    if rule == "power":
        return power(args[0], args[1])
    if rule == "negation":
        return Node("not", (args[0],))
    if rule == "comparison":
        return Node(_COMPARISONS[signs[0]], (args[0], args[1]))
    if rule in ("disjunction", "conjunction"):
        return Node("or" if rule == "disjunction" else "and", tuple(args))
    assert rule == "conditional"
    return Node("if", (args[0], args[1], args[2]))


def _number(text: str, start: int, end: int, place: Place, trap: Trap) -> Node:
    """Return a constant, or a message for something like ``2x``."""
    word = text[start:end]
    found = read_number(word)
    if found is None:
        hint = "names start with a letter"
        raise Unreadable("NS1010", f"{word[:60]} is not a number", place(start, end), hint)
    if not math.isfinite(found.value):
        message = f"{word[:60]} is out of range"
        raise Unreadable("NS1010", message, place(start, end))
    if found.trap:
        trap(found.trap, found.hint, place(start, end))
    return num(found.value)


def _probe(text: str) -> Node:
    """Return a signal by its canonical name; ground is left out."""
    form, _, inner = text.partition("(")
    kind, form = form[0], form.rstrip()
    nodes = [
        "0" if part in ("gnd", "0") and kind == "v" else part
        for part in re.split(r"[\s,()]+", inner)
        if part
    ]
    if form != kind:  # of a complex signal: vdb(out)
        return var(f"{form}({','.join(nodes)})")
    if kind == "i":
        return var(f"i({nodes[0]})") if len(nodes) == 1 else var(f"i({','.join(nodes)})")
    return voltage(*nodes)


def voltage(first: str, second: str = "0") -> Node:
    """Return the voltage between two nodes, in its simplest form."""
    if first == second:
        return num(0.0)
    if second == "0":
        return var(f"v({first})")
    return neg(var(f"v({second})")) if first == "0" else var(f"v({first},{second})")


def resolve(function: str, args: list[Node], known: list[str], where: Span | None) -> Node:
    """Return the call of a built-in function.

    Parameters
    ----------
    function : str
        Its name, lower case.
    args : list of Node
        Arguments.
    known : list of str
        Functions of the deck, for suggestions.
    where : Span or None
        Place for messages.

    Raises
    ------
    Unreadable
        If there is no such function, or it takes another number of arguments.
    """
    if function not in ARITY:
        raise unknown_function(function, known, where)
    if function == "limit" and len(args) == 2:
        hint = "limit(x, low, high) keeps x between two bounds"
        message = "limit with two arguments draws a random value, which is not supported"
        raise Unreadable("NS1022", message, where, hint)
    problem = arity_problem(function, len(args))
    if problem:
        raise Unreadable("NS1022", problem, where)
    if function == "pow":
        return power(args[0], args[1])
    if function in ("if", "ternary_fcn"):
        return Node("if", (args[0], args[1], args[2]))
    if function in WITH_ZERO:
        return Node("if", (Node(function[:2], (args[0], num(0.0))), num(1.0), num(0.0)))
    return call(ALIASES.get(function, function), *args)


def unknown_function(function: str, known: list[str], where: Span | None) -> Unreadable:
    """Return the finding for a function that nobody defined."""
    if function in UNSUPPORTED:
        message = f"function {function} is not supported"
        return Unreadable("NS1022", message, where, UNSUPPORTED[function])
    if function in ("v", "i"):
        message = f"{function}(...) needs the name of a node or element, not an expression"
        return Unreadable("NS1022", message, where)
    hint = suggest(function, [*ARITY, *known]) or "define it with .func"
    return Unreadable("NS1022", f"unknown function {function}", where, hint, function)


def free_expression(text: str, span: Span | None) -> Node:
    """Return an expression outside any deck: signals and constants only."""
    tree = parse(text, lambda start, end: span, lambda message, hint, where: None)

    def look_up(leaf: Node) -> Node:
        word = str(leaf.value)
        if leaf.op == "var" or word in ("time", "temper", "i"):
            return var(word)
        if word in CONSTANTS:
            return num(CONSTANTS[word])
        raise Unreadable("NS1021", f"unknown name {word}", span, suggest(word, ["time", "temper"]))

    return rebuild(tree, look_up, lambda name, args: resolve(name, args, [], span))


def _explain(text: str, place: Place, position: int | None) -> Unreadable:
    """Say in words why an expression has no parse."""
    depth = 0
    for index, character in enumerate(text):
        depth += (character in "({") - (character in ")}")
        if depth < 0:
            where = place(index, index + 1)
            return Unreadable("NS1020", "closing parenthesis without an opening one", where)
    if depth > 0:
        index = max(text.rfind("("), 0)
        return Unreadable("NS1020", "opening parenthesis without a closing one",
                          place(index, index + 1))  # fmt: skip
    if position is None or position < 0 or position >= len(text):
        where = place(max(len(text) - 1, 0), len(text))
        return Unreadable("NS1020", "the expression ends too early", where)
    found = re.match(r"[\w.]+|\S", text[position:])
    word = found.group() if found else text[position]
    where = place(position, position + len(word))
    if word == "=":
        hint = "equality is written =="
    elif word in "'\"{}":
        hint = "braces and quotes do not nest"
    elif word[0] not in "_(." and not word[0].isalnum():
        hint = "a value is missing before or after it"
    else:
        hint = "an operator or a closing parenthesis may be missing before it"
    return Unreadable("NS1020", f"{word} is not expected here in the expression", where, hint)
