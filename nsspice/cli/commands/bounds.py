"""``nsspice bounds``: what measures cannot leave over tolerances, proved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import click

from ...errors import Diagnostic, UsageError
from ..options import confined_option, json_option, spice_number
from ..report import print_json, show
from ..source import circuit_of
from .tolerance import share_of

#: parts of the box that are listed
_LISTED = 8


@click.command("bounds", short_help="prove what measures cannot leave over tolerances")
@click.argument("netlist")
@click.option(
    "--param",
    "params",
    multiple=True,
    metavar="NAME=5%|LOW:HIGH",
    help="Tolerance of a parameter, element or model parameter; at most eight.",
)
@click.option(
    "--measure", "measures", multiple=True, metavar="NAME", help="Measure; all by default."
)
@click.option(
    "--seconds", type=float, default=60.0, show_default=True, help="Time after which to stop [s]."
)
@confined_option
@json_option
def command(
    netlist: str, params: Sequence[str], measures: Sequence[str], seconds: float, as_json: bool
) -> None:
    """Enclose the measures of the periodic steady state of NETLIST for all values in a box.

    The exit code is 1 if a part of the box is not decided.
    """
    from ...analyses.bounds.search import bounds

    box = dict(_tolerance(item) for item in params)
    found = bounds(circuit_of(netlist, {}), box, measures or None, seconds=seconds)
    if as_json:
        print_json(asdict(found))
    else:
        lines = [f"{b.measure}: {b.low:.7g} to {b.high:.7g}" for b in found.measures.values()]
        part = "the whole box" if not found.undecided else f"{100.0 * found.decided:.3g} % of it"
        lines.append(f"proved for {part} in {found.seconds:.1f} s ({found.boxes} parts)")
        lines += [
            f"not decided ({why}): "
            + ", ".join(f"{n} {a:g} to {b:g}" for n, (a, b) in ends.items())
            for ends, why in list(zip(found.undecided, found.reasons, strict=True))[:_LISTED]
        ]
        if len(found.undecided) > _LISTED:
            lines.append(f"and {len(found.undecided) - _LISTED} more (--json lists all)")
        show("\n".join(lines))
    if found.undecided:
        raise SystemExit(1)


def _tolerance(item: str) -> tuple[str, float | tuple[float, float]]:
    """Return the name and tolerance of ``NAME=5%`` or ``NAME=LOW:HIGH``."""
    name, _, text = item.partition("=")
    if ":" not in text:
        return share_of(item)
    ends = [spice_number(part.strip())[0] for part in text.split(":")]
    if not name.strip() or len(ends) != 2 or ends[0] is None or ends[1] is None:
        hint = "write --param NAME=5% or --param NAME=LOW:HIGH"
        raise UsageError(Diagnostic("NS4005", f"--param cannot be {item!r}", hint=hint))
    return name.strip().lower(), (ends[0], ends[1])
