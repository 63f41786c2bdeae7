"""The lark parsers, built when a line or an expression of a new shape comes."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lark import Lark


def grammar_text(name: str) -> str:
    """Return a grammar of this folder: ``grammar`` (lines) or ``expression``."""
    return Path(__file__).with_name(f"{name}.lark").read_text(encoding="utf-8")


@cache
def parser(name: str) -> Lark:
    """Return the parser of a grammar; importing lark and building it takes some 60 ms."""
    from lark import Lark

    return Lark(grammar_text(name), parser="lalr", lexer="basic", maybe_placeholders=False)
