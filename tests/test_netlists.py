"""Every netlist with an expectation file, through the same runner as ``nsspice test``."""

from __future__ import annotations

from pathlib import Path

import pytest

import nsspice

NETLISTS = Path(__file__).parents[1] / "netlists"
FILES = sorted(NETLISTS.rglob("*.expect.toml"))


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.relative_to(NETLISTS).as_posix()[:-12])
def test_netlist(path: Path) -> None:
    report = nsspice.check(path)
    assert report.passed, str(report)


def test_every_netlist_has_an_expectation() -> None:
    missing = [
        p for p in sorted(NETLISTS.rglob("*.net")) if not p.with_suffix(".expect.toml").exists()
    ]
    # files that other netlists include carry no analysis of their own
    assert not [p for p in missing if ".tran" in p.read_text() or ".op" in p.read_text()]
