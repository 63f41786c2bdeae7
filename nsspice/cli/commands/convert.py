"""``nsspice convert``: a deck of any dialect as a clean one."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from ...output.atomic_write import whole
from ...output.files import check_target, output_error
from ..options import confined_option, force_option, is_confined, json_option
from ..report import print_json, say, show
from ..source import STDIN


@click.command("convert", short_help="turn a deck of another program into a clean one")
@click.argument("netlist")
@click.option("-o", "--output", metavar="FILE", help="The clean deck [standard output].")
@click.option("--notes", metavar="FILE", help="Write the notes here, not on stderr.")
@force_option
@confined_option
@json_option
def command(
    netlist: str, output: str | None, notes: str | None, force: bool, as_json: bool
) -> None:
    """Write what was understood of NETLIST as a deck that needs no other file.

    Each difference is a note: what was left out, replaced or fitted, with its line. The result is
    read again and compared element by element before it is written.
    """
    from ...output.deck.conversion import convert

    source: str | Path = Path(netlist)
    if netlist == STDIN:
        source = sys.stdin.read() + "\n"
    targets = [Path(name) for name in (output, notes) if name not in (None, STDIN)]
    for target in targets:
        check_target(target, [] if netlist == STDIN else [Path(netlist)], force)
    found = convert(source, confined=is_confined())
    listed = "".join(f"{note}\n" for note in found.notes)
    for name, text in ((output, found.text), (notes, listed)):
        if name not in (None, STDIN):
            try:
                with whole(name) as part:
                    part.write_text(text, "utf-8")
            except OSError as error:
                raise output_error(error, name) from error
    if as_json:
        print_json(
            {"deck": found.text, "notes": list(found.notes), "files": list(map(str, targets))}
        )
        return
    if output in (None, STDIN):
        show(found.text, nl=False)
    if notes is None:
        for note in found.notes:
            say(f"note: {note}")
    for target in targets:
        say(f"written: {target}")
