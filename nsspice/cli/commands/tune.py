"""``nsspice tune``: parameters for which measures have given values."""

from __future__ import annotations

from collections.abc import Sequence

import click

from ...errors import Diagnostic, UsageError
from ..options import confined_option, json_option, read_params, spice_number
from ..report import print_json, show
from ..source import circuit_of


@click.command("tune", short_help="find parameters that bring measures to given values")
@click.argument("netlist")
@click.option(
    "--param",
    "params",
    multiple=True,
    metavar="NAME=LOW:HIGH",
    help="Parameter to change, with its bounds.",
)
@click.option(
    "--goal",
    "goals",
    multiple=True,
    metavar="MEASURE=VALUE",
    help="Value that a measure should reach.",
)
@confined_option
@json_option
def command(netlist: str, params: Sequence[str], goals: Sequence[str], as_json: bool) -> None:
    """Change the .param values of NETLIST within bounds until its measures are those wanted."""
    from ...sweeps.tune import tune

    bounds = dict(_bounds(item) for item in params)
    found = tune(circuit_of(netlist, {}), bounds, read_params(goals))
    if as_json:
        print_json(
            {
                "parameters": found.parameters,
                "measures": found.measures,
                "reached": found.reached,
                "runs": found.runs,
            }
        )
    else:
        lines = [f"{name} = {value:.12g}" for name, value in found.parameters.items()]
        lines += [f"  {name} = {value:.9g}" for name, value in found.measures.items()]
        lines.append(f"goals {'reached' if found.reached else 'NOT reached'} in {found.runs} runs")
        show("\n".join(lines))
    if not found.reached:
        raise SystemExit(1)


def _bounds(item: str) -> tuple[str, tuple[float, float]]:
    """Return the name and bounds of ``NAME=LOW:HIGH``."""
    name, _, text = item.partition("=")
    ends = [spice_number(part.strip())[0] for part in text.split(":")]
    if not name.strip() or len(ends) != 2 or ends[0] is None or ends[1] is None:
        raise UsageError(
            Diagnostic("NS4005", f"--param cannot be {item!r}", hint="write --param NAME=LOW:HIGH")
        )
    return name.strip().lower(), (ends[0], ends[1])
