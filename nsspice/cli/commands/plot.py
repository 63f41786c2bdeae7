"""``nsspice plot``: draw CSV files of runs, and of other programs, above one axis."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from ...errors import Diagnostic, UsageError
from ..options import force_option, json_option, read_signals
from ..report import print_json, say

#: panels of a picture without --signals
_MOST = 6


@click.command("plot", short_help="draw CSV files on a shared axis")
@click.argument("files", nargs=-1, required=True, metavar="FILE.csv...")
@click.option("-o", "--output", metavar="FILE", help="Picture: .png, .svg or .pdf [FILE.png].")
@click.option(
    "--signals", multiple=True, metavar="NAMES", help='Signals to draw, such as "v(out) i(l1)".'
)
@click.option("--from", "begin", type=float, metavar="X", help="Start of the axis.")
@click.option("--to", "end", type=float, metavar="X", help="End of the axis.")
@click.option("--title", default="", help="Heading of the picture.")
@click.option("--dark", is_flag=True, help="Draw for a dark page.")
@force_option
@json_option
def command(
    files: Sequence[str],
    output: str | None,
    signals: Sequence[str],
    begin: float | None,
    end: float | None,
    title: str,
    dark: bool,
    force: bool,
    as_json: bool,
) -> None:
    """Overlay the waveforms of CSV files: one panel a signal, one line a file.

    The first column of each file is its axis; files may have different points.  Without --signals
    the first signals that all files share are drawn.
    """
    from ...analyses.signals.signal_names import canonical
    from ...compare.reference import read_table
    from ...output.files import check_target
    from ...output.overlay import Series, overlay

    series = []
    for name in files:
        table = read_table(name)
        axis = table.data[:, 0]
        keep = (axis >= (axis.min() if begin is None else begin)) & (
            axis <= (axis.max() if end is None else end)
        )
        if not keep.any():
            raise UsageError(
                Diagnostic(
                    "NS4009",
                    f"there is nothing to draw: {name} has no row between --from and --to",
                    hint=f"its axis runs from {axis.min():g} to {axis.max():g}",
                )
            )
        columns = {canonical(n): table.data[keep, k] for k, n in enumerate(table.names) if k}
        series.append(Series(Path(name).stem, table.names[0], axis[keep], columns))
    wanted = [canonical(n) for n in read_signals(signals) or ()]
    shared = [n for n in series[0].signals if all(n in s.signals for s in series)]
    names = wanted or shared[:_MOST] or list(series[0].signals)[:_MOST]
    target = Path(output or Path(files[0]).with_suffix(".png").name)
    check_target(target, map(Path, files), force)
    overlay(series, names, target, title, dark=dark)
    if as_json:
        print_json({"files": [str(target)], "signals": names})
        return
    left = len(shared) - _MOST
    more = f"; {left} more signals: name them with --signals" if not wanted and left > 0 else ""
    say(f"written: {target} ({', '.join(names)}){more}")
