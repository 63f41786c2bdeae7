"""What the world does to a run: files that vanish, places that cannot be written, huge lines."""

from __future__ import annotations

from pathlib import Path

import pytest


def test_two_runs_write_identical_bytes(process):
    for name in ("one.csv", "two.csv"):
        assert process("run", "rectifier.net", "-o", name, "-q").returncode == 0
    assert Path("one.csv").read_bytes() == Path("two.csv").read_bytes()


@pytest.mark.parametrize("target", ["no/such/folder/a.csv", "folder"])
def test_a_place_that_cannot_be_written_is_told_before_the_run(process, target):
    Path("folder").mkdir()
    done = process("run", "rc.net", "-o", target)
    assert done.returncode == 2
    assert "NS4001" in done.stderr
    assert "Traceback" not in done.stderr


def test_an_included_file_that_has_gone_is_named_with_its_line(process):
    Path("top.net").write_text("top\nV1 a 0 1\n.include parts.inc\nR1 a 0 1\n.op\n")
    Path("parts.inc").write_text("R2 a 0 1\n")
    assert process("run", "top.net", "-q").returncode == 0
    Path("parts.inc").unlink()
    done = process("run", "top.net")
    assert done.returncode == 2
    assert "top.net:3" in done.stderr
    assert "NS1050" in done.stderr


@pytest.mark.parametrize("line", ["*" + "x" * 10**6, "R1 a 0 1 ;" + "y" * 10**6])
def test_a_line_of_a_million_characters_is_read(process, line):
    Path("long_line.net").write_text(f"long\nV1 a 0 1\nR9 a 0 1\n{line}\n.op\n")
    done = process("run", "long_line.net", "-q")
    assert done.returncode == 0, done.stderr[:500]


def test_a_value_of_a_million_digits_is_refused_or_read_without_a_crash(process):
    Path("digits.net").write_text(f"digits\nV1 a 0 1\nR1 a 0 {'9' * 10**6}\n.op\n")
    done = process("run", "digits.net", "-q")
    assert done.returncode in (0, 2)
    assert "Traceback" not in done.stderr
    assert len(done.stderr) < 20_000


def test_a_run_that_fails_its_certificate_exits_with_3_and_keeps_its_rows(call, monkeypatch):
    from nsspice.solvers.audit import Auditor
    from nsspice.solvers.intervals import Intervals
    from nsspice.solvers.moreau import Records

    for name, kind in ("check", Records), ("check_intervals", Intervals):
        check = getattr(Auditor, name)

        def spoilt(self, points, *rest, check=check, kind=kind):
            points = kind.of(points)
            points.z[:] *= 1.001
            check(self, points, *rest)

        monkeypatch.setattr(Auditor, name, spoilt)
    done = call("run", "rectifier.net", "-o", "kept.csv")
    assert done.exit_code == 3
    assert "NS3003" in done.output
    assert len(Path("kept.csv").read_text().splitlines()) > 10
