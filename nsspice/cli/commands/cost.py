"""``nsspice cost``: what accuracy costs with every method."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from ..options import NUMBER, confined_option, json_option, param_option, read_params, read_signals
from ..report import print_json, say, show
from ..source import circuit_of, path_of


@click.command("cost", short_help="measure what accuracy costs with every method")
@click.argument("netlist")
@click.option(
    "--target",
    type=NUMBER,
    metavar="E",
    help="Report the cheapest method that reaches this error (relative to each signal's range).",
)
@click.option(
    "--methods", multiple=True, metavar="NAMES", help="Only these methods; may be repeated."
)
@click.option("--signals", multiple=True, metavar="NAMES", help="Measure errors in these signals.")
@click.option(
    "--limit", type=NUMBER, default=2.0, show_default=True, help="Longest time of one run [s]."
)
@click.option(
    "--plot",
    is_flag=False,
    flag_value="auto",
    metavar="[FILE]",
    help="Draw error against time in a .png, .svg or .pdf file.",
)
@click.option("--force", is_flag=True, help="Replace files that were not written by nsspice.")
@param_option
@click.option("-q", "--quiet", is_flag=True, help="Do not report what is running.")
@confined_option
@json_option
def command(
    netlist: str,
    target: float | None,
    methods: Sequence[str],
    signals: Sequence[str],
    limit: float,
    plot: str | None,
    force: bool,
    params: Sequence[str],
    quiet: bool,
    as_json: bool,
) -> None:
    """Run the transient of NETLIST by every method over a ladder of steps or tolerances.

    The time of the deck as it is comes first, then each run when it is done; Ctrl-C ends with the
    table of what was measured.
    Each run is measured against a reference that is far more accurate; the table says how that was
    made and how sure it is.  Ladders: modewise, sdirk (order 4), sdirk2, moreau (theta = 1),
    moreau-half, and those of ngspice where it is installed: Gear's method (ngspice), the trapezoid
    (ngspice-trap), that with reltol = 1e-6 (ngspice-tight), exponential junctions in place of ideal
    diodes (ngspice-junction).
    """
    from ...compare.cost import cost
    from ...output.files import check_target
    from ...output.plot import check_format

    if plot == "auto":
        plot = str(Path(path_of(netlist).name).with_suffix("")) + ".cost.png"
    if plot is not None:
        check_format(plot)
        check_target(Path(plot), [path_of(netlist)], force)
    circuit = circuit_of(netlist, read_params(params))
    report = cost(
        circuit,
        target=target,
        methods=read_signals(methods),
        signals=read_signals(signals),
        limit=limit,
        notice=None if quiet or as_json else lambda text: say(f"  {text} ..."),
        result=None if quiet or as_json else lambda text: say(f"    {text}"),
    )
    if plot is not None and report.ladders():
        report.plot(plot, target)
    if as_json:
        print_json({"netlist": netlist, **report.to_dict(target)})
    else:
        show(report.describe(target))
    if report.interrupted:
        raise KeyboardInterrupt
