"""``nsspice tolerance``: what spread of parameters does to measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import click

from ...errors import Diagnostic, UsageError
from ..options import confined_option, json_option, spice_number
from ..progress import ProgressBar
from ..report import print_json, show
from ..source import circuit_of


@click.command("tolerance", short_help="show how parameter tolerances spread the measures")
@click.argument("netlist")
@click.option(
    "--param",
    "params",
    multiple=True,
    metavar="NAME=5%",
    help="Relative tolerance of this parameter.",
)
@click.option("--runs", type=int, default=200, show_default=True, help="Random runs.")
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the random values.")
@confined_option
@json_option
def command(netlist: str, params: Sequence[str], runs: int, seed: int, as_json: bool) -> None:
    """Run NETLIST at the corners of its tolerances and at random values between them."""
    from ...sweeps.tolerance import tolerance

    if runs < 0:
        raise UsageError(Diagnostic("NS4005", f"--runs cannot be {runs}", hint="give 0 or more"))
    shares = dict(share_of(item) for item in params)
    with ProgressBar(netlist, not as_json) as bar:
        found = tolerance(circuit_of(netlist, {}), shares, runs=runs, seed=seed, progress=bar)
    if as_json:
        print_json({"measures": [asdict(spread) for spread in found]})
        return
    width = max((len(s.measure) for s in found), default=0)
    lines = [f"{'':<{width}}  {'nominal':>13} {'least':>13} {'largest':>13} {'deviation':>11}"]
    lines += [
        f"{s.measure:<{width}}  {s.nominal:>13.7g} {s.low:>13.7g} {s.high:>13.7g} "
        f"{s.deviation:>11.3g}"
        for s in found
    ]
    lines += [
        f"  {s.measure}: " + ", ".join(f"{100 * q:g} % below {v:.7g}" for q, v in s.quantiles)
        for s in found
        if s.quantiles
    ]
    show("\n".join(lines))


def share_of(item: str) -> tuple[str, float]:
    """Return the name and relative tolerance of ``NAME=5%`` or ``NAME=0.05``."""
    name, _, text = item.partition("=")
    percent = text.strip().endswith("%")
    value, _ = spice_number(text.strip().rstrip("%").strip())
    if not name.strip() or value is None or value < 0.0:
        raise UsageError(
            Diagnostic("NS4005", f"--param cannot be {item!r}", hint="write --param NAME=5%")
        )
    return name.strip().lower(), value / 100.0 if percent else value
