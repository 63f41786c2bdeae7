"""Every error code of the program stands in docs/reference/errors.md, and no code in vain."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
CODE = re.compile(r"\bNS[1-6]\d{3}\b")


def codes_in_use() -> dict[str, set[str]]:
    """Return every code with the files that use it; examples in docstrings count too."""
    found: dict[str, set[str]] = {}
    for path in sorted((ROOT / "nsspice").rglob("*.py")):
        for code in CODE.findall(path.read_text(encoding="utf-8")):
            found.setdefault(code, set()).add(path.relative_to(ROOT).as_posix())
    return found


def documented() -> list[str]:
    """Return the codes that have a row of their own."""
    text = (ROOT / "docs" / "reference" / "errors.md").read_text(encoding="utf-8")
    return re.findall(r"^\| (NS\d{4}) \|", text, flags=re.MULTILINE)


def test_every_code_is_documented() -> None:
    missing = {c: f for c, f in codes_in_use().items() if c not in documented()}
    assert not missing, "add a row to docs/reference/errors.md"


def test_no_row_is_stale() -> None:
    assert set(documented()) <= set(codes_in_use())


def test_rows_are_in_order_and_unique() -> None:
    rows = documented()
    assert rows == sorted(set(rows))
