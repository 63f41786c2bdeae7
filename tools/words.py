"""Words that an outsider cannot look up, and the field's own: `python tools/words.py [FILE ...]`.

Exits with 1 if one of them is used.  Without arguments all pages of the documentation and all
comments of the compiled core are read.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
CORE = ROOT / "nsspice" / "core" / "src"

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
PATTERNS = [(re.compile(rf"\b(?:{word})\b", re.IGNORECASE), field) for word, field in WORDS.items()]
_CODE = re.compile(r"^ *```.*?^ *```|`[^`\n]*`|\]\([^)]*\)", flags=re.DOTALL | re.MULTILINE)


def findings(text: str) -> list[tuple[int, str, str]]:
    """Return line, word and what the field says, outside of code and links.

    Examples
    --------
    >>> findings("the coil\\n`coil`")
    [(1, 'coil', 'inductor')]
    """
    prose = _CODE.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)
    found = []
    for pattern, field in PATTERNS:
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


def main(names: list[str]) -> int:
    """Print what was found in the files; return the exit code."""
    files = [Path(n) for n in names] or [*pages_of(ROOT), *sorted(CORE.rglob("*.rs"))]
    count = 0
    for page in files:
        text = page.read_text("utf-8")
        text = comments_of(text) if page.suffix == ".rs" else text
        for line, word, field in findings(text):
            print(f"{page}:{line}: {word!r}: say {field}")
            count += 1
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
