"""``nsspice run``: simulate a netlist, write CSV and plot, print a summary."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...errors import Diagnostic, NsspiceError, NumericalError, OutputError, UsageError
from ..options import (
    NUMBER,
    confined_option,
    is_confined,
    json_option,
    junctions_option,
    read_params,
    read_signals,
    seed_option,
    solver_options,
)
from ..progress import ProgressBar
from ..report import print_json, report_error, report_warnings, say
from ..source import circuit_of, path_of
from ..step_table import is_stepped, show_steps

if TYPE_CHECKING:
    from ...circuit import Circuit

#: with more analyses what they have recorded is not kept for a report: it is recorded again
_RECORDED = 16
#: what a name after --plot and after --report ends in; any other is that of the netlist
_PICTURES = (".png", ".svg", ".pdf")
_PAGES = (".html", ".htm")
#: analyses whose runs over a .step are one picture
_FAMILIES = ("tran", "dc", "pss", "ac", "loop", "sp")
_FILE = "Output file: .csv, .raw, .npz, .parquet, .h5 or .s2p; - is standard output."


@click.command("run", short_help="simulate a netlist")
@click.argument("netlist", required=False)
@click.option("-o", "--output", metavar="FILE", help=_FILE)
@click.option(
    "--plot",
    is_flag=False,
    flag_value="auto",
    metavar="[FILE]",
    help="Draw the waveforms in a .png, .svg or .pdf file.",
)
@click.option("--dark", is_flag=True, help="Draw for a dark page.")
@click.option(
    "--report",
    is_flag=False,
    flag_value="auto",
    metavar="[FILE]",
    help="Write one self-contained .html page: waveforms to zoom into, verdict, measures, deck.",
)
@click.option(
    "--archive",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Put deck, all signals, versions and hashes into a folder that nsspice verify judges.",
)
@click.option(
    "--signals",
    "--save",
    "signals",
    multiple=True,
    metavar="NAMES",
    help='Signals to write, such as "v(out) i(r1)"; if repeated, each is a panel of the picture.',
)
@click.option("--tstop", type=NUMBER, metavar="T", help="End of transients [s].")
@click.option(
    "--all-points",
    is_flag=True,
    help="Write rows at the solver's own points, and on both sides of each jump.",
)
@click.option(
    "--all",
    "everything",
    is_flag=True,
    help="Also simulate parts that no saved or measured signal depends on.",
)
@click.option("--reltol", type=NUMBER, metavar="R", help="Error allowed in one step of sdirk.")
@click.option(
    "--accuracy",
    type=click.Choice(["waveforms", "energy"]),
    help="How step errors are measured; energy: means and powers accurate, small ringing damped.",
)
@click.option(
    "--tol",
    type=NUMBER,
    metavar="E",
    help="Choose a method and step for this output error, relative to each signal's range.",
)
@click.option(
    "--power", is_flag=True, help="Print average powers of all elements (.pss and .tran)."
)
@click.option(
    "--load",
    "loads",
    multiple=True,
    metavar="NAME",
    help="Element whose power counts as useful, for the efficiency.",
)
@click.option(
    "--refine", is_flag=True, help="Estimate the error of fixed steps by halving them twice."
)
@click.option(
    "--controller",
    "controllers",
    multiple=True,
    metavar="TEXT",
    help='Digital controller in C: "law.so period=10u reads=v(out) writes=vduty".',
)
@click.option("--watch", is_flag=True, help="Run again whenever the deck is saved.")
@solver_options
@json_option
@click.option("--force", is_flag=True, help="Replace files that were not written by nsspice.")
@confined_option
@seed_option
@junctions_option
@click.option("-q", "--quiet", is_flag=True, help="No summary and no progress bar.")
@click.option("-v", "--verbose", is_flag=True, help="Also print methods, counters and energies.")
def command(
    netlist: str | None,
    output: str | None,
    plot: str | None,
    dark: bool,
    report: str | None,
    archive: Path | None,
    signals: Sequence[str],
    tstop: float | None,
    all_points: bool,
    everything: bool,
    method: str | None,
    theta: float | None,
    step: float | None,
    reltol: float | None,
    accuracy: str | None,
    tol: float | None,
    refine: bool,
    power: bool,
    loads: Sequence[str],
    controllers: Sequence[str],
    watch: bool,
    params: Sequence[str],
    as_json: bool,
    force: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Simulate NETLIST (- is standard input) and write its waveforms.

    The file a.csv in the current folder takes the rows of a.net; with several analyses a.tran.csv
    and a.dc.csv, with .step cards a.step1.csv and so on; a .raw file holds all steps as plots.  A
    summary goes to standard error.
    """
    netlist, plot = _sort_out(netlist, plot, _PICTURES)
    netlist, report = _sort_out(netlist, report, _PAGES)
    if netlist is None:
        raise click.UsageError("name a netlist: nsspice run FILE")
    from ...analyses.request.request import Request, named_controllers
    from ..controllers import read_controllers

    request = Request(
        method,
        theta,
        step,
        tstop,
        read_signals(signals) if signals or archive is None else ["all", "alli"],
        keep=plot is not None or report is not None,
        all_points=all_points,
        reltol=reltol,
        power=power or bool(loads),
        loads=tuple(name.lower() for name in loads),
        everything=everything,
        accuracy=accuracy,
    )

    def once() -> _Run:
        circuit = circuit_of(netlist, read_params(params))
        if archive is not None and controllers:
            message = "--archive cannot judge later what --controller has set"
            raise UsageError(Diagnostic("NS4005", message, hint="leave one of them out"))
        target = output if archive is None else _table_in(archive, netlist, output)
        told = named_controllers(circuit, read_controllers(controllers, is_confined()))
        asked = replace(request, controllers=told)
        run = _Run(netlist, circuit, asked, target, plot, as_json, quiet, force)
        run.archive = archive
        run.report_to(report)
        run.verbose = verbose
        run.draw_as(dark, [read_signals([item]) or [] for item in signals])
        run.estimate(tol, refine)
        return run

    if watch:
        _watch(netlist, once)
    elif code := once().execute():
        raise SystemExit(code)


def _table_in(folder: Path, netlist: str, output: str | None) -> str:
    """Return the name of the table in a run folder, which is made if it is not there."""
    from ...output.files import output_error

    if output is not None:
        raise click.UsageError("--archive names the folder of the tables: leave out -o")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise output_error(error, str(folder)) from error
    return str(folder / Path(path_of(netlist).name).with_suffix(".csv"))


def _watch(netlist: str, once: Callable[[], _Run]) -> None:
    """Run at the start and after each change of the deck and of what it includes."""
    from ..source import STDIN
    from ..watch import watch

    if netlist == STDIN:
        raise click.UsageError("--watch needs a file")

    def run() -> list[Path]:
        files = {netlist}
        try:
            made = once()
            files |= {e.span.file for e in made.circuit.deck.elements}
            made.execute()
        except NsspiceError as error:
            report_error(error, False)
        return [Path(f) for f in files if Path(f).exists()]

    watch(run)


def _sort_out(
    netlist: str | None, file: str | None, endings: Sequence[str]
) -> tuple[str | None, str | None]:
    """Distinguish netlist and file: in ``--plot a.net`` the name is not that of a picture."""
    named = netlist is None and file not in (None, "auto")
    if named and Path(str(file)).suffix.lower() not in endings:
        return file, "auto"
    return netlist, file


class _Run:
    """One call of the command."""

    def __init__(
        self,
        netlist: str,
        circuit: Circuit,
        request: Any,
        output: str | None,
        plot: str | None,
        as_json: bool,
        quiet: bool,
        force: bool,
    ) -> None:
        from ...analyses.studies.batch import jobs_of
        from ...output.exports import is_whole

        self.circuit, self.force = circuit, force
        self.netlist = path_of(netlist)
        self.request, self.as_json, self.quiet = request, as_json, quiet
        self.jobs = jobs_of(self.circuit.deck)
        self.stdout = output == "-"
        suffix = "" if output in (None, "-") else Path(str(output)).suffix.lower()
        self.raw = suffix == ".raw"
        self.whole = is_whole(suffix)  # written when a run is complete
        labels = [job.label for job in self.jobs]
        if self.raw:  # all steps of an analysis are plots of one file
            labels = [_without_step(label) for label in labels]
        self.outputs = [_labelled(output, self.netlist, label) for label in labels]
        self.plots = self._plot_files(plot)
        self.solutions: list[Any] = []
        self.report: Path | None = None
        self.archive: Path | None = None
        self.verbose = False
        self._check_files()
        if not quiet and not as_json:
            report_warnings(self.circuit.warnings)

    def _plot_files(self, plot: str | None) -> list[Path | None]:
        if plot is None:
            return [None] * len(self.jobs)
        from ...output.plot import check_format

        template = str(Path(self.netlist.name).with_suffix(".png")) if plot == "auto" else plot
        check_format(template)
        files: list[Path | None] = []
        for job in self.jobs:
            drawable = job.kind != "op"
            label = _without_step(job.label) if job.kind in _FAMILIES else job.label
            files.append(_labelled(template, self.netlist, label) if drawable else None)
        if not any(files):
            raise UsageError(
                Diagnostic(
                    "NS4009",
                    "there is nothing to draw: an operating point has a single row",
                    hint="remove --plot, or add a .tran or .dc analysis",
                )
            )
        return files

    def draw_as(self, dark: bool, groups: Sequence[Sequence[str]]) -> None:
        """Say how pictures look: on which ground, and which signals share a panel."""
        self.dark = dark
        self.groups = groups if len(groups) > 1 else []

    def _draw(self, k: int, solution: Any) -> Path | None:
        """Draw a run; those of a ``.step`` are one picture, when the last of them is done."""
        path = self.plots[k]
        if path is None or solution.axis.size < 2:
            return None
        from ...analyses.request.recorder import select
        from ...output.overlay import plot

        groups = [select(self.circuit, group) for group in self.groups]
        if self.plots.count(path) == 1:
            solution.plot(path, groups or None, dark=self.dark)
            return path
        if path in self.plots[k + 1 :] and not solution.interrupted:
            return None
        runs = [s for s, p in zip(self.solutions, self.plots, strict=False) if p == path]
        plot(runs, path, [n for group in groups for n in group] or None, dark=self.dark)
        return path

    def report_to(self, report: str | None) -> None:
        """Ask for a page; ``auto`` is the name of the netlist with .html."""
        from ...output.files import check_target

        if report is None:
            return
        name = Path(self.netlist.name).with_suffix(".html") if report == "auto" else Path(report)
        if name.suffix.lower() not in _PAGES:
            raise UsageError(
                Diagnostic(
                    "NS4008",
                    f"a report is a .html page, not {name}",
                    hint=f"write --report {name.with_suffix('.html')}",
                )
            )
        check_target(name, [self.netlist], self.force)
        self.report = name

    def _write_report(self) -> None:
        """Write the page of all runs so far."""
        if self.report is None or not self.solutions:
            return
        from ...output.report import write_report

        write_report(self.circuit, self.solutions, self.report)
        if not (self.quiet or self.as_json):
            say(f"  written: {self.report}")

    def _check_files(self) -> None:
        """Refuse what cannot be written before anything is computed."""
        from ...analyses.request.cards import Tran
        from ...netlist.deck import TranCard
        from ...output.exports import check_export
        from ...output.files import check_room, check_table_format, check_target

        if self.stdout and len(self.jobs) > 1:
            raise UsageError(
                Diagnostic(
                    "NS4003",
                    f"standard output takes one table, but the deck makes {len(self.jobs)}",
                    hint="write files with -o NAME.csv, or keep one analysis in the deck",
                )
            )
        files = {e.span.file for e in self.circuit.deck.elements}  # the included ones too
        inputs = [self.netlist, *map(Path, sorted(files))]
        targets = [p for p in [*([] if self.stdout else self.outputs), *self.plots] if p]
        for target in targets:
            check_target(target, inputs, self.force)
        if self.stdout:
            return
        for path in self.outputs[:1]:
            check_table_format(path)
            check_export(path)
        for job, path in zip(self.jobs, self.outputs, strict=True):
            if isinstance(job.card, TranCard):
                card = job.card._replace(tstop=self.request.stop or job.card.tstop)
                check_room(path, Tran.from_card(card).row_count)

    def estimate(self, tol: float | None, refine: bool) -> None:
        """Ask for a tolerance of the output, or for an estimate of its error."""
        from ...analyses.studies.batch import check_tolerance

        check_tolerance(tol, refine)
        self.tol, self.refine = tol, refine

    def execute(self) -> int:
        """Run all jobs; return the exit code."""
        try:
            with ProgressBar(self.netlist.name, not (self.quiet or self.as_json)) as bar:
                for k in range(len(self.jobs)):
                    solution = self._job(k, bar)
                    if solution.interrupted:
                        break
        finally:
            if not (self.quiet or self.as_json):
                show_steps(self.circuit.deck.title, self.jobs, self.solutions)
        self._write_report()
        if self.archive is not None:
            from ...compare.archive import write_archive

            tables = self.outputs
            write_archive(self.archive, self.circuit, self.solutions, tables, self.request)
        if self.as_json:
            self._print_json()
        if any(s.interrupted for s in self.solutions):
            if self.quiet or self.as_json:
                say("interrupted; the rows so far are kept")
            return 130
        return self._verdict()

    def _job(self, k: int, bar: ProgressBar) -> Any:
        """Run one job, write its files, print its summary."""
        from ...analyses.studies.batch import run_job

        def progress(done: float) -> None:
            bar((k + done) / len(self.jobs))

        sink = None if self.whole else self._sink(k)
        request = self.request
        if self.whole:
            request = replace(request, keep=True)
        if self.plots[k] is not None or self.report is not None:
            from ...analyses.request.recorder import select

            # pictures are drawn on the points of the engine
            request = replace(request, follow=select(self.circuit, request.signals))
        try:
            plain = self.tol is None and not self.refine
            execute: Any = run_job if plain else self._estimated
            solution = execute(self.circuit, self.jobs[k], request, progress=progress, sink=sink)
        except NumericalError as error:
            partial: Any = error.partial
            if partial is not None and partial.row_count:
                self._finish(k, partial)
                self._write_report()
            if self.as_json:
                self._print_json()
            raise
        self._finish(k, solution)
        return solution

    def _estimated(self, *args: Any, **options: Any) -> Any:
        """Run a job and estimate its error."""
        from ...analyses.studies.refinement import run_estimated

        return run_estimated(*args, tol=self.tol, **options)

    def _sink(self, k: int) -> Any:
        from ...output.csv import CsvSink

        return CsvSink(sys.stdout.buffer if self.stdout else self.outputs[k])

    def _finish(self, k: int, solution: Any) -> None:
        """Write what is not streamed, and print the summary."""
        self.solutions.append(solution)
        written: list[str] = []
        if self.whole:
            self._write(solution, k)
        if not self.stdout and solution.row_count:
            written.append(str(self.outputs[k]))
        plot = self._draw(k, solution)
        if plot is not None:
            written.append(str(plot))
        if len(self.jobs) > _RECORDED:
            solution.recording = None
        solution.files = written
        if self.quiet or self.as_json or (is_stepped(self.jobs, k) and not self.verbose):
            return  # what is stepped becomes one table
        say(solution.summary(self.verbose))
        report_warnings(solution.warnings)
        if written:
            say(f"  written: {', '.join(written)}")

    def _write(self, solution: Any, k: int) -> None:
        """Write a complete table; where that fails, the rows go to the temporary folder as CSV."""
        from ...output.raw import write_raw

        path = self.outputs[k]
        try:
            if self.raw:
                write_raw(solution, path, append=path in self.outputs[:k])
            else:
                solution.save(path)
        except OutputError as error:
            import tempfile

            rescue = Path(tempfile.gettempdir()) / f"{path.stem}.rescued.csv"
            try:
                solution.to_csv(rescue)
            except OutputError:
                raise error from None
            say(f"the rows are kept in {rescue}")
            raise

    def _print_json(self) -> None:
        runs = []
        for solution in self.solutions:
            runs.append({**solution.to_dict(), "files": solution.files})
        data: dict[str, Any] = {
            "netlist": str(self.netlist),
            "title": self.circuit.deck.title,
            "warnings": [w.to_dict() for w in self.circuit.warnings],
            "runs": runs,
        }
        if junctions := self.circuit.broken_junctions():
            data["junctions"] = junctions
        print_json(data, sys.stderr if self.stdout else None)

    def _verdict(self) -> int:
        """Refuse a run whose rows do not satisfy the laws of the circuit."""
        from ...analyses.solution.refusal import judge

        judge(self.solutions, "raise")
        return 0


def _without_step(label: str) -> str:
    """Return the label of an analysis: that of a run without its step."""
    return re.sub(r"\.?step\d+$", "", label)


def _labelled(name: str | None, netlist: Path, label: str) -> Path:
    """Return the file of a job: ``a.csv``, ``a.tran.csv``, ``a.step1.csv``."""
    path = Path(name) if name not in (None, "-") else Path(netlist.name).with_suffix(".csv")
    if name is None and netlist.suffix == "":
        path = Path(netlist.name + ".csv")
    return path.with_name(f"{path.stem}.{label}{path.suffix}") if label else path
