"""``nsspice sweep``: values on the command line, the table, exit codes, files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from nsspice.cli.app import app

DIVIDER = """divider
.param r=1k
V1 a 0 10
R1 a b {r}
R2 b 0 1k
.op
.measure op out find v(b) at=0
"""


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("a.net").write_text(DIVIDER)
    return tmp_path


def run(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["sweep", "a.net", *arguments])


def column(result: Result, name: str) -> list[float]:
    assert result.exit_code == 0, result.output
    found: list[float] = json.loads(result.stdout)["columns"][name]
    return found


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("r=1k,3k", [1e3, 3e3]),
        ("R=1k:4k:4", [1e3, 2e3, 3e3, 4e3]),
        ("r=1:100:3:log", [1.0, 10.0, 100.0]),
        ("r2=2k", [2e3]),
    ],
)
def test_values(text: str, values: list[float]) -> None:
    result = run("--over", text, "--json")
    assert column(result, text.partition("=")[0].lower()) == pytest.approx(values, rel=1e-15)


@pytest.mark.parametrize(
    "law", ["10%", "uniform(900,1100)", "normal(1k,1)", "loguniform(900,1.1k)"]
)
def test_distributions(law: str) -> None:
    drawn = column(run("--over", f"r={law}", "--samples", "8", "--json"), "r")
    assert len(set(drawn)) == 8
    assert all(900.0 <= x <= 1100.0 for x in drawn)


def test_the_table_and_its_files() -> None:
    result = run("--over", "r=1k,3k", "--over", "r2=1k,2k", "-o", "t.csv", "--map", "out", "m.png")
    assert result.exit_code == 0, result.output
    heading, *rows = result.stdout.splitlines()
    assert heading.split() == ["r", "r2", "[Ohm]", "out", "[V]"]
    assert [float(row.split()[2]) for row in rows] == pytest.approx(
        [5.0, 20 / 3, 2.5, 4.0], rel=1e-6
    )
    assert Path("t.csv").read_text().startswith("r,r2,out,status,seconds")
    assert Path("m.png").stat().st_size > 2000


def test_a_failed_point_is_told_with_exit_code_3() -> None:
    Path("a.net").write_text(
        "clash\n.param v=1\nV1 a 0 {v}\nD1 a 0\n.op\n.measure op o find v(a) at=0\n"
    )
    result = run("--over", "v=-1,1")
    assert result.exit_code == 3
    assert "1 point without a result, NS" in result.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        [],  # the deck has no .step card
        ["--over", "r"],
        ["--over", "r=1:2"],
        ["--over", "r=1:2:0"],
        ["--over", "r=-1:2:3:log"],
        ["--over", "r=x"],
        ["--over", "nobody=1"],
        ["--over", "r=5%"],
        ["--over", "r=1", "--samples", "3"],
        ["--over", "r=1", "--resume"],
        ["--over", "r=1", "-o", "a.xlsx"],
        ["--over", "r=1", "--plot", "a.bmp"],
        ["--over", "r=1", "--measure", "x"],
        ["--over", "r=1", "--executor", "slurm:x"],
        ["--over", "r=1", "-j", "0"],
    ],
)
def test_refused(arguments: list[str]) -> None:
    result = run(*arguments)
    assert result.exit_code == 2, result.output
    assert "error" in result.stderr


def test_foreign_files_are_kept() -> None:
    Path("mine.csv").write_text("mine\n")
    assert run("--over", "r=1", "-o", "mine.csv").exit_code == 2
    assert Path("mine.csv").read_text() == "mine\n"
