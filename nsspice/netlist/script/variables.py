"""What names stand for in a program: words (``set``), numbers and signals (``let``), functions.

A vector that depends on results is kept as an expression of signals; what cannot be said in one,
such as ``mean(v(out))``, is opaque: it has a name and no value before the circuit has run.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Callable

from ..elements.reading import Reader
from ..elements.template import Formula
from ..expressions.evaluate import rebuild, scalar
from ..expressions.expression import Expression
from ..expressions.expression_parser import resolve, voltage
from ..expressions.node import Node, TooLarge, num, var
from ..findings import Unreadable
from ..text.script import Command

#: constants of ngspice's programs
CONSTANTS = {
    "pi": math.pi, "e": math.e, "c": 299792458.0, "kelvin": -273.15, "echarge": 1.602176634e-19,
    "boltz": 1.380649e-23, "planck": 6.62607015e-34, "true": 1.0, "yes": 1.0, "false": 0.0,
    "no": 0.0,
}  # fmt: skip
_REFERENCE = re.compile(r"\$(&?)(?:\{([^{}]*)\}|([A-Za-z_][\w.]*(?:\[\d+\])?)|(\([^()]*\)))")
_BRANCH = re.compile(r"([\w.]+)#branch")
_WORDS = (
    (r"<>", "!="), (r"\beq\b", "=="), (r"\bne\b", "!="), (r"\bgt\b", ">"), (r"\blt\b", "<"),
    (r"\bge\b", ">="), (r"\ble\b", "<="), (r"\band\b|(?<!&)&(?!&)", "&&"),
    (r"\bor\b|(?<!\|)\|(?!\|)", "||"), (r"\bnot\b|~", "!"), (r"(?<![=!<>])=(?!=)", "=="),
)  # fmt: skip


class Opaque(Exception):
    """A value that is known only after the circuit has run; the text is why."""


class Variables:
    """The variables of one program.

    Parameters
    ----------
    reader : Reader
        For expressions.
    is_node : callable
        Whether a word is the name of a node.
    seed : int
        Of the random numbers.
    """

    def __init__(self, reader: Reader, is_node: Callable[[str], bool], seed: int) -> None:
        self._reader = reader
        self._is_node = is_node
        self.random = random.Random(seed)
        self.drawn = False
        #: plots are not kept apart: all of them have the name of one
        self.words: dict[str, list[str]] = {"curplot": ["plot"]}
        self.vectors: dict[str, Node | None] = {}
        self.measures: set[str] = set()
        self._functions: dict[str, tuple[list[str], str]] = {}

    # -- text --------------------------------------------------------------------------------

    def expand(self, line: Command) -> Command:
        """Return a line with ``$name`` and ``$&vector`` put in.

        Raises
        ------
        Opaque
            For a vector that depends on results.
        Unreadable
            For a name that nobody has set.
        """
        if "$" not in line.raw:
            return line

        def value(found: re.Match[str]) -> str:
            inner = next(text for text in found.groups()[1:] if text is not None)
            if found.group(1):
                return repr(self.number(line, inner.strip("()")))
            return self._word(line, inner)

        raw = _REFERENCE.sub(value, line.raw)
        raw = re.sub(r"\{([^{}$]*)\}", r"\1", raw) if raw != line.raw else raw
        return Command(raw, line.file, line.number, line.source)

    def _word(self, line: Command, name: str) -> str:
        """Return the text of a variable."""
        base, _, index = name.lower().rstrip("]").partition("[")
        if base not in self.words:
            if base in self.vectors:
                return repr(self.number(line, base))
            message = f"variable {base[:60]} is not set"
            raise Unreadable("NS1021", message, line.whole(), f"write set {base[:60]} = ...")
        words = self.words[base]
        return words[int(index) - 1] if index and int(index) <= len(words) else " ".join(words)

    # -- values ------------------------------------------------------------------------------

    def tree(self, line: Command, text: str, extra: dict[str, Node] | None = None) -> Node:
        """Return an expression with all names put in; a number where all of them are numbers.

        Raises
        ------
        Opaque
            If it holds what only a run gives, and no signal stands for.
        """
        text = _BRANCH.sub(r"i(\1)", text)
        for pattern, sign in _WORDS:
            text = re.sub(pattern, sign, text)
        probe = Command(text, line.file, line.number, line.source)
        given = self._reader.formula(probe, 0, len(text))
        if not isinstance(given, Formula):
            return num(given)
        local = extra or {}

        def leaf(node: Node) -> Node:
            word = str(node.value)
            return node if node.op == "var" else self._named(line, word, local)

        def function(name: str, args: list[Node]) -> Node:
            return self._called(line, name.lstrip("?"), args)

        try:
            found = rebuild(given.node, leaf, function)
            return found if Expression(found).variables() else num(scalar(found, {}))
        except TooLarge:
            message = "the expression grows beyond all bounds"
            raise Unreadable("NS1023", message, line.whole()) from None

    def number(self, line: Command, text: str) -> float:
        """Return the number that an expression gives before anything has run."""
        found = self.tree(line, text)
        if found.op != "num":
            raise Opaque(text.strip())
        return float(found.value)

    def define(self, name: str, formals: list[str], body: str) -> None:
        """Keep a function of the program."""
        self._functions[name] = formals, body

    def _named(self, line: Command, word: str, local: dict[str, Node]) -> Node:
        """Return what an identifier stands for."""
        if word in local:
            return local[word]
        if word in self.vectors:
            found = self.vectors[word]
            if found is None:
                raise Opaque(word)
            return found
        if word in self.measures:
            return var(word)
        if self._is_node(word):
            return voltage(word)
        if word in CONSTANTS:
            return num(CONSTANTS[word])
        if word == "time":
            return var(word)
        message = f"vector {word[:60]} is not defined"
        raise Unreadable("NS1021", message, line.whole(), f"write let {word[:60]} = ...", word)

    def _called(self, line: Command, name: str, args: list[Node]) -> Node:
        """Return the value of a function of the program, a random number, or a known function."""
        if name in self._functions:
            formals, body = self._functions[name]
            if len(formals) == len(args):
                return self.tree(line, body, dict(zip(formals, args, strict=True)))
        if name in ("sgauss", "sunif", "rnd"):
            self.drawn = True
            if name == "rnd":
                limit = float(args[0].value) if args and args[0].op == "num" else 1.0
                return num(float(self.random.randrange(max(int(limit), 1))))
            draw = self.random.gauss(0.0, 1.0) if name == "sgauss" else self.random.uniform(-1, 1)
            return num(draw)
        if name == "log":  # to the base of ten in a program, unlike in a netlist
            name = "log10"
        try:
            return resolve(name, args, [], line.whole())
        except Unreadable:
            raise Opaque(f"{name}()") from None
