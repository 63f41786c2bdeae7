"""``nsspice draw``: the schematic of a netlist."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...errors import Diagnostic, UsageError
from ..options import NUMBER, confined_option, force_option, json_option, param_option, read_params
from ..report import print_json, say
from ..source import circuit_of, path_of

if TYPE_CHECKING:
    from ...circuit import Circuit


@click.command("draw", short_help="draw the schematic of a netlist")
@click.argument("netlist")
@click.option("-o", "--output", metavar="FILE", help="Picture: .svg [NETLIST.svg].")
@click.option(
    "--at", "at", type=NUMBER, metavar="T", help="Colour what conducts at this instant [s]."
)
@param_option
@force_option
@confined_option
@json_option
def command(
    netlist: str,
    output: str | None,
    at: float | None,
    params: Sequence[str],
    force: bool,
    as_json: bool,
) -> None:
    """Draw the schematic of NETLIST as .svg: rails above, ground below, controls by name.

    With --at the deck is simulated up to this instant (.tran; of .pss one period), and what
    conducts then is green.
    """
    from ...output.atomic_write import whole
    from ...output.files import check_target, output_error
    from ...output.schematic import schematic
    from ...output.si import number

    circuit = circuit_of(netlist, read_params(params))
    target = Path(output or path_of(netlist).with_suffix(".svg").name)
    if target.suffix.lower() != ".svg":
        message = f"a schematic is an .svg file, not {target}"
        hint = f"write -o {target.with_suffix('.svg')}"
        raise UsageError(Diagnostic("NS4008", message, hint=hint))
    check_target(target, [path_of(netlist)], force)
    states = None if at is None else _states(circuit, at)
    caption = ""
    if states is not None:
        names = ", ".join(sorted(name for name, on in states.items() if on))
        caption = f"at {number(at or 0.0, 's')} conducting: {names or 'nothing'}"
    try:
        with whole(target) as part:
            part.write_text(schematic(circuit, states, caption), "utf-8")
    except OSError as error:
        raise output_error(error, str(target)) from error
    if as_json:
        print_json({"files": [str(target)], "conducting": states})
    else:
        say(f"written: {target}" + (f" ({caption})" if caption else ""))


def _states(circuit: Circuit, at: float) -> dict[str, bool]:
    """Return what conducts at an instant of the first analysis over time."""
    from ...analyses.request.request import Request
    from ...analyses.studies.batch import jobs_of, run_job
    from ...output.schematic.conduction import conducting_at

    jobs = [job for job in jobs_of(circuit.deck) if job.kind in ("tran", "pss")]
    if not jobs:
        hint = "add a .tran or .pss card"
        message = "--at needs an analysis over time, and the deck has none"
        raise UsageError(Diagnostic("NS4006", message, hint=hint))
    request = Request(keep=True)
    if jobs[0].kind == "tran":
        request = replace(request, stop=max(at, 1e-18))
    solution = run_job(circuit, jobs[0], request)
    if not float(solution.axis[0]) <= at <= float(solution.axis[-1]) * (1.0 + 1e-9):
        begin, end = float(solution.axis[0]), float(solution.axis[-1])
        message = f"--at {at:g} is outside the analysis, which runs from {begin:g} to {end:g} s"
        raise UsageError(Diagnostic("NS4006", message, hint="name an instant within it"))
    return conducting_at(solution, at)
