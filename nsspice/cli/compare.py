"""``nsspice compare``: distances between a simulation and a reference waveform."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from ..errors import Diagnostic, UsageError
from .options import NUMBER, json_option, read_params, read_signals, solver_options
from .report import print_json


@click.command("compare", short_help="compare a simulation with a reference waveform")
@click.argument("netlist")
@click.argument("reference", required=False)
@click.option(
    "--tolerance",
    type=NUMBER,
    default=1e-3,
    show_default=True,
    help="Largest distance allowed, as a share of the reference's range.",
)
@click.option("--absolute", is_flag=True, help="The tolerance is in volts and amperes.")
@click.option(
    "--norm",
    type=click.Choice(["max", "l1", "rms"]),
    default="max",
    show_default=True,
    help="Which distance must meet the tolerance.",
)
@click.option("--time", "time_column", metavar="COLUMN", help="Column of the time; the first one.")
@click.option(
    "--map",
    "maps",
    multiple=True,
    metavar="COLUMN=SIGNAL",
    help="Compare a column with a signal of another name; may be repeated.",
)
@click.option("--signals", multiple=True, metavar="NAMES", help="Only these signals.")
@click.option("--from", "start", type=NUMBER, help="Begin of the window.")
@click.option("--to", "stop", type=NUMBER, help="End of the window.")
@solver_options
@json_option
def command(
    netlist: str,
    reference: str | None,
    tolerance: float,
    absolute: bool,
    norm: str,
    time_column: str | None,
    maps: Sequence[str],
    signals: Sequence[str],
    start: float | None,
    stop: float | None,
    method: str | None,
    theta: float | None,
    step: float | None,
    params: Sequence[str],
    as_json: bool,
) -> None:
    """Simulate NETLIST and print its distance from the CSV file REFERENCE, signal by signal.

    The columns of REFERENCE are named as the signals are: v(out), i(r1).  Exits with 1 if a
    distance exceeds the tolerance.
    """
    if reference is None:
        raise UsageError(
            Diagnostic(
                "NS4013",
                "the comparison with ngspice is not part of this version",
                hint="name a reference: nsspice compare X.net reference.csv",
            )
        )
    from ..analyses import Request, jobs_of, read, run_job
    from ..compare.pairs import compare_table, pairs_of
    from ..compare.reference import read_table

    table = read_table(reference)
    circuit = read(Path(netlist), read_params(params))
    job = next((j for j in jobs_of(circuit.deck) if j.kind != "op"), None)
    if job is None:
        raise UsageError(Diagnostic("NS4006", f"{netlist} has no .tran or .dc analysis"))
    pairs = pairs_of(circuit, table, _maps(maps), read_signals(signals))
    request = Request(method, theta, step, extra=[name for _, name in pairs])
    solution = run_job(circuit, job, request)
    if solution.interrupted:
        raise KeyboardInterrupt
    rows = compare_table(solution, table, pairs, time_column, (start, stop))
    for row in rows:
        scale = 1.0 if absolute else row.distance.span or 1.0
        row.passed = row.distance.by_name(norm) <= tolerance * scale
    if as_json:
        print_json(
            {
                "netlist": netlist,
                "reference": reference,
                "norm": norm,
                "tolerance": tolerance,
                "absolute": absolute,
                "passed": all(r.passed for r in rows),
                "signals": [r.to_dict() for r in rows],
            }
        )
    else:
        _print(rows, reference, tolerance, absolute, norm)
    if not all(row.passed for row in rows):
        raise SystemExit(1)


def _maps(items: Sequence[str]) -> dict[str, str]:
    found = {}
    for item in items:
        column, equals, signal = item.rpartition("=")
        if not equals:
            raise UsageError(
                Diagnostic("NS4005", f"--map cannot be {item!r}", hint="write --map COLUMN=SIGNAL")
            )
        found[column.strip()] = signal.strip()
    return found


def _print(
    rows: Sequence[Any], reference: str, tolerance: float, absolute: bool, norm: str
) -> None:
    from ..analyses.names import unit
    from ..output.si import number

    width = max(len("signal"), *(len(r.signal) for r in rows))
    click.echo(f"{'signal':<{width}}  {'max':>12}  {'l1':>12}  {'rms':>12}  {'range':>12}")
    for row in rows:
        symbol = unit(row.signal)
        cells = (row.distance.maximum, row.distance.l1, row.distance.rms, row.distance.span)
        text = "  ".join(f"{number(c, symbol, 4):>12}" for c in cells)
        click.echo(f"{row.signal:<{width}}  {text}  {'ok' if row.passed else 'FAIL'}")
    failed = sum(not r.passed for r in rows)
    what = f"{norm} distance <= {tolerance:g}" + ("" if absolute else " of the range")
    verdict = "all within" if not failed else f"{failed} of {len(rows)} beyond"
    click.echo(f"{verdict} {what}, against {reference}")
