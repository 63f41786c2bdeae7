"""``nsspice effects``: which effect of a deck matters, and what it costs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from ..options import NUMBER, confined_option, json_option, param_option, read_params
from ..progress import ProgressBar
from ..report import print_json, say
from ..source import STDIN, circuit_of, path_of


@click.command("effects", short_help="which effects matter, and what they cost")
@click.argument("netlist")
@click.option("--tol", type=NUMBER, default=1e-3, metavar="E", help="Largest change of a measure.")
@click.option("--drop", multiple=True, metavar="NAME", help="Also try removing this element.")
@click.option("-j", "--workers", type=int, metavar="N", help="Processes [all cores].")
@click.option("-o", "--output", metavar="FILE", help="The recommended deck [X.cheap.net].")
@click.option(
    "--plot", is_flag=False, flag_value="auto", metavar="[FILE]", help="Importance against cost."
)
@param_option
@click.option("--force", is_flag=True, help="Replace files that were not written by nsspice.")
@confined_option
@json_option
@click.option("-q", "--quiet", is_flag=True, help="No progress bar.")
def command(
    netlist: str,
    tol: float,
    drop: Sequence[str],
    workers: int | None,
    output: str | None,
    plot: str | None,
    params: Sequence[str],
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Run NETLIST without each of its effects, and recommend what can be left out.

    Its measures may change by --tol in all; without .measure cards averages and extremes of the
    saved signals count.  Every combination that is recommended has been run.  The recommended deck
    is written as X.cheap.net, with what was left out as comments.
    """
    from ...output.atomic_write import whole
    from ...output.files import check_target
    from ...screening import effects

    circuit = circuit_of(netlist, read_params(params))
    name = path_of(netlist).name
    target = Path(output or Path(name).with_suffix(".cheap.net"))
    picture = Path(name).with_suffix(".effects.png") if plot == "auto" else Path(plot or "")
    for file in [target, *([] if plot is None else [picture])]:
        check_target(file, [path_of(netlist)], force)
    with ProgressBar(name, not (quiet or as_json)) as bar:
        report = effects(
            circuit, tol, drop=drop, workers=workers, progress=lambda what, share: bar(share)
        )
    written = []
    if netlist != STDIN and report.dropped:
        source = Path(netlist).read_text("utf-8", errors="replace")
        with whole(target) as part:
            part.write_text(report.deck(source, circuit.deck), "utf-8")
        written.append(str(target))
    if plot is not None:
        report.plot(picture)
        written.append(str(picture))
    if as_json:
        print_json({**report.to_dict(), "files": written})
    else:
        click.echo(report.text(), nl=False)
        if written:
            say(f"  written: {', '.join(written)}")
    if report.interrupted:
        raise SystemExit(130)
