"""Words that an outsider cannot look up, and English that nobody writes: `python tools/words.py`.

Exits with 1 if one of them is used in the files named as arguments; without any, all pages of the
documentation and the comments of the compiled core are read, and for their English also the
changelog and the docstrings, comments and messages of the package.
"""

from __future__ import annotations

import ast
import io
import re
import sys
import tokenize
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "nsspice"
CORE = PACKAGE / "core" / "src"

#: titles of netlists and figures of measurements, written by tools
GENERATED = {"work-precision.md", "hard-cases.md"}

#: what is written: what a textbook or SPICE's manual calls it
WORDS = {
    r"laws hold|law is missed|misses a law": "KCL, KVL, constitutive equation; residual",
    r"sums? of laws": "cut-set (supernode) equations",
    r"tie[sd]?|weak ties?": "connect, couple; high-impedance connection",
    r"coils?": "inductor",
    r"windings without leakage": "perfectly coupled inductors (k = 1)",
    r"leaps?|impulsive steps?": "state jump, reinitialisation",
    r"aftermath|stands behind|what stands": "values at t+",
    r"(?:right )?behind an event|behind a jump": "after, at t+",
    r"at once": "algebraic; simultaneously; immediately",
    r"drowned|lost in rounding": "cancellation, loss of significance",
    r"bends?|bent": "curvature, kink",
    r"corners?": "breakpoint",
    r"stretch(?:es)?": "recorded interval",
    r"witness(?:es)? of a run": "recorder, trace",
    r"crowds?|pile[sd]? up": "event accumulation, Zeno behaviour",
    r"pass(?:es|ed)? over": "step across an event",
    r"ladders? of (?:steps|lengths)|rungs?": "step-size levels",
    r"is told by|told apart": "is determined by; distinguished",
}
#: literal translations: what a native speaker writes
ENGLISH = {
    r"stands?(?! (?:for|out|by)\b)": "is, is given, is listed, appears",
    r"tells?|told": "says, reports, shows, determines, distinguishes",
    r"whatever": "for any, regardless of",
    r"belongs? into": "belongs in",
    r"some (?:milli|micro|nano)?(?:seconds|volts|amperes|metres)": "a few milliseconds",
    r"of no importance": "does not matter",
    r"anew": "again, new",
    r"beside": "next to, with, compared with",
    r"in silence": "silently",
    r"need be": "if necessary",
    r"as (?:it|they) stands?": "as it is",
}
#: in Python files, where the nouns of the compiled core do not occur
PLAIN = {
    r"(?<!here )is no (?!longer|more|further|such|one\b)\w+": "is not a",
    r"(?<!here )are no (?!longer|more|further|such)\w+": "are not",
    r"any more": "no longer",
    r"bears?": "has, carries",
}
#: a text with so many spaces is a sentence, not a key
_SPACES = 2


def compiled(words: dict[str, str]) -> list[tuple[re.Pattern[str], str]]:
    """Return the patterns of a table, each with what to write."""
    return [(re.compile(rf"\b(?:{word})\b", re.IGNORECASE), say) for word, say in words.items()]


_ENGLISH = compiled(ENGLISH)
PATTERNS = compiled(WORDS) + _ENGLISH
_PYTHON = _ENGLISH + compiled(PLAIN)
_CODE = re.compile(
    r"^ *```.*?^ *```|``[^`]*``|`[^`\n]*`|\]\([^)]*\)", flags=re.DOTALL | re.MULTILINE
)

#: lines of docstrings that are code: examples, and parameters with their types
_NO_PROSE = re.compile(r" *(?:>>>|\.\.\.|[\w*, ]+ : )")


def findings(
    text: str, patterns: list[tuple[re.Pattern[str], str]] = PATTERNS
) -> list[tuple[int, str, str]]:
    """Return line, word and what to say, outside of code and links.

    Examples
    --------
    >>> findings("the coil\\n`coil`")
    [(1, 'coil', 'inductor')]
    """
    prose = _CODE.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)
    found = []
    for pattern, field in patterns:
        for match in pattern.finditer(prose):
            found.append((prose.count("\n", 0, match.start()) + 1, match[0], field))
    return sorted(found)


def pages_of(root: Path) -> list[Path]:
    """Return all pages that people have written."""
    pages = [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "docs").rglob("*.md"))]
    return [page for page in pages if page.name not in GENERATED]


def comments_of(source: str) -> str:
    """Return the comments of Rust code, line by line.

    Examples
    --------
    >>> comments_of("let coils = 1; // of the core\\n/// # Errors")
    ' of the core\\n # Errors'
    """
    lines = (line.partition("//")[2].lstrip("/!") for line in source.split("\n"))
    return "\n".join(lines)


def docstrings_of(source: str) -> str:
    """Return the docstrings, comments and messages of Python code, line by line.

    Examples
    --------
    >>> docstrings_of('stands = "stands"  # stands\\n')
    '# stands\\n'
    """
    lines = source.split("\n")
    found = [""] * len(lines)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            found[token.start[0] - 1] = token.string
    tree = ast.parse(source)
    docs = [
        n for n in ast.walk(tree) if isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant)
    ]
    for node in docs:
        for k in range(node.lineno - 1, node.end_lineno or node.lineno):
            found[k] = "" if _NO_PROSE.match(lines[k]) else lines[k]
    inside = {id(node.value) for node in docs}
    for part in ast.walk(tree):
        if not isinstance(part, ast.Constant) or not isinstance(part.value, str):
            continue
        if id(part) not in inside and part.value.count(" ") >= _SPACES:
            found[part.lineno - 1] += " " + " ".join(part.value.split())
    return "\n".join(found)


def read(page: Path) -> tuple[str, list[tuple[re.Pattern[str], str]]]:
    """Return the prose of a file, and the patterns for it."""
    text = page.read_text("utf-8")
    if page.suffix == ".rs":
        return comments_of(text), PATTERNS
    if page.suffix == ".py":
        return docstrings_of(text), _PYTHON
    return text, _ENGLISH if page.name == "CHANGELOG.md" else PATTERNS


def main(names: list[str]) -> int:
    """Print what was found in the files; return the exit code."""
    code = [*sorted(CORE.rglob("*.rs")), *sorted(PACKAGE.rglob("*.py"))]
    files = [Path(n) for n in names] or [*pages_of(ROOT), ROOT / "CHANGELOG.md", *code]
    count = 0
    for page in files:
        for line, word, field in findings(*read(page)):
            print(f"{page}:{line}: {word!r}: say {field}")
            count += 1
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
