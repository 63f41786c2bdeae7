"""``nsspice test``: check netlists against the numbers in their expectation files."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence

import click

from ...errors import Diagnostic, NsspiceError, UsageError
from ..options import json_option
from ..report import print_json, say, show


@click.command("test", short_help="check netlists against X.expect.toml")
@click.argument("paths", nargs=-1, metavar="[NETLIST|FOLDER]...")
@click.option(
    "-k", "keyword", metavar="WORDS", help="Only netlists whose names match (uses pytest)."
)
@click.option(
    "-n", "workers", metavar="N", help="Run in parallel on N cores, or auto (uses pytest-xdist)."
)
@click.option("--junit-xml", metavar="FILE", help="Write a JUnit report (uses pytest).")
@json_option
@click.option("-v", "--verbose", is_flag=True, help="List every check with its margin.")
@click.option("-q", "--quiet", is_flag=True, help="Print only failures and the count.")
def command(
    paths: Sequence[str],
    keyword: str | None,
    workers: str | None,
    junit_xml: str | None,
    as_json: bool,
    verbose: bool,
    quiet: bool,
) -> None:
    """Simulate netlists and check them against X.expect.toml next to each X.net.

    A folder means every expectation file below it; the current folder is the default.  Exits with 1
    if a check failed.
    """
    from ...compare.expect import Report, check, find_netlists

    found = find_netlists(paths or ["."])
    if not found:
        raise UsageError(
            Diagnostic(
                "NS4012",
                f"there is no .expect.toml file in {', '.join(paths) or 'this folder'}",
                hint="write X.expect.toml next to X.net",
            )
        )
    if keyword is not None or workers is not None or junit_xml is not None:
        raise SystemExit(_by_pytest(paths, keyword, workers, junit_xml, verbose, quiet))
    begin = time.perf_counter()
    reports: list[Report] = []
    width = max(len(str(p).removesuffix(".expect.toml")) for p in found)
    broken: list[NsspiceError] = []
    for path in found:
        try:
            report = check(path)
        except NsspiceError as error:  # the expectation file itself: report it, continue
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
        show(f"{len(reports)} netlists, {checks} checks in {spent:.2f} s: {verdict}")
    if any(r.interrupted for r in reports):
        say("interrupted")
        raise SystemExit(130)
    if failed:
        raise SystemExit(2 if len(broken) == len(failed) else 1)


def _by_pytest(
    paths: Sequence[str],
    keyword: str | None,
    workers: str | None,
    junit_xml: str | None,
    verbose: bool,
    quiet: bool,
) -> int:
    """Run the checks as tests of pytest; return the exit code, which has the same meaning."""
    import importlib.metadata
    import importlib.util

    needed = ["pytest"] + (["xdist"] if workers is not None else [])
    missing = [name for name in needed if importlib.util.find_spec(name) is None]
    if missing:
        package = "pytest-xdist" if missing == ["xdist"] else "pytest"
        raise UsageError(
            Diagnostic(
                "NS4010",
                f"-k, -n and --junit-xml need the package {package}, which is not installed",
                hint=f"pip install {package}",
            )
        )
    import pytest

    # by the name of its entry point where the package is installed: pytest loads that one by
    # itself, and refuses the same module under a second name
    installed = importlib.metadata.entry_points(group="pytest11", name="nsspice")
    # settings of a project around the decks are not meant for them
    arguments = [
        "-p",
        "nsspice" if installed else "nsspice.pytest_plugin",
        "--decks",
        "-c",
        os.devnull,
        "--rootdir",
        os.getcwd(),
    ]
    arguments += [
        "-p",
        "no:cacheprovider",
        *(["-v"] if verbose else []),
        *(["-q"] if quiet else []),
    ]
    if keyword is not None:
        arguments += ["-k", keyword]
    if workers is not None:
        arguments += ["-n", workers]
    if junit_xml is not None:
        arguments += ["--junit-xml", junit_xml]
    code = int(pytest.main([*arguments, *(paths or ["."])]))
    return {0: 0, 1: 1, 2: 130, 5: 2}.get(code, 2)


def _print(report: object, width: int, verbose: bool, quiet: bool) -> None:
    from ...compare.expect import Report

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
    show(
        f"{'ok  ' if report.passed else 'FAIL'}  {name:<{width}}  {report.wall_time:6.2f} s  {text}"
    )
    for outcome in report.outcomes:
        if verbose or not outcome.passed:
            show(f"        {outcome}")
    if report.problem:
        show("        " + report.problem.replace("\n", "\n        "))
