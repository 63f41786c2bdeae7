"""A lexer of SPICE decks for Pygments, which only knows a language of the same name."""

from __future__ import annotations

from typing import ClassVar

from pygments.lexer import RegexLexer, bygroups
from pygments.lexers import _mapping
from pygments.token import Comment, Keyword, Name, Number, Operator, Punctuation, String, Text

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?:meg|mil|[tgkmunpfa])?[a-zµΩ%]*"


__all__ = ["SpiceDeckLexer"]

class SpiceDeckLexer(RegexLexer):
    """Title, element lines, dot cards, numbers with suffixes, nodes, expressions, comments."""

    name = "SPICE deck"
    aliases: ClassVar = ["spice", "netlist"]
    filenames: ClassVar = ["*.net", "*.cir", "*.sp"]
    url = "https://ngspice.sourceforge.io/docs.html"

    tokens: ClassVar = {
        "root": [
            # a title, unless the name has a digit or there are hardly more lines: R1 a b 1k
            (r"\A(?![.*+])(?![A-Za-z]\w*\d\w*\s)[^\n]*\n(?=(?:[^\n]*\n){2})", Name.Namespace),
            (r"^[ \t]*\*[^\n]*", Comment.Single),
            (r"^(\+)", Punctuation, "line"),
            (r"^(\.[A-Za-z]+)", Keyword, "line"),
            (r"^([A-Za-z]\w*)", Name.Builtin, "line"),
            (r"[^\n]+", Text),
            (r"\n", Text),
        ],
        "line": [
            (r"\n(?=\+)", Text),
            (r"\n", Text, "#pop"),
            (r"[ \t]+", Text),
            (r"(?:;|\$ )[^\n]*", Comment.Single),
            (r"\{", Punctuation, "braces"),
            (r"'[^'\n]*'|\"[^\"\n]*\"", String),
            (rf"(?i:{_NUMBER})(?=[\s,;(){{}}=]|$)", Number),
            (r"([A-Za-z_]\w*)([ \t]*)(=)", bygroups(Name.Attribute, Text, Operator)),
            (r"([A-Za-z_]\w*)(\()", bygroups(Name.Function, Punctuation)),
            (r"[A-Za-z_0-9][\w.]*", Name),
            (r"[-+*/<>=!&|?:^]", Operator),
            (r"[(),\[\]+.]", Punctuation),
            (r".", Text),
        ],
        "braces": [
            (r"\}", Punctuation, "#pop"),
            (rf"(?i:{_NUMBER})\b", Number),
            (r"([A-Za-z_]\w*)(\()", bygroups(Name.Function, Punctuation)),
            (r"[A-Za-z_][\w.]*", Name.Variable),
            (r"[-+*/<>=!&|?:^]", Operator),
            (r"\n\+?", Text),
            (r"[^}\n]", Text),
        ],
    }


def register() -> None:
    """Let blocks marked ``spice`` be read by this lexer."""
    _mapping.LEXERS.pop("SpiceLexer", None)
    row = SpiceDeckLexer.name, tuple(SpiceDeckLexer.aliases), tuple(SpiceDeckLexer.filenames), ()
    _mapping.LEXERS["SpiceDeckLexer"] = (__name__, *row)
