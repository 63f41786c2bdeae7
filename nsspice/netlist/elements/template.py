"""The content of one element line, before parameters and node names of an instance are put in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from ...errors import Span
from ..expressions.node import Node
from ..text.lines import Line


@dataclass(frozen=True, slots=True)
class Formula:
    """An expression with names still to be looked up, and its place.

    ``start`` and ``end`` bound the expression in the line, without braces; ``made`` marks one that
    was put together from a TABLE or POLY and has no text of its own.
    """

    node: Node
    line: Line
    start: int
    end: int
    made: bool = False

    @property
    def span(self) -> Span:
        """Place of the expression."""
        return self.line.span(self.start, self.end)

    @property
    def text(self) -> str:
        """The expression as written."""
        return self.line.raw[self.start : self.end].strip()


#: a number, or an expression that an instance turns into a number
Value = float | Formula


@dataclass(frozen=True, slots=True)
class GridText:
    """Named lists of values, ``table(i=0 10 e=0 1m)``."""

    lists: dict[str, tuple[Value, ...]]


@dataclass(frozen=True, slots=True)
class ParamText:
    """A ``name=value`` item; ``word`` is set for a value that may be a plain word."""

    value: Value | str | GridText
    span: Span
    word: str = ""


@dataclass(frozen=True, slots=True)
class RepeatTemplate:
    """A part of the values of a PWL that is repeated, see ``repetition.Repetition``."""

    first: int
    last: int
    count: Value
    span: Span


@dataclass(slots=True)
class SourceTemplate:
    """Value of an independent source, see ``deck.Source``.

    ``relative`` holds the places of those values of a PWL that count from the time before,
    ``repeats`` its repeated parts.
    """

    span: Span
    dc: Value | None = None
    ac: tuple[Value, Value] | None = None
    kind: str = ""
    values: list[Value] = field(default_factory=list)
    relative: tuple[int, ...] = ()
    repeats: tuple[RepeatTemplate, ...] = ()
    options: dict[str, Value] = field(default_factory=dict)


@dataclass(slots=True)
class Template:
    """One element line; names are local to the subcircuit, see ``deck.Element``.

    ``control_kind`` says whether ``controls`` are nodes or elements; ``transfer`` is a function of
    s, or of z if it is ``sampled``, between the value, which is its input, and the output.
    """

    name: str
    letter: str
    span: Span
    nodes: tuple[str, ...] = ()
    node_spans: tuple[Span, ...] = ()
    controls: tuple[str, ...] = ()
    control_kind: str = ""
    value: Value | None = None
    quantity: str = ""
    transfer: Formula | None = None
    sampled: bool = False
    model: str = ""
    model_span: Span | None = None
    source: SourceTemplate | None = None
    params: dict[str, ParamText] = field(default_factory=dict)
    flags: dict[str, Span] = field(default_factory=dict)


@dataclass(slots=True)
class ModelTemplate:
    """A ``.model`` card with its values still to be evaluated.

    ``base`` is the model whose parameters it has besides (``ako:``).
    """

    name: str
    type: str
    span: Span
    params: dict[str, ParamText]
    base: str = ""


@dataclass(slots=True)
class InstanceTemplate:
    """An X line."""

    name: str
    span: Span
    nodes: tuple[str, ...]
    node_spans: tuple[Span, ...]
    subcircuit: str
    subcircuit_span: Span
    params: dict[str, ParamText]


class Port(NamedTuple):
    """A terminal of a code model: two nodes, its type (``vd i d``) and whether it is inverted."""

    plus: str
    minus: str
    kind: str = ""
    inverted: bool = False


@dataclass(slots=True)
class CodeTemplate:
    """An A line: an XSPICE code model; ports are vectors, most of one member."""

    name: str
    span: Span
    ports: tuple[tuple[Port, ...], ...]
    model: str
    model_span: Span
    params: dict[str, ParamText] = field(default_factory=dict)
    #: whether ``model`` is the name of one of LTspice's devices
    own: bool = False

    @property
    def nodes(self) -> tuple[str, ...]:
        """All nodes but ground, each once."""
        members = [port for vector in self.ports for port in vector]
        names = [n for port in members for n in (port.plus, port.minus)]
        return tuple(dict.fromkeys(n for n in names if n not in ("0", "null")))

    def renamed(self, names: Mapping[str, str]) -> CodeTemplate:
        """Return the line with other names of its nodes."""
        ports = tuple(
            tuple(
                port._replace(
                    plus=names.get(port.plus, port.plus), minus=names.get(port.minus, port.minus)
                )
                for port in vector
            )
            for vector in self.ports
        )
        return replace(self, ports=ports)


@dataclass(slots=True)
class FunctionTemplate:
    """A ``.func``: formal names and body."""

    name: str
    formals: tuple[str, ...]
    body: Formula
    span: Span
