"""The two lark parsers, built when first needed and kept on disk between runs.

Lark takes some 40 ms to turn a grammar text into tables, most of a small run, and 2 ms to load the
tables.  They are kept in the user's cache folder; every step of that may fail (no folder,
read-only, half a file, another version) and then the parser is built as if there were no cache.
"""

from __future__ import annotations

import hashlib
import io
import os
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lark import Lark

_HERE = Path(__file__).parent


@cache
def line_parser() -> Lark:
    """Return the parser of logical lines (``grammar.lark``)."""
    return _parser("grammar.lark")


@cache
def expression_parser() -> Lark:
    """Return the parser of expressions (``expression.lark``)."""
    return _parser("expression.lark")


def cache_folder() -> Path | None:
    """Return the folder for parser tables, or None when there must be none.

    ``NSSPICE_CACHE`` names another folder; an empty value switches the cache off.
    """
    chosen = os.environ.get("NSSPICE_CACHE")
    if chosen is not None:
        return Path(chosen) if chosen else None
    base = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME")
    try:
        return Path(base or Path.home() / ".cache") / "nsspice"
    except RuntimeError:  # a process without a home
        return None


def _parser(name: str) -> Lark:
    """Load a parser's tables from the cache, or build them and try to keep them."""
    import lark

    text = (_HERE / name).read_text(encoding="utf-8")
    folder = cache_folder()
    if folder is None:
        return lark.Lark(text, parser="lalr", lexer="basic", maybe_placeholders=False)
    identity = f"{text}|{lark.__version__}|{sys.version}".encode()
    path = folder / f"{Path(name).stem}-{hashlib.sha256(identity).hexdigest()[:24]}.tables"
    found = _load(path, lark.Lark)
    if found is None:
        found = lark.Lark(text, parser="lalr", lexer="basic", maybe_placeholders=False)
        _store(path, found)
    return found


def _load(path: Path, kind: type[Lark]) -> Lark | None:
    """Return the parser kept in a file, None if it cannot be trusted or read."""
    try:
        status = path.stat()
        if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o022):
            return None  # tables are unpickled: only a file that is ours alone is read
        return kind.load(io.BytesIO(path.read_bytes()))
    except Exception:  # a damaged pickle may raise anything; building anew is always right
        return None


def _store(path: Path, parser: Lark) -> None:
    """Keep a parser: written aside and renamed, so that no other process sees half a file."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        handle, temporary = tempfile.mkstemp(dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                parser.save(file)
            os.replace(temporary, path)
        except BaseException:
            os.unlink(temporary)
            raise
    except OSError:
        return
