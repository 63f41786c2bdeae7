"""``nsspice compare``: distances between a simulation and ngspice, or a reference waveform."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click

from ...errors import Diagnostic, UsageError
from ..options import (
    NUMBER,
    confined_option,
    json_option,
    ngspice_options,
    read_params,
    read_signals,
    solver_options,
)
from ..report import print_json, report_warnings, show
from ..source import circuit_of, path_of


@click.command("compare", short_help="compare a simulation with ngspice or a reference waveform")
@click.argument("netlist")
@click.argument("reference", required=False)
@click.option(
    "--tolerance",
    type=NUMBER,
    default=1e-3,
    show_default=True,
    help="Largest distance allowed, relative to the reference's range.",
)
@click.option("--absolute", is_flag=True, help="The tolerance is in volts and amperes.")
@click.option(
    "--norm",
    type=click.Choice(["max", "l1", "rms"]),
    default="max",
    show_default=True,
    help="Distance that must meet the tolerance.",
)
@click.option(
    "--time", "time_column", metavar="COLUMN", help="Time column; the first one by default."
)
@click.option(
    "--map",
    "maps",
    multiple=True,
    metavar="COLUMN=SIGNAL",
    help="Compare a column with a signal of a different name; may be repeated.",
)
@click.option("--signals", multiple=True, metavar="NAMES", help="Only these signals.")
@click.option("--from", "start", type=NUMBER, help="Start of the window.")
@click.option("--to", "stop", type=NUMBER, help="End of the window.")
@solver_options
@ngspice_options
@confined_option
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
    **ngspice: Any,
) -> None:
    """Simulate NETLIST with nsspice and with ngspice and print how far the waveforms lie apart.

    Laws that ngspice does not have, such as ideal diodes, are replaced by sharp smooth ones, and
    listed.  With the CSV file REFERENCE, whose columns are named as the signals are, v(out) or
    i(r1), the simulation is compared with that instead.  Exits with 1 if a distance exceeds the
    tolerance, or if ngspice fails.
    """
    if tolerance < 0.0:
        hint = "give a fraction of the reference's range, such as 1e-3, or volts with --absolute"
        raise UsageError(Diagnostic("NS4005", f"--tolerance cannot be {tolerance:g}", hint=hint))
    if reference is None:
        check = _Decision(tolerance, absolute, norm, (start, stop))
        names = read_signals(signals)
        _against_ngspice(
            netlist, read_params(params), names, (method, theta, step), check, as_json, **ngspice
        )
        return
    given = [f"--{key.replace('_', '-')}" for key, value in ngspice.items() if value is not None]
    if given:
        message = f"{', '.join(given)} cannot be used with a reference file"
        raise UsageError(
            Diagnostic("NS4005", message, hint="omit the reference file to run ngspice")
        )
    from ...analyses import Request, jobs_of, run_job
    from ...compare.pairs import compare_table, pairs_of
    from ...compare.reference import read_table

    table = read_table(reference)
    circuit = circuit_of(netlist, read_params(params))
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


class _Decision(NamedTuple):
    """What decides whether two runs agree."""

    tolerance: float
    absolute: bool
    norm: str
    window: tuple[float | None, float | None]


def _against_ngspice(
    netlist: str,
    params: dict[str, float],
    signals: list[str] | None,
    solver: tuple[str | None, float | None, float | None],
    decision: _Decision,
    as_json: bool,
    *,
    plot: str | None,
    deck: str | None,
    slack: float | None,
    force: bool | None,
    **options: Any,
) -> None:
    """Run both programs and print the report."""
    from ...analyses import Request
    from ...compare.ngspice import NgspiceError, Options, cross_check
    from ...output.files import check_target

    if plot is not None:
        from ...output.plot import check_format

        plot = str(Path(path_of(netlist).name).with_suffix(".png")) if plot == "auto" else plot
        check_format(plot)
    for written in (plot, deck):
        if written is not None:
            check_target(Path(written), [path_of(netlist)], bool(force))
    chosen = Options(**{key: value for key, value in options.items() if value is not None})
    circuit = circuit_of(netlist, params)
    if not as_json:
        report_warnings(circuit.warnings)
    try:
        found = cross_check(
            circuit,
            request=Request(*solver, signals=signals, reltol=options.get("reltol")),
            options=chosen,
            **decision._asdict(),
            slack=slack,
        )
    except NgspiceError as error:
        _write_deck(deck, error.translation.text)
        raise
    _write_deck(deck, found.run.translation.text)
    if plot is not None:
        from ...compare.ngspice.overlay import overlay

        overlay(found, plot)
    if as_json:
        print_json({"netlist": netlist, "reference": "ngspice", **found.to_dict()})
    else:
        show(found.describe())
    if not found.passed:
        raise SystemExit(1)


def _write_deck(path: str | None, text: str) -> None:
    if path is not None:
        try:
            Path(path).write_text(text, encoding="utf-8")
        except OSError as error:
            from ...output.files import output_error

            raise output_error(error, path) from error


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
    from ...analyses.signals.signal_names import unit
    from ...output.si import number

    width = max(len("signal"), *(len(r.signal) for r in rows))
    show(f"{'signal':<{width}}  {'max':>12}  {'l1':>12}  {'rms':>12}  {'range':>12}")
    for row in rows:
        symbol = unit(row.signal)
        cells = (row.distance.maximum, row.distance.l1, row.distance.rms, row.distance.span)
        text = "  ".join(f"{number(c, symbol, 4):>12}" for c in cells)
        show(f"{row.signal:<{width}}  {text}  {'ok' if row.passed else 'FAIL'}")
    failed = sum(not r.passed for r in rows)
    what = f"{norm} distance <= {tolerance:g}" + ("" if absolute else " of the range")
    verdict = "all within" if not failed else f"{failed} of {len(rows)} outside"
    show(f"{verdict} {what}, against {reference}")
