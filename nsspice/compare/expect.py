"""Expected results: reading ``X.expect.toml`` and checking ``X.net`` against it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import NsspiceError
from .checks import ImpulseCheck, Outcome, followed_by, signals_of
from .expectation import Expectation, Refusal, read_expectation

__all__ = ["Report", "check", "find_netlists"]


@dataclass(slots=True)
class Report:
    """What the checks of one netlist found.

    Parameters
    ----------
    netlist : Path
    outcomes : list of Outcome
        In the order of the file.
    problem : str
        Why the checks could not be made, ``""`` otherwise.
    wall_time : float
        [s]
    interrupted : bool
    """

    netlist: Path
    outcomes: list[Outcome] = field(default_factory=list)
    problem: str = ""
    wall_time: float = 0.0
    interrupted: bool = False

    @property
    def passed(self) -> bool:
        """True if there was no problem and every check passed."""
        return not self.problem and all(o.passed for o in self.outcomes)

    def __str__(self) -> str:
        lines = [f"{self.netlist}: {'passed' if self.passed else 'FAILED'}"]
        if self.problem:
            lines.append(self.problem)
        lines += [f"  {o}" for o in self.outcomes if not o.passed]
        return "\n".join(lines)

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        return {
            "netlist": str(self.netlist),
            "passed": self.passed,
            "problem": self.problem or None,
            "wall_time": self.wall_time,
            "checks": [o.to_dict() for o in self.outcomes],
        }


def check(netlist: str | Path) -> Report:
    """Simulate a netlist and check it against the ``.expect.toml`` file next to it.

    Parameters
    ----------
    netlist : str or Path
        ``X.net``, or ``X.expect.toml`` itself.

    Returns
    -------
    Report
        A failed check or simulation raises nothing; a pytest function can say
        ``report = nsspice.check(path); assert report.passed, str(report)``.

    Raises
    ------
    UsageError
        If the expectation file itself is missing or wrong.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "divider.net")
    ...     _ = path.write_text("divider\\nV1 a 0 2\\nR1 a b 1\\nR2 b 0 1\\n.op\\n")
    ...     _ = path.with_suffix(".expect.toml").write_text('''source = "two equal resistors"
    ... [[check]]
    ... signal = "v(b)"
    ... value = 1.0
    ... tolerance = 1e-12
    ... why = "linear, exact"
    ... ''')
    ...     check(path).passed
    True
    """
    expectation = read_expectation(Path(netlist))
    report = Report(expectation.netlist)
    begin = time.perf_counter()
    try:
        report.outcomes = _outcomes(expectation)
    except NsspiceError as error:
        if expectation.refused is None:
            report.problem = str(error)
        else:
            report.outcomes = _refusal(expectation.refused, error)
    except KeyboardInterrupt:
        report.problem, report.interrupted = "interrupted", True
    report.wall_time = time.perf_counter() - begin
    return report


def _outcomes(expectation: Expectation) -> list[Outcome]:
    """Run the deck and make all checks."""
    from ..analyses import Request, jobs_of, read, run_job

    circuit = read(expectation.netlist, expectation.params)
    jobs = jobs_of(circuit.deck)
    request = Request(
        method=expectation.method,
        theta=expectation.theta,
        step=expectation.step,
        stop=expectation.tstop,
        extra=signals_of(expectation.checks),
        follow=followed_by(expectation.checks),
    )
    for item in expectation.checks:
        if isinstance(item, ImpulseCheck):
            circuit.device(item.impulse)  # an element that does not exist has no impulse, either
    solutions = []
    for job in jobs:
        solutions.append(run_job(circuit, job, request))
        if solutions[-1].interrupted:
            raise KeyboardInterrupt
    if expectation.refused is not None:
        text = f"refused with {expectation.refused.code}"
        return [Outcome(text, False, "the deck was simulated instead")]
    outcomes = [item.evaluate(solutions, expectation.netlist) for item in expectation.checks]
    for solution in solutions:
        if solution.certificate is not None and not solution.certificate.passed:
            outcomes.append(Outcome(f"certificate of .{solution.analysis}", False, "it fails"))
    return outcomes


def _refusal(expected: Refusal, error: NsspiceError) -> list[Outcome]:
    """Compare an error with the one that was expected."""
    codes = [d.code for d in error.diagnostics if d.severity == "error"]
    text = str(error).lower()
    outcomes = [
        Outcome(
            f"refused with {expected.code}",
            expected.code in codes,
            f"the codes are {', '.join(codes)}: {error.diagnostics[0].message}",
        )
    ]
    if expected.exit is not None:
        outcomes.append(
            Outcome(
                f"exit code {expected.exit}",
                error.exit_code == expected.exit,
                f"it is {error.exit_code}",
            )
        )
    outcomes += [
        Outcome(f"message mentions {word!r}", word.lower() in text, f"the message is: {error}")
        for word in expected.mentions
    ]
    return outcomes


def find_netlists(paths: Sequence[str | Path]) -> list[Path]:
    """Return all ``X.expect.toml`` files of some netlists and folders, sorted within a folder.

    Parameters
    ----------
    paths : sequence of str or Path
        A netlist means the expectation file next to it.
    """
    found: dict[Path, None] = {}
    for item in map(Path, paths):
        if item.is_dir():
            found.update((p, None) for p in sorted(item.rglob("*.expect.toml")))
        else:
            found[item] = None
    return list(found)
