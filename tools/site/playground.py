"""The playground of the site: the decks of the gallery, and what `make playground` has built."""

from __future__ import annotations

import json
from pathlib import Path

import gallery


def decks(root: Path) -> list[dict[str, str]]:
    """Return name and text of every deck of the gallery that is not one to be refused."""
    found = []
    for folder in gallery.HEADINGS:
        for netlist in sorted((root / folder).glob("*.net")):
            expected = netlist.with_suffix(".expect.toml").read_text("utf-8")
            if "[refused]" not in expected:
                name = f"{folder}/{netlist.stem}"
                found.append({"name": name, "text": netlist.read_text("utf-8")})
    return found


def files(root: Path) -> dict[str, str | bytes]:
    """Return the files of the playground by their names in the site.

    Without a build of the core they are the decks alone, and the page says so.
    """
    built = root / "build" / "playground"
    made: dict[str, str | bytes] = {
        f"playground/{path.relative_to(built).as_posix()}": path.read_bytes()
        for path in sorted(built.rglob("*"))
        if path.is_file()
    }
    made["playground/decks.json"] = json.dumps(decks(root / "netlists"), ensure_ascii=False)
    return made
