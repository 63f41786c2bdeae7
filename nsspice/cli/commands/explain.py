"""``nsspice explain``: what a netlist is and how it would be solved, without solving it."""

from __future__ import annotations

from collections.abc import Sequence

import click

from ..options import confined_option, json_option, junctions_option, param_option, read_params
from ..report import print_json, show
from ..source import circuit_of


@click.command("explain", short_help="show how a netlist would be solved")
@click.argument("netlist")
@click.option("--matrices", is_flag=True, help="Print the matrices of the complementarity form.")
@param_option
@click.option(
    "--all", "everything", is_flag=True, help="Include parts that no saved signal depends on."
)
@confined_option
@junctions_option
@json_option
def command(
    netlist: str, matrices: bool, params: Sequence[str], everything: bool, as_json: bool
) -> None:
    """Show how NETLIST is simulated and what determines its cost, without simulating it.

    First for engineers: the method for each independent part, the elements that force it, what
    could be written differently, the active effects; then class, size and regularity.
    """
    from ...analyses.studies.explanation import explained

    explanation = explained(circuit_of(netlist, read_params(params)), matrices, everything)
    if as_json:
        print_json(explanation.to_dict())
    else:
        show(explanation.text(), nl=False)
