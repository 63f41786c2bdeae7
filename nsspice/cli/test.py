"""``nsspice test``: check netlists against the numbers in their expectation files."""

from __future__ import annotations

import time
from collections.abc import Sequence

import click

from ..errors import Diagnostic, NsspiceError, UsageError
from .options import json_option
from .report import print_json, say


@click.command("test", short_help="check netlists against X.expect.toml")
@click.argument("paths", nargs=-1, metavar="[NETLIST|FOLDER]...")
@json_option
@click.option("-v", "--verbose", is_flag=True, help="List every check with its margin.")
@click.option("-q", "--quiet", is_flag=True, help="Only what failed, and the count.")
def command(paths: Sequence[str], as_json: bool, verbose: bool, quiet: bool) -> None:
    """Simulate netlists and check them against X.expect.toml beside each X.net.

    A folder stands for all expectations below it; the current folder is the default.  Exits with 1
    if a check failed.
    """
    from ..compare.expect import Report, check, find_netlists

    found = find_netlists(paths or ["."])
    if not found:
        raise UsageError(
            Diagnostic(
                "NS4012",
                f"there is no .expect.toml file in {', '.join(paths) or 'this folder'}",
                hint="write X.expect.toml beside X.net",
            )
        )
    begin = time.perf_counter()
    reports: list[Report] = []
    width = max(len(str(p).removesuffix(".expect.toml")) for p in found)
    broken: list[NsspiceError] = []
    for path in found:
        try:
            report = check(path)
        except NsspiceError as error:  # the expectation file itself: tell it, go on with the others
            broken.append(error)
            report = Report(path, problem=str(error))
        reports.append(report)
        if not as_json:
            _print(report, width, verbose, quiet)
        if report.interrupted:
            break
    failed = [r for r in reports if not r.passed]
    if as_json:
        print_json({"passed": not failed, "netlists": [r.to_dict() for r in reports]})
    else:
        spent = time.perf_counter() - begin
        checks = sum(len(r.outcomes) for r in reports)
        verdict = "all passed" if not failed else f"{len(failed)} FAILED"
        click.echo(f"{len(reports)} netlists, {checks} checks in {spent:.2f} s: {verdict}")
    if any(r.interrupted for r in reports):
        say("interrupted")
        raise SystemExit(130)
    if failed:
        raise SystemExit(2 if len(broken) == len(failed) else 1)


def _print(report: object, width: int, verbose: bool, quiet: bool) -> None:
    from ..compare.expect import Report

    assert isinstance(report, Report)
    if report.passed and quiet:
        return
    name = str(report.netlist).removesuffix(".net").removesuffix(".expect.toml")
    count = len(report.outcomes)
    if report.passed:
        text = f"{count} check{'s' * (count != 1)}"
        margins = [o.error / o.tolerance for o in report.outcomes if o.tolerance > 0.0]
        if margins:
            text += f", worst at {max(margins):.0%} of its tolerance"
    elif report.problem:
        text = "not checked"
    else:
        text = f"{sum(not o.passed for o in report.outcomes)} of {count} checks failed"
    click.echo(
        f"{'ok  ' if report.passed else 'FAIL'}  {name:<{width}}  {report.wall_time:6.2f} s  {text}"
    )
    for outcome in report.outcomes:
        if verbose or not outcome.passed:
            click.echo(f"        {outcome}")
    if report.problem:
        click.echo("        " + report.problem.replace("\n", "\n        "))
