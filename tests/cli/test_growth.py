"""Unstable circuits: at rest they stay there, and growth beyond all numbers is told as such."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

import nsspice
from nsspice.cli.app import app

UNSTABLE = "feedback of the wrong sign\nR1 out p 15.9k\nC1 p 0 10n IC={}\nE1 out 0 p 0 3\n"


def test_an_unstable_circuit_at_rest_stays_there() -> None:
    run = nsspice.tran(nsspice.read(UNSTABLE.format(0) + ".tran 2u 100m uic\n"))
    assert run.certificate is not None
    assert run.certificate.passed
    assert not run["v(out)"].any()


def test_growth_beyond_the_range_of_numbers_has_a_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.net").write_text(UNSTABLE.format("1n") + ".tran 2u 100m uic\n")
    result = CliRunner().invoke(app, ["run", "a.net"])
    assert result.exit_code == 3
    assert "NS3003: v(out) exceeds the range of numbers" in result.output
    assert "feedback of the wrong sign" in result.output
