"""``nsspice explain``: what a netlist is and how it would be solved, without solving it."""

from __future__ import annotations

from collections.abc import Sequence

import click

from .options import json_option, read_params
from .report import print_json, show
from .source import circuit_of


@click.command("explain", short_help="tell how a netlist would be solved")
@click.argument("netlist")
@click.option("--matrices", is_flag=True, help="Print the matrices of the complementarity form.")
@click.option("--param", "params", multiple=True, metavar="NAME=VALUE", help="Replace a .param.")
@json_option
def command(netlist: str, matrices: bool, params: Sequence[str], as_json: bool) -> None:
    """Print islands, unknowns, problem class and active effects of NETLIST, not simulating it."""
    from ..analyses.method import describe
    from ..circuit.explain import explain

    explanation = explain(circuit_of(netlist, read_params(params)), matrices, describe)
    if as_json:
        print_json(explanation.to_dict())
    else:
        show(explanation.text(), nl=False)
