"""What the tutorial shows at each step: schematic, real output and picture of its commands."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from click.testing import CliRunner

import nsspice
from nsspice.cli.app import app
from nsspice.output.schematic import schematic

PAGE = "tutorial/ten-steps.md"
#: a block of the page: a file that it shows, or commands
_BLOCK = re.compile(
    r'^```(spice|toml|console)(?: title="([^"]+)")?\n(.*?)^```\n', flags=re.MULTILINE | re.DOTALL
)
#: times of runs differ from build to build
_TIME = re.compile(r" in [\d.]+ [µmn]?s$", flags=re.MULTILINE)


@cache
def shown(root: Path) -> tuple[str, dict[str, bytes]]:
    """Return the page with all results, and its pictures by their name in the site."""
    text = (root / "docs" / PAGE).read_text("utf-8")
    pictures: dict[str, bytes] = {}
    parts: list[str] = []
    last = 0
    with tempfile.TemporaryDirectory() as folder, _inside(folder):
        for match in _BLOCK.finditer(text):
            parts.append(text[last : match.end()])
            last = match.end()
            kind, name, body = match.groups()
            if name:
                Path(name).write_text(body, "utf-8")
            if kind == "spice" and name:
                parts.append(_drawn(name, body, pictures))
            elif kind == "console":
                parts += [_result(line, pictures) for line in body.splitlines()]
        parts.append(text[last:])
    return "".join(parts), pictures


@contextlib.contextmanager
def _inside(folder: str) -> Iterator[None]:
    """Work in a folder."""
    before = os.getcwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def _drawn(name: str, deck: str, pictures: dict[str, bytes]) -> str:
    """Return the schematic of a deck."""
    stem = Path(name).stem
    try:
        circuit = nsspice.read(deck)
    except nsspice.NsspiceError:
        return ""
    pictures[f"tutorial/{stem}.schematic.svg"] = schematic(circuit).encode()
    return f"\n![schematic of {name}]({stem}.schematic.svg){{ .schematic loading=lazy }}\n"


def _result(line: str, pictures: dict[str, bytes]) -> str:
    """Return what a command prints, and the picture that it draws."""
    if not line.startswith("$ nsspice "):
        return ""
    arguments = shlex.split(line.removeprefix("$ nsspice "), comments=True)
    drawn = "--plot" in arguments
    done = CliRunner().invoke(app, [*arguments, *(["--force"] if arguments[0] == "run" else [])])
    output = _TIME.sub("", done.output).rstrip()
    if drawn:
        stem = Path(arguments[1]).stem
        name = f"{stem}.{len(pictures)}.png"
        pictures[f"tutorial/{name}"] = Path(f"{stem}.png").read_bytes()
        return f"\n```text\n{output}\n```\n\n![waveforms of {stem}]({name}){{ .waveform loading=lazy }}\n"
    return f"\n```text\n{output}\n```\n"
