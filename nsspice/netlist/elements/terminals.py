"""The common part of all element lines: name, nodes, the items after them, parameters."""

from __future__ import annotations

from collections.abc import Collection

from ...element_kinds import KINDS
from ...errors import Span
from ..findings import Unreadable
from ..text.lines import Line
from ..text.statement import Item
from .reading import Reader, flat
from .template import Formula, ParamText, Template, Value

GROUND = {"gnd": "0", "0": "0", "gnd!": "0"}


class Terminals:
    """Takes an element line apart from left to right.

    Parameters
    ----------
    reader : Reader
        For values.
    line : Line
        The line.
    items : list of Item
        Its items.
    """

    def __init__(self, reader: Reader, line: Line, items: list[Item]) -> None:
        self.reader = reader
        self.line = line
        self.name = items[0].text
        self.span = line.span(items[0].start, len(line.raw.rstrip()))
        self.nodes: tuple[str, ...] = ()
        self.node_spans: tuple[Span, ...] = ()
        self.pairs: list[Item] = []
        self._plain = line.plain
        self._items = items[1:] if self._plain else list(flat(items[1:], self.pairs))
        self._at = 0

    def take_nodes(self, count: int, what: str = "nodes") -> None:
        """Take the next items as node names."""
        chosen = self._items[self._at : self._at + count]
        if len(chosen) < count:
            message = f"{self.name}: {count} {what} are needed, {len(chosen)} given"
            kind = KINDS.get(self.name[0])
            hint = f"write {kind.form}" if kind else ""
            raise Unreadable("NS1008", message, self.span, hint)
        self._at += count
        line = self.line
        if not self._plain:
            for item in chosen:
                if item.kind != "word":
                    message = f"{self.name}: {item.text[:40]} is not a node name"
                    raise Unreadable("NS1009", message, line.span(item.start, item.end))
        self.nodes += tuple([GROUND.get(item.text, item.text) for item in chosen])
        self.node_spans += tuple([line.span(item.start, item.end) for item in chosen])

    def template(self) -> Template:
        """Return the element so far."""
        return Template(self.name, self.name[0], self.span, self.nodes, self.node_spans)

    def next(self) -> Item | None:
        """Take the next item, None at the end."""
        if self._at >= len(self._items):
            return None
        self._at += 1
        return self._items[self._at - 1]

    def peek(self) -> Item | None:
        """Look at the next item."""
        return self._items[self._at] if self._at < len(self._items) else None

    def ahead(self) -> list[Item]:
        """Look at all remaining items."""
        return self._items[self._at :]

    def next_name(self) -> Item | None:
        """Take the next item if it is a word and not a number."""
        item = self.peek()
        if item is None or item.kind != "word" or item.text[0] in "0123456789.+-":
            return None
        self._at += 1
        return item

    def until(self, words: Collection[str]) -> list[Item]:
        """Take all items before the next of some words."""
        items, first = self._items, self._at
        count = len(items)
        while self._at < count:
            item = items[self._at]
            if item.text in words and item.kind == "word":
                break
            self._at += 1
        return items[first : self._at]

    def rest(self) -> list[Item]:
        """Take all remaining items."""
        left = self._items[self._at :]
        self._at = len(self._items)
        return left

    def word(self, item: Item | None, what: str) -> str:
        """Return the name that an item holds."""
        if item is None:
            raise Unreadable("NS1008", f"{self.name}: {what} is missing", self.span)
        if item.kind != "word":
            where = self.line.span(item.start, item.end)
            raise Unreadable("NS1009", f"{self.name}: {item.text[:40]} is not {what}", where)
        return item.text

    def model(self, result: Template, item: Item | None, needed: str) -> None:
        """Put a model name into the element; without one report what is needed."""
        if item is None:
            if needed:
                message = f"{self.name}: the name of its .model is missing"
                raise Unreadable("NS1008", message, self.span, needed)
            return
        result.model = self.word(item, "the name of a model")
        result.model_span = self.line.span(item.start, item.end)

    def params(self, known: Collection[str]) -> dict[str, ParamText]:
        """Return the ``name=value`` items."""
        if not self.pairs:
            return {}
        return self.reader.params(self.line, self.pairs, known, self.name)

    def extend_pairs(self, key: str, other: str) -> None:
        """Let a second value behind a comma set another parameter, as in ``tc=1m,2u``."""
        for pair in self.pairs:
            if pair.text != key:
                continue
            for index in range(self._at, len(self._items)):
                item = self._items[index]
                if item.start > pair.end and self.line.text[pair.end : item.start].strip() == ",":
                    del self._items[index]
                    self.pairs.append(Item("pair", other, item.start, item.end, (item, item)))
                    return

    def param_value(self, param: ParamText) -> Value:
        """Return a parameter's value where a number or an expression is needed."""
        if isinstance(param.value, (float, Formula)):
            return param.value
        line = self.line
        pair = next(p for p in self.pairs if line.span(p.start, p.end) == param.span)
        return self.reader.value(line, pair.items[1])

    def flags(self, result: Template, known: Collection[str]) -> None:
        """Take words such as ``on`` and ``off``."""
        while (item := self.peek()) is not None and item.text in known and item.kind == "word":
            self._at += 1
            result.flags[item.text] = self.line.span(item.start, item.end)

    def finish(self, result: Template) -> None:
        """Report items that nobody asked for."""
        item = self.peek()
        if item is None:
            return
        line = self.line
        where = line.span(item.start, item.end)
        shown = line.raw[item.start : item.end][:40]
        before = line.text[max(item.start - 2, 0) : item.start]
        if (
            len(before) == 2
            and before[1] == ","
            and before[0].isdigit()
            and item.text[:1].isdigit()
        ):
            raise Unreadable("NS1013", f"{self.name}: the comma separates two values here", where,
                             "write decimals with a point: 1.5")  # fmt: skip
        hint = "give one value; write the unit without a blank: 1kOhm"
        raise Unreadable("NS1009", f"{self.name}: {shown} is not expected here", where, hint)
