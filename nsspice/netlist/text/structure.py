"""Blocks of a deck: subcircuit definitions and conditionals, nested as the user nested them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from ..findings import Findings
from .files import card_of
from .lines import Line

#: blocks within blocks; nobody nests .if or .subckt deeper by intent
MAX_NESTING = 50


@dataclass(slots=True)
class Block:
    """Lines and inner blocks in deck order."""

    entries: list[Line | Definition | Conditional] = field(default_factory=list)


@dataclass(slots=True)
class Definition:
    """``.subckt`` ... ``.ends``; the header line is read by the expansion."""

    header: Line
    block: Block = field(default_factory=Block)


@dataclass(slots=True)
class Conditional:
    """``.if`` ... ``.endif``: the lines that open the branches, with their blocks."""

    branches: list[tuple[Line, Block]]


def build(lines: Iterable[Line], findings: Findings) -> Block:
    """Sort lines into blocks.

    Parameters
    ----------
    lines : iterable of Line
        As ``files`` yields them.
    findings : Findings
        Receives blocks left open or closed twice.
    """
    top = Block()
    current = top
    stack: list[tuple[Definition | Conditional, Block]] = []  # what is open, and where it is
    too_deep = 0
    for line in lines:
        card = card_of(line) if line.text.lstrip()[:1] == "." else ""
        if card in ("subckt", "if"):
            if len(stack) >= MAX_NESTING:
                too_deep += 1
                message = f"blocks are nested deeper than {MAX_NESTING}"
                findings.error("NS1042", message, line.whole())
                continue
            block = Block()
            defines = card == "subckt"
            opened = Definition(line, block) if defines else Conditional([(line, block)])
            current.entries.append(opened)
            stack.append((opened, current))
            current = block
        elif card in ("elseif", "else"):
            if stack and isinstance(stack[-1][0], Conditional):
                current = Block()
                stack[-1][0].branches.append((line, current))
            elif not too_deep:
                findings.error("NS1044", f".{card} without .if", line.whole())
        elif card in ("ends", "endif"):
            if too_deep:
                too_deep -= 1
                continue
            kind = Definition if card == "ends" else Conditional
            if stack and isinstance(stack[-1][0], kind):
                current = stack.pop()[1]
            else:
                _misplaced(line, card, stack, findings)
        else:
            current.entries.append(line)
    for opened, _ in stack:
        header = opened.header if isinstance(opened, Definition) else opened.branches[0][0]
        closing = ".ends" if isinstance(opened, Definition) else ".endif"
        findings.error("NS1044", f".{card_of(header)} block has no {closing}", header.whole(),
                       f"close it with {closing}")  # fmt: skip
    return top


def _misplaced(
    line: Line,
    card: str,
    stack: list[tuple[Definition | Conditional, Block]],
    findings: Findings,
) -> None:
    """Report a closing card that closes nothing, or the wrong thing."""
    opener = ".subckt" if card == "ends" else ".if"
    message = f".{card} without {opener}"
    if stack:
        opened = stack[-1][0]
        header = opened.header if isinstance(opened, Definition) else opened.branches[0][0]
        other = ".ends" if isinstance(opened, Definition) else ".endif"
        message = f".{card} is inside the .{card_of(header)} of line {header.number}"
        findings.error("NS1044", message, line.whole(), f"close that one first with {other}")
        return
    findings.error("NS1044", message, line.whole())
