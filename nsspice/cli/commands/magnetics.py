"""``nsspice magnetics``: currents and voltages of windings, for tools that design magnetics."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import click

from ..options import NUMBER, confined_option, force_option, json_option, param_option, read_params
from ..report import print_json, say
from ..source import circuit_of, path_of


@click.command("magnetics", short_help="write currents and voltages of windings for OpenMagnetics")
@click.argument("netlist")
@click.option("-o", "--output", metavar="FILE", help="The operating point [NETLIST.mas.json].")
@click.option(
    "--winding", "windings", multiple=True, metavar="NAME", help="Inductor; the primary first."
)
@click.option("--ambient", type=NUMBER, default="25", metavar="C", help="Temperature [25 C].")
@param_option
@force_option
@confined_option
@json_option
def command(
    netlist: str,
    output: str | None,
    windings: Sequence[str],
    ambient: float,
    params: Sequence[str],
    force: bool,
    as_json: bool,
) -> None:
    """Find the periodic steady state of NETLIST, and write one period of its windings.

    The file is an operating point in OpenMagnetics' format (MAS); without --winding it has all
    inductors.
    """
    from ...output.atomic_write import whole
    from ...output.files import check_target, output_error
    from ...output.magnetics import operating_point

    circuit = circuit_of(netlist, read_params(params))
    target = Path(output or path_of(netlist).with_suffix(".mas.json").name)
    check_target(target, [path_of(netlist)], force)
    point = operating_point(circuit, windings, ambient)
    try:
        with whole(target) as part:
            part.write_text(json.dumps(point, indent=1) + "\n", "utf-8")
    except OSError as error:
        raise output_error(error, str(target)) from error
    names = [winding["name"] for winding in point["excitationsPerWinding"]]
    if as_json:
        print_json({"files": [str(target)], "windings": names})
    else:
        say(f"written: {target} ({', '.join(names)})")
