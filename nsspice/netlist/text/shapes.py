"""Parsing by shape: lark sees each sequence of token kinds once.

What an LALR parser does depends on the kinds of the tokens, not on their texts, and a large deck
repeats few sequences (``R1 a b {k*2}`` a thousand times).  A text is cut into tokens by the
grammar's own terminals; for a sequence of kinds that has not come before, lark parses the text and
its tree is kept as a program: which rule to apply to how many results and to which tokens.  The
next text of that shape runs the program.  Programs are flat lists, so deep texts need no recursion.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from . import grammar, store
from .grammar import grammar_text

if TYPE_CHECKING:
    from lark import Token, Tree

#: longer shapes hardly repeat
_MAX_SHAPE = 80
_MAX_SHAPES = 5000
#: shapes kept for later runs: read at every start
_MAX_KEPT = 300

#: rule, number of results it takes from the stack, numbers of its tokens
Step = tuple[str, int, tuple[int, ...]]
Spans = list[tuple[int, int]]


class Misfit(Exception):
    """A text that does not follow the grammar; ``position`` is where lark noticed, if it knows."""

    def __init__(self, position: int | None) -> None:
        super().__init__(position)
        self.position = position


class Shapes:
    """The programs of one grammar.

    Parameters
    ----------
    name : str
        Name of the grammar.
    skip : str
        Characters between tokens, as the inside of a regular character class.
    letters : mapping of str to str
        A letter for each terminal that the caller wants to see in shapes.
    """

    def __init__(self, name: str, skip: str, letters: Mapping[str, str]) -> None:
        self._name = name
        self._skip = skip
        self._given = letters
        self._pattern: re.Pattern[str] | None = None
        self._letters: dict[str, str] = {}
        self._programs: dict[str, tuple[Step, ...]] = {}
        self._kept: dict[str, Any] = {}  # of earlier runs, not yet asked for
        self._changed = False

    def tokens(self, text: str) -> tuple[str, Spans]:
        """Cut a text into tokens.

        Returns
        -------
        tuple
            The shape, one letter for each token (``?`` for a character that starts none), and the
            bounds of the tokens.
        """
        pattern = self._pattern or self._prepare()
        letters = self._letters
        found = [(letters[m.lastgroup or ""], m.span()) for m in pattern.finditer(text)]
        return "".join([letter for letter, _ in found]), [span for _, span in found]

    def _prepare(self) -> re.Pattern[str]:
        """Make one pattern of all terminals, or take what an earlier run has kept."""
        kept = store.load(self._name, grammar_text(self._name))
        try:
            if kept is not None:
                self._letters = dict(kept["letters"])
                self._kept = dict(kept["programs"])
                self._pattern = re.compile(kept["pattern"])
                return self._pattern
        except (KeyError, TypeError, ValueError, re.error):
            self._kept = {}  # not what was written there
        parser = grammar.parser(self._name)
        ignored = set(parser.lexer_conf.ignore)
        terminals = sorted(
            (t for t in parser.terminals if t.name not in ignored),
            key=lambda t: (-t.priority, -t.pattern.max_width, -len(t.pattern.value), t.name),
        )  # the order in which lark tries them
        self._letters = {"": "?"}
        for index, terminal in enumerate(terminals):
            name = terminal.name
            self._letters[name] = self._given.get(name, chr(0x100 + index))
        pattern = "|".join(f"(?P<{t.name}>{t.pattern.to_regexp()})" for t in terminals)
        self._pattern = re.compile(f"{pattern}|[^{self._skip}]")
        return self._pattern

    def program(self, text: str, shape: str, spans: Spans) -> tuple[Step, ...]:
        """Return the program of a text.

        Raises
        ------
        Misfit
            If the text does not follow the grammar.
        """
        found = self._programs.get(shape)
        if found is None:
            found = self._recall(shape)
            if found is None:
                found = _flat(_lark_tree(self._name, text), spans)
                self._changed |= len(shape) <= _MAX_SHAPE
            if len(shape) <= _MAX_SHAPE and len(self._programs) < _MAX_SHAPES:
                self._programs[shape] = found
        return found

    def _recall(self, shape: str) -> tuple[Step, ...] | None:
        """Return the program that an earlier run has kept for a shape."""
        try:
            steps = self._kept[shape]
            return tuple([(str(rule), int(n), tuple(tokens)) for rule, n, tokens in steps])
        except (KeyError, TypeError, ValueError):  # none, or not what was written there
            return None

    def keep(self) -> None:
        """Let later runs have the shapes that are new."""
        if self._changed and self._pattern is not None:
            self._changed = False
            newest = list(self._programs)[-_MAX_KEPT:]  # shapes of this run before older ones
            older = [shape for shape in self._kept if shape not in self._programs]
            chosen = [*newest, *older][:_MAX_KEPT]
            store.save(
                self._name,
                grammar_text(self._name),
                {
                    "letters": self._letters,
                    "pattern": self._pattern.pattern,
                    "programs": {s: self._programs.get(s) or self._kept[s] for s in chosen},
                },
            )


def _lark_tree(name: str, text: str) -> Tree[Token]:
    """Parse a text with lark."""
    from lark import UnexpectedInput

    try:
        return grammar.parser(name).parse(text)
    except UnexpectedInput as error:
        raise Misfit(getattr(error, "pos_in_stream", None)) from None


def _flat(tree: Tree[Token], spans: Spans) -> tuple[Step, ...]:
    """Turn lark's tree into steps, children before parents."""
    numbers = {start: index for index, (start, _) in enumerate(spans)}
    steps: list[Step] = []
    stack = [tree]
    while stack:  # parents before children from the right; reversed at the end
        current = stack.pop()
        trees = [child for child in current.children if not isinstance(child, str)]
        tokens = tuple([numbers[t.start_pos or 0] for t in current.children if isinstance(t, str)])
        steps.append((str(current.data), len(trees), tokens))
        stack.extend(trees)
    steps.reverse()
    return tuple(steps)
