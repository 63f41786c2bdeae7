"""Parsed shapes kept between runs, so that a small deck need not wait for lark.

One JSON file for each grammar in the user's cache folder.  It holds the grammar text it belongs to;
a file of another version, half a file, a folder that cannot be written: all of that means only that
lark does the work again.  Files are written aside and renamed, so that processes that run at the
same time see whole files, of which the last one stays.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

#: changed with the layout of the files or the meaning of the steps
_LAYOUT = 1
_MAX_BYTES = 20_000_000


def folder() -> Path | None:
    """Return the folder for kept shapes, or None when there must be none.

    ``NSSPICE_CACHE`` names another folder; an empty value switches the store off.
    """
    chosen = os.environ.get("NSSPICE_CACHE")
    if chosen is not None:
        return Path(chosen) if chosen else None
    base = os.environ.get("LOCALAPPDATA" if os.name == "nt" else "XDG_CACHE_HOME")
    try:
        return Path(base or Path.home() / ".cache") / "nsspice"
    except RuntimeError:  # a process without a home
        return None


def load(name: str, grammar: str) -> dict[str, Any] | None:
    """Return what was kept for a grammar.

    Parameters
    ----------
    name : str
        Name of the grammar.
    grammar : str
        Its text; what was kept for another text is left alone.
    """
    place = folder()
    if place is None:
        return None
    try:
        path = place / f"{name}.json"
        status = path.stat()
        if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o022):
            return None  # somebody else could have put other shapes into it
        if status.st_size > _MAX_BYTES:
            return None
        kept = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(kept, dict) or kept.get("for") != [_LAYOUT, grammar]:
        return None
    return kept


def save(name: str, grammar: str, kept: dict[str, Any]) -> None:
    """Keep something for a grammar, if that is possible."""
    place = folder()
    if place is None:
        return
    aside = place / f"{name}.{os.getpid()}"
    try:
        place.mkdir(parents=True, exist_ok=True, mode=0o700)
        text = json.dumps({"for": [_LAYOUT, grammar], **kept}, separators=(",", ":"))
        handle = os.open(aside, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        try:
            with os.fdopen(handle, "w", encoding="utf-8") as file:
                file.write(text)
            os.replace(aside, place / f"{name}.json")
        except BaseException:
            os.unlink(aside)
            raise
    except OSError:
        return
