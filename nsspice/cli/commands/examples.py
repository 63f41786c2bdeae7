"""``nsspice examples``: the collection of netlists that is installed with the program."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import click

from ...errors import Diagnostic, UsageError, suggest
from ..options import json_option
from ..report import print_json, say

#: the collection: files of the package where it is installed, a link to the sources in a checkout
COLLECTION = Path(__file__).parents[2] / "netlists"
#: what belongs to a netlist besides itself
_COMPANION = ".expect.toml"


@click.command("examples", short_help="list or copy the collection of netlists")
@click.argument("action", required=False, type=click.Choice(["list", "copy", "show"]))
@click.argument("names", nargs=-1, metavar="[NAME]...")
@click.option("--to", "target", metavar="FOLDER", default=".", help="Where to copy to.")
@click.option("--force", is_flag=True, help="Replace existing files.")
@json_option
def command(
    action: str | None, names: Sequence[str], target: str, force: bool, as_json: bool
) -> None:
    """List the netlists that come with the program, print some, or copy some with their checks.

    NAME is a folder (converters), a netlist (buck) or both (converters/buck); all without one.

    \b
    nsspice examples                       what there is
    nsspice examples show buck             print a deck
    nsspice examples copy converters       copy a folder into the current one
    """
    found = sorted(_chosen(names))
    if action in (None, "list"):
        _list(found, as_json)
    elif action == "show":
        for path in found:
            click.echo(path.read_text("utf-8").rstrip())
    else:
        _copy(found, Path(target), force, as_json)


def _chosen(names: Sequence[str]) -> Iterator[Path]:
    """Return the netlists that the arguments name."""
    every = sorted(COLLECTION.rglob("*.net"))
    if not every:
        raise UsageError(
            Diagnostic(
                "NS4019",
                "this installation has no collection of netlists",
                hint="the decks are in the folder netlists of the source code",
            )
        )
    if not names:
        yield from every
    for name in names:
        wanted = name.removesuffix(".net").strip("/")
        hits = [p for p in every if wanted in _names_of(p)]
        if not hits:
            known = {n for p in every for n in _names_of(p)}
            raise UsageError(
                Diagnostic(
                    "NS4019",
                    f"there is no example {name!r}",
                    hint=suggest(wanted, known) or "nsspice examples lists them",
                )
            )
        yield from hits


def _names_of(path: Path) -> tuple[str, ...]:
    """Return folder, netlist and both: what an argument may say."""
    inner = path.relative_to(COLLECTION).with_suffix("")
    return inner.parent.as_posix(), inner.name, inner.as_posix()


def _title(path: Path) -> str:
    with path.open(encoding="utf-8") as file:
        return file.readline().strip().lstrip("* ")


def _list(found: Sequence[Path], as_json: bool) -> None:
    entries = [(p.relative_to(COLLECTION).with_suffix("").as_posix(), _title(p)) for p in found]
    if as_json:
        print_json([{"name": name, "title": title} for name, title in entries])
        return
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("name", no_wrap=True)
    table.add_column("title")
    for name, title in entries:
        table.add_row(name, title)
    console = Console()
    if not console.is_terminal:  # a pipe has no width to wrap at
        console.width = 200
    console.print(table)


def _copy(found: Sequence[Path], target: Path, force: bool, as_json: bool) -> None:
    """Copy netlists with what belongs to them, keeping their folders."""
    pairs = []
    for path in found:
        for file in (path, *_companions(path)):
            pairs.append((file, target / file.relative_to(COLLECTION)))
    pairs = list(dict.fromkeys(pairs))  # waveforms that several netlists are compared with
    taken = [t for _, t in pairs if t.exists()]
    if taken and not force:
        raise UsageError(
            Diagnostic(
                "NS4019",
                f"{taken[0]} already exists" + (f", and {len(taken) - 1} more" * (len(taken) > 1)),
                hint="copy elsewhere with --to FOLDER, or replace with --force",
            )
        )
    for source, copy in pairs:
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, copy)
    if as_json:
        print_json([str(t) for _, t in pairs])
    else:
        count = f"{len(found)} netlist" + "s" * (len(found) != 1)
        say(f"{count} copied; try: nsspice test {target / _top(found[0])}")


def _companions(netlist: Path) -> list[Path]:
    """Return the expectations of a netlist and the waveforms that they name."""
    from ...compare.checks import WaveformCheck
    from ...compare.expectation import read_expectation

    expected = netlist.with_suffix(_COMPANION)
    if not expected.exists():
        return []
    checks = read_expectation(netlist).checks
    names = dict.fromkeys(c.reference for c in checks if isinstance(c, WaveformCheck))
    return [expected, *(netlist.parent / name for name in names)]


def _top(path: Path) -> str:
    return path.relative_to(COLLECTION).parts[0]
