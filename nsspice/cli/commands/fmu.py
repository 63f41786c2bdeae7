"""``nsspice fmu``: a deck as a unit for co-simulation."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from ..options import (
    confined_option,
    force_option,
    json_option,
    param_option,
    read_params,
    read_signals,
)
from ..report import print_json, say
from ..source import circuit_of, path_of


@click.command("fmu", short_help="export a deck as an FMU for co-simulation")
@click.argument("netlist")
@click.option("-o", "--output", metavar="FILE", help="The unit [NETLIST.fmu].")
@click.option(
    "--input", "inputs", multiple=True, metavar="NAME", help="Source that the importing tool sets."
)
@click.option("--signals", multiple=True, metavar="NAMES", help='Outputs, such as "v(out) i(l1)".')
@click.option("--method", metavar="NAME", help="auto, modewise, sdirk or moreau.")
@param_option
@force_option
@confined_option
@json_option
def command(
    netlist: str,
    output: str | None,
    inputs: Sequence[str],
    signals: Sequence[str],
    method: str | None,
    params: Sequence[str],
    force: bool,
    as_json: bool,
) -> None:
    """Export NETLIST as an FMU (FMI 3.0, co-simulation): sources in, signals out.

    .param values are its parameters.  The tool that imports it needs a Python with nsspice.
    """
    from ...output.files import check_target
    from ...output.fmu import write_fmu

    circuit = circuit_of(netlist, read_params(params))
    target = Path(output or path_of(netlist).with_suffix(".fmu").name)
    check_target(target, [path_of(netlist)], force)
    names = [name.lower() for name in inputs]
    write_fmu(circuit, target, names, read_signals(signals), method=method)
    if as_json:
        print_json({"files": [str(target)], "inputs": names})
    else:
        say(f"written: {target}")
