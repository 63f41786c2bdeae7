"""Run folders: a deck, all files that it includes, its results, and what made them.

A stored result can be certified again without being run: its tables are judged by the laws of the
deck, and every file by its hash.
"""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..analyses.certificate.written_rows import TOLERANCE, Violation, WrittenRows, conditions_of
from ..analyses.request.cards import Tran
from ..analyses.request.load import read
from ..analyses.request.request import Request
from ..analyses.solution.solution import Solution
from ..analyses.studies.batch import Job, jobs_of, of_job
from ..analyses.transient.row_checks import joined
from ..circuit import Circuit
from ..errors import Diagnostic, OutputError, UsageError
from ..netlist.deck import TranCard
from ..output.atomic_write import whole
from ..output.files import output_error
from ..output.stored_deck import PACKAGE, store_deck
from .reference import read_table

#: what describes a folder, and the version of that description
RECORD, FORMAT = "run.json", 1
#: where the deck and its files are
_SOURCES = "deck"


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a stored table says next to its deck.

    Parameters
    ----------
    table : str
        Name of the file.
    rows : int
    law, pair : Violation or None
        Worst errors of laws and of set-valued elements, in units in which 1e-8 is allowed; None
        where the rows of an analysis are not judged.
    judged : dict of str to int
        How many laws were, by their kind.
    left_out : tuple of str
        Set-valued elements that were not: their currents depend on a charge, or on other elements.
    findings : tuple of str
        What is wrong, one sentence each.
    """

    table: str
    rows: int
    law: Violation | None = None
    pair: Violation | None = None
    judged: Mapping[str, int] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()
    findings: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """True if nothing is wrong."""
        return not self.findings

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        return {
            "table": self.table,
            "rows": self.rows,
            "laws": None if self.law is None else self.law.error,
            "complementarity": None if self.pair is None else self.pair.error,
            "judged": dict(self.judged),
            "left_out": list(self.left_out),
            "findings": list(self.findings),
            "passed": self.passed,
        }


def digest(path: Path) -> str:
    """Return the SHA-256 hash of a file, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


# ------------------------------------------------------------------ writing


def write_archive(
    folder: Path,
    circuit: Circuit,
    solutions: Sequence[Solution],
    tables: Sequence[Path],
    request: Request,
) -> None:
    """Put the deck of some runs and a record of them into the folder that has their tables.

    Parameters
    ----------
    folder : Path
        It exists, with the ``tables`` in it.
    circuit : Circuit
    solutions : sequence of Solution
        In the order of the jobs of the deck.
    tables : sequence of Path
    request : Request

    Raises
    ------
    OutputError
        NS4001 if a file cannot be written.
    """
    try:
        junctions = circuit.deck.options.get("junctions")
        sources = [f"{_SOURCES}/{name}" for name in store_deck(folder / _SOURCES, circuit.deck)]
        record = {
            "format": FORMAT,
            "programs": {
                "nsspice": __version__,
                "python": platform.python_version(),
                "numpy": np.__version__,
                "machine": platform.machine(),
            },
            "deck": sources[0],
            "parameters": circuit.deck.overrides,
            "seed": circuit.deck.seed,
            "junctions": None if junctions is None else str(junctions.value),
            "stop": request.stop,
            "runs": [
                {"table": table.name, **solution.to_dict()}
                for table, solution in zip(tables, solutions, strict=False)
            ],
        }
        names = [*sources, *(table.name for table in tables[: len(solutions)])]
        record["files"] = {name: digest(folder / name) for name in names}
        with whole(folder / RECORD) as part:
            part.write_text(json.dumps(record, indent=1) + "\n", "utf-8")
    except OSError as error:
        raise output_error(error, str(folder)) from error


# ------------------------------------------------------------------ verifying


def read_record(folder: Path) -> dict[str, Any]:
    """Return the record of a run folder.

    Raises
    ------
    UsageError
        NS4031 if there is none, or one of another version.
    """
    path = folder / RECORD
    try:
        record = json.loads(path.read_text("utf-8"))
        known = record["format"] == FORMAT
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise _no_record(folder, f"{path.name} cannot be read") from error
    if not known:
        raise _no_record(folder, f"{path.name} has format {record['format']}, not {FORMAT}")
    return dict(record)


def _no_record(folder: Path, why: str) -> UsageError:
    hint = f"write one with nsspice run X.net --archive {folder}"
    return UsageError(Diagnostic("NS4031", f"{folder} is not a run folder: {why}", hint=hint))


def changed_files(folder: Path, record: Mapping[str, Any]) -> list[str]:
    """Return what has become of files that are not as they were written, a sentence each."""
    found = []
    for name, expected in record["files"].items():
        path = folder / name
        if not path.resolve().is_relative_to(folder.resolve()):
            found.append(f"{name} lies outside of the folder")
        elif not path.is_file():
            found.append(f"{name} is missing")
        elif digest(path) != expected:
            found.append(f"{name} has been changed")
    return found


def verify(folder: str | Path) -> tuple[list[str], list[Verdict]]:
    """Certify the stored results of a run folder again, without running the deck.

    Parameters
    ----------
    folder : str or Path
        Written by ``nsspice run X.net --archive FOLDER``.

    Returns
    -------
    changed : list of str
        Files that are not as they were written, a sentence each.
    verdicts : list of Verdict
        One for each table, in the order of the runs.

    Raises
    ------
    UsageError
        NS4031 if it is not a run folder.
    NetlistError
        If the stored deck cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from nsspice.cli.commands.run import command
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     deck = Path(folder, "rc.net")
    ...     _ = deck.write_text("RC\\nV1 a 0 1\\nR1 a b 1k\\nC1 b 0 1u ic=0\\n.tran 1u 1m uic\\n")
    ...     command([str(deck), "--archive", f"{folder}/result", "-q"], standalone_mode=False)
    ...     changed, (verdict,) = verify(f"{folder}/result")
    >>> changed, verdict.passed, verdict.rows
    ([], True, 1001)
    """
    folder = Path(folder)
    record = read_record(folder)
    changed = changed_files(folder, record)
    circuit = read(
        folder / record["deck"],
        record["parameters"],
        seed=record["seed"],
        junctions=record.get("junctions"),  # folders of earlier versions do not say it
    )
    outside = [p for p in circuit.deck.included if not _is_known(p, folder)]
    changed += [f"{path} is read from outside of the folder" for path in outside]
    jobs = jobs_of(circuit.deck)
    return changed, [
        _verdict(folder, circuit, job, run, record["stop"])
        for job, run in zip(jobs, record["runs"], strict=False)
    ]


def _is_known(path: Path, folder: Path) -> bool:
    """Return whether a file belongs to the folder, or to the program."""
    return any(path.resolve().is_relative_to(home.resolve()) for home in (folder, PACKAGE))


def _verdict(
    folder: Path, circuit: Circuit, job: Job, run: Mapping[str, Any], stop: float | None
) -> Verdict:
    """Judge one table."""
    name = Path(run["table"]).name
    try:
        table = read_table(folder / name)
    except OutputError as error:
        return Verdict(name, 0, findings=(str(error.diagnostics[0].message),))
    rows = table.data.shape[0]
    findings = []
    if rows != run["rows"]:
        findings.append(f"{rows} rows, where the run had {run['rows']}")
    if table.names != [*filter(None, [run["axis"]]), *run["signals"]]:
        findings.append("its columns are not the signals of the run")
    own, inner, request = of_job(circuit, job, Request())
    if not isinstance(inner.card, TranCard) or findings:
        return Verdict(name, rows, findings=tuple(findings))
    analysis = Tran.from_card(inner.card)
    if stop is not None:
        analysis = replace(analysis, stop=stop)
    conditions = conditions_of(own, analysis, request.temperature, request.values)
    held = tuple(function.source for function in own.deck.sampled)
    judge = WrittenRows(own, table.names[1:], conditions, held)
    judge.take(table.data)
    islands = run["islands"]
    sampled = joined(None if i["unwatched"] is None else tuple(i["unwatched"]) for i in islands)
    granted = max([TOLERANCE, *(i["reltol"] for i in islands if i["reltol"])])
    law, pair = judge.worst(sampled, granted)
    for what, found in (("the law of", law), ("the characteristic of", pair)):
        if not found.error <= TOLERANCE:
            at = f"at {found.time:g} s by {found.error:.1e}"
            findings.append(f"{what} {found.element} is violated {at}")
    if np.any(np.diff(table.data[:, 0]) < 0.0):
        findings.append("its times are out of order")
    return Verdict(name, rows, law, pair, judge.counts, judge.left_out, tuple(findings))
