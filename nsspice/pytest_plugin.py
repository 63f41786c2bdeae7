"""A pytest plugin: with ``--decks`` each ``X.expect.toml`` is a test of the netlist next to it.

It is registered by the installed package; ``nsspice test -k ... -n ... --junit-xml ...`` runs it.

Examples
--------
::

    pytest --decks netlists -k buck -n 4 --junit-xml report.xml
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

ENDING = ".expect.toml"


class CheckFailed(AssertionError):
    """The checks of a netlist that failed, as ``nsspice test`` shows them."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that turns collection on: other projects may have files of that name."""
    group = parser.getgroup("nsspice", "netlists with expected results")
    group.addoption(
        "--decks", action="store_true", help="check netlists against X.expect.toml next to them"
    )


def pytest_collect_file(parent: pytest.Collector, file_path: Path) -> pytest.Collector | None:
    """Collect an expectation file, or the one next to a netlist that was named."""
    if not parent.config.getoption("--decks"):
        return None
    path = file_path
    if path.suffix in (".net", ".cir") and parent.session.isinitpath(path):
        path = path.with_suffix(ENDING)
    if not path.name.endswith(ENDING):
        return None
    return ExpectationFile.from_parent(parent, path=path)


class ExpectationFile(pytest.File):
    """One expectation file; it makes one test."""

    def collect(self) -> Iterator[pytest.Item]:
        """Return the test of the file."""
        yield NetlistItem.from_parent(self, name=self.path.name.removesuffix(ENDING))


class NetlistItem(pytest.Item):
    """The run of a netlist and all its checks."""

    def runtest(self) -> None:
        """Simulate and check; a failed check fails the test with its numbers."""
        from nsspice.compare.expect import check

        report = check(self.path)
        if not report.passed:
            raise CheckFailed(str(report))

    def repr_failure(
        self, excinfo: pytest.ExceptionInfo[BaseException], style: object = None
    ) -> str:
        """Return what failed, without a traceback: the fault is in a deck, not in Python."""
        if isinstance(excinfo.value, CheckFailed):
            return str(excinfo.value)
        return str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Path, int, str]:
        """Return file, line and name for listings."""
        return self.path, 0, self.name
