"""``nsspice sweep``: a deck at many points, one table."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...errors import Diagnostic, UsageError
from ..options import confined_option, json_option, read_params, solver_options, spice_number
from ..progress import ProgressBar
from ..report import print_json, report_warnings, say, show
from ..source import circuit_of, path_of

if TYPE_CHECKING:
    from ...sweeps import SweepTable

#: more values of one name are a slip of the keyboard
_MOST = 1_000_000
_DISTRIBUTION = re.compile(r"(uniform|loguniform|normal)\(([^,()]+),([^,()]+)\)")
_FORMS = "write 1,2,5 or 1:10:4 or 1:1k:7:log, 5% or uniform(1,2) with --samples"


@click.command("sweep", short_help="run a netlist at many points and print one table")
@click.argument("netlist")
@click.option(
    "--over",
    multiple=True,
    metavar="NAME=VALUES",
    help="Values of a parameter, an element, temp or model(parameter): 1,2,5 or 1:10:4 (four "
    "values) or 1:1k:7:log; samples of 5% about the deck's value, uniform(1,2), normal(5,0.1). "
    "Left out: the .step cards.",
)
@click.option("--samples", type=int, metavar="N", help="Number of samples of distributions.")
@click.option(
    "--how",
    type=click.Choice(["latin", "sobol", "random"]),
    default="latin",
    show_default=True,
    help="How samples are drawn.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the samples.")
@click.option(
    "--measure",
    "measures",
    multiple=True,
    metavar="NAME=CARD",
    help='A measure besides those of the deck: "ripple=PP v(out) FROM=1m".',
)
@click.option("--power", is_flag=True, help="Average powers of all elements.")
@click.option(
    "--load", "loads", multiple=True, metavar="NAME", help="The load: efficiency, losses."
)
@click.option("-j", "--jobs", type=int, metavar="N", help="Processes; all cores by default.")
@click.option("--executor", metavar="dask:ADDRESS", help="Run on a Dask cluster instead.")
@click.option("--journal", metavar="FILE", help="Note finished points in a file.")
@click.option("--resume", is_flag=True, help="Go on with the points that the journal lacks.")
@click.option("-o", "--output", metavar="FILE", help="Write the table: .csv or .parquet.")
@click.option(
    "--plot", metavar="FILE", help="Draw all measures over the last name: .png, .svg or .pdf."
)
@click.option(
    "--map", "maps", nargs=2, metavar="MEASURE FILE", help="Draw a measure over two names."
)
@click.option("--histogram", nargs=2, metavar="MEASURE FILE", help="Draw how a measure spreads.")
@click.option("--reltol", type=float, metavar="R", help="Error of one step.")
@solver_options
@json_option
@click.option("--force", is_flag=True, help="Replace files that nsspice has not written.")
@confined_option
def command(
    netlist: str,
    over: Sequence[str],
    samples: int | None,
    how: Any,
    seed: int,
    measures: Sequence[str],
    power: bool,
    loads: Sequence[str],
    jobs: int | None,
    executor: str | None,
    journal: str | None,
    resume: bool,
    output: str | None,
    plot: str | None,
    maps: tuple[str, str] | None,
    histogram: tuple[str, str] | None,
    reltol: float | None,
    method: str | None,
    theta: float | None,
    step: float | None,
    params: Sequence[str],
    as_json: bool,
    force: bool,
) -> None:
    """Run all analyses of NETLIST at many points and print a table of the measures.

    A point that has no solution, or whose certificate fails, stays in the table with its code; the
    exit code is then 3.

    \b
    Examples:
      nsspice sweep buck.net --over rload=1,2,5,10 -o table.csv
      nsspice sweep buck.net --over vin=18:32:8 --over rload=1:100:9:log --map eff map.png
      nsspice sweep buck.net --over l1=20% --over c1=10% --samples 400 --histogram ripple h.png
    """
    from ...output.files import check_table_format, check_target
    from ...output.plot import check_format
    from ...sweeps import sweep

    if resume and journal is None:
        hint = "name the file: --journal FILE --resume"
        raise UsageError(Diagnostic("NS4005", "--resume needs a journal", hint=hint))
    pictures = [p for p in (plot, maps and maps[1], histogram and histogram[1]) if p]
    for picture in pictures:
        check_format(picture)
    if output is not None:
        check_table_format(Path(output))
    for target in [*pictures, *([output] if output else [])]:
        check_target(Path(target), [path_of(netlist)], force)
    asked = dict(_over(item) for item in over) or None
    named = dict(_measure(item) for item in measures)
    circuit = circuit_of(netlist, read_params(params))
    if not as_json:
        report_warnings(circuit.warnings)
    with ProgressBar(path_of(netlist).name, not as_json) as bar:
        table = sweep(
            circuit,
            asked,
            measures=named,
            samples=samples,
            how=how,
            seed=seed,
            power=power,
            loads=loads,
            method=method,
            theta=theta,
            step=step,
            reltol=reltol,
            workers=jobs,
            executor=executor,
            journal=journal,
            resume=resume,
            progress=bar,
        )
    _print(table, as_json)
    _write(table, output, plot, maps, histogram, as_json)
    if table.interrupted:
        say("interrupted; the table holds what was finished")
        raise SystemExit(130)
    if table.failures:
        raise SystemExit(3)


def _print(table: SweepTable, as_json: bool) -> None:
    """Print the table, and why points are missing from it."""
    if as_json:
        print_json(table.to_dict())
        return
    show(str(table))
    reasons: dict[tuple[str, str], int] = {}
    for failure in table.failures:
        key = failure.code, failure.message
        reasons[key] = reasons.get(key, 0) + 1
    for (code, message), count in list(reasons.items())[:8]:
        say(f"{count} point{'s' * (count > 1)} without a result, {code}: {message}")
    if len(reasons) > 8:
        say(f"{len(reasons) - 8} more reasons: see the status in the table (-o FILE)")


def _write(
    table: SweepTable,
    output: str | None,
    plot: str | None,
    maps: tuple[str, str] | None,
    histogram: tuple[str, str] | None,
    as_json: bool,
) -> None:
    """Write the table and its pictures."""
    written = []
    if output is not None:
        table.save(output)
        written.append(output)
    if plot is not None:
        table.plot(path=plot)
        written.append(plot)
    if maps is not None:
        table.map(*maps)
        written.append(maps[1])
    if histogram is not None:
        table.histogram(*histogram)
        written.append(histogram[1])
    if written and not as_json:
        say(f"  written: {', '.join(written)}")


def _over(item: str) -> tuple[str, Any]:
    """Return the name and the values of ``NAME=VALUES``."""
    name, equals, text = item.partition("=")
    if not equals or not name.strip() or not text.strip():
        raise _wrong("--over", item, _FORMS)
    return name.strip().lower(), _values(item, text.strip().lower())


def _values(item: str, text: str) -> Any:
    """Return a list of values or a distribution."""
    import numpy as np

    from ...sweeps import LogUniform, Normal, Tolerance, Uniform

    drawn = _DISTRIBUTION.fullmatch(text.replace(" ", ""))
    if drawn is not None:
        law = {"uniform": Uniform, "loguniform": LogUniform, "normal": Normal}[drawn[1]]
        return law(_number(item, drawn[2]), _number(item, drawn[3]))
    if text.endswith("%"):
        return Tolerance(_number(item, text[:-1]) / 100.0)
    if ":" not in text:
        return [_number(item, part) for part in text.split(",")]
    parts = text.split(":")
    logarithmic = parts[-1] == "log"
    if len(parts) != 3 + logarithmic:
        raise _wrong("--over", item, _FORMS)
    low, high, count = (_number(item, part) for part in parts[:3])
    if count != int(count) or not 1 <= count <= _MOST:
        raise _wrong("--over", item, "the third number is how many values: 1:10:4")
    if logarithmic:
        if not (low > 0.0 and high > 0.0):
            raise _wrong("--over", item, "a logarithmic scale has positive ends")
        return np.geomspace(low, high, int(count)).tolist()
    return np.linspace(low, high, int(count)).tolist()


def _number(item: str, text: str) -> float:
    value, why = spice_number(text.strip())
    if value is None:
        raise _wrong("--over", item, f"{text.strip()!r} {why}")
    return value


def _measure(item: str) -> tuple[str, str]:
    """Return the name and the text of ``NAME=CARD``."""
    name, equals, text = item.partition("=")
    if not equals or not name.strip() or not text.strip():
        raise _wrong("--measure", item, 'write --measure "ripple=PP v(out) FROM=1m"')
    return name.strip().lower(), text.strip()


def _wrong(option: str, item: str, hint: str) -> UsageError:
    return UsageError(Diagnostic("NS4005", f"{option} cannot be {item!r}", hint=hint))
