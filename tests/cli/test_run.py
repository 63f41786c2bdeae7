"""nsspice run: files, messages, exit codes."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest


def read(path: str) -> tuple[list[str], np.ndarray]:
    names = Path(path).read_text().splitlines()[0].split(",")
    return names, np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)


def test_a_transient_leaves_a_csv_and_a_summary(call):
    result = call("run", "rc.net", "-v")
    assert result.exit_code == 0, result.stderr
    names, rows = read("rc.csv")
    assert names == ["time", "v(in)", "v(out)", "i(v1)"]
    assert rows.shape == (11, 4)
    assert rows[-1, 0] == 1e-3
    assert rows[-1, 2] == pytest.approx(1 - math.exp(-1), rel=1e-12)
    for words in ("LINEAR_DAE", "modewise", "1 segment", "certificate holds"):
        assert words in result.stderr
    assert "vend" in result.stderr
    assert "never = not found" in result.stderr
    assert "NS5001" in result.stderr
    assert "written: rc.csv" in result.stderr
    assert result.stdout == ""


def test_quiet(call):
    result = call("run", "rectifier.net", "-q")
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")
    assert Path("rectifier.csv").exists()


def test_several_analyses_get_a_file_each(call):
    assert call("run", "divider.net").exit_code == 0
    assert read("divider.op.csv")[1].tolist() == [[2.0, 1.0, -1e-3]]
    names, rows = read("divider.dc.csv")
    assert names[0] == "v1"
    assert rows[:, 0].tolist() == [0.0, 1.0, 2.0]
    assert rows[:, 2].tolist() == [0.0, 0.5, 1.0]
    assert read("divider.tran.csv")[0][0] == "time"


def test_steps_get_a_file_each(call):
    assert call("run", "stepped.net").exit_code == 0
    assert read("stepped.step1.csv")[1][0, 1] == 1.0
    assert read("stepped.step2.csv")[1][0, 1] == 0.5


def test_steps_are_one_table_with_what_was_measured(call):
    deck = "divider\n.param r=1k\nV1 a 0 2\nR1 a b {r}\nR2 b 0 1k\n.op\n"
    deck += ".step param r list 1k 3k 7k\n.measure op half find v(b) at=0\n"
    Path("a.net").write_text(deck)
    found = call("run", "a.net")
    assert found.exit_code == 0
    lines = [line.split() for line in found.stderr.splitlines()]
    assert lines[0] == ["op:", "3", "steps,", "certificate", "holds"]
    assert lines[1] == ["r", "half"]
    # 2 V times 1k / (r + 1k)
    assert [[float(x) for x in line] for line in lines[2:5]] == [
        [1000.0, 1.0], [3000.0, 0.5], [7000.0, 0.25],
    ]  # fmt: skip
    assert found.stderr.count("written") == 1
    # details are those of each run
    assert call("run", "a.net", "--verbose", "--force").stderr.count("half =") == 3


def test_output_name(call):
    assert call("run", "rc.net", "-o", "x.csv").exit_code == 0
    assert Path("x.csv").exists()
    assert call("run", "divider.net", "-o", "y.csv").exit_code == 0
    assert Path("y.tran.csv").exists()


def test_standard_output(call):
    result = call("run", "rc.net", "-o", "-", "-q")
    assert result.exit_code == 0
    assert result.stdout.splitlines()[0] == "time,v(in),v(out),i(v1)"
    assert len(result.stdout.splitlines()) == 12
    assert not Path("rc.csv").exists()


def test_standard_output_takes_one_table(call):
    result = call("run", "divider.net", "-o", "-")
    assert result.exit_code == 2
    assert "NS4003" in result.stderr


def test_standard_input(call):
    result = call("run", "-", input=Path("rc.net").read_text())
    assert result.exit_code == 0
    assert Path("stdin.csv").exists()


def test_raw_file(call):
    assert call("run", "rc.net", "-o", "rc.raw").exit_code == 0
    assert Path("rc.raw").read_bytes().startswith(b"Title: RC charged")


@pytest.mark.parametrize(
    "args",
    [("run", "rc.net", "--plot"), ("run", "--plot", "rc.net"), ("run", "--plot=rc.png", "rc.net")],
)
def test_plot(call, args):
    result = call(*args)
    assert result.exit_code == 0, result.stderr
    assert Path("rc.png").read_bytes().startswith(b"\x89PNG")
    assert "written: rc.csv, rc.png" in result.stderr


def test_plot_of_an_operating_point_is_refused_before_anything_is_done(call):
    result = call("run", "stepped.net", "--plot")
    assert result.exit_code == 2
    assert "nothing to draw" in result.stderr
    assert not list(Path().glob("*.csv"))


def test_steps_are_one_picture(call):
    deck = Path("rc.net").read_text().replace("1k", "{r}\n.param r=1k")
    Path("family.net").write_text(deck + ".step param r list 1k 2k\n")
    result = call("run", "family.net", "--plot", "--dark", "--signals", "v(out)")
    assert result.exit_code == 0, result.stderr
    assert {p.name for p in Path().glob("family.*")} == {
        "family.net", "family.png", "family.step1.csv", "family.step2.csv",
    }  # fmt: skip
    assert call("run", "family.net", "--plot", "--signals", "v(in)", "--signals", "v(out) i(r1)")


def test_unknown_picture_format(call):
    result = call("run", "rc.net", "--plot", "rc.bmp")
    assert result.exit_code == 2
    assert "NS4008" in result.stderr


def test_json(call):
    result = call("run", "rc.net", "--json")
    data = json.loads(result.stdout)
    assert result.stderr == ""
    (run,) = data["runs"]
    assert run["analysis"] == "tran"
    assert run["rows"] == 11
    assert run["files"] == ["rc.csv"]
    assert run["measures"]["never"] is None
    assert run["certificate"]["passed"] is True
    assert run["islands"][0]["class"] == "LINEAR_DAE"


def test_signals(call):
    assert call("run", "rc.net", "--signals", "v(out), i(c1) p(r1) v(in,out)").exit_code == 0
    names = Path("rc.csv").read_text().splitlines()[0]
    assert names == 'time,v(out),i(c1),p(r1),"v(in,out)"'
    rows = np.loadtxt("rc.csv", delimiter=",", skiprows=1)
    # the power is voltage times current, and one current flows through all
    assert rows[1:, 3] == pytest.approx(rows[1:, 4] * rows[1:, 2], rel=1e-12)


def test_unknown_signal(call):
    result = call("run", "rc.net", "--signals", "v(oout)")
    assert result.exit_code == 2
    assert "NS2012" in result.stderr
    assert "did you mean v(out)?" in result.stderr


def test_parameters(call):
    assert call("run", "divider.net", "--param", "r=3k").exit_code == 0
    assert read("divider.op.csv")[1][0, 1] == 0.5


@pytest.mark.parametrize("item", ["r", "r=", "=1", "r=abc", "r=2k2", "r=nan"])
def test_wrong_parameters(call, item):
    result = call("run", "divider.net", "--param", item)
    assert result.exit_code == 2
    assert "NS4005" in result.stderr


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("--method", "modwise"), "no method 'modwise'"),
        (("--theta", "1.5"), "0 to 1"),
        (("--step", "0"), "positive step"),
        (("--step", "x1"), "Invalid value"),
    ],
)
def test_wrong_settings(call, args, words):
    result = call("run", "rc.net", *args)
    assert result.exit_code == 2
    assert words in result.stderr


def test_smaller_steps_come_closer(call):
    errors = []
    for step in ("10u", "5u"):
        assert call("run", "rc.net", "--step", step).exit_code == 0
        errors.append(abs(read("rc.csv")[1][-1, 2] - (1 - math.exp(-1))))
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)
    assert call("run", "rc.net", "--step", "10u", "--theta", "0.5").exit_code == 0
    assert abs(read("rc.csv")[1][-1, 2] - (1 - math.exp(-1))) < errors[1] / 100


def test_stop_time(call):
    assert call("run", "rc.net", "--tstop", "2m").exit_code == 0
    assert read("rc.csv")[1][-1, 0] == 2e-3


def test_all_netlist_errors_at_once(call):
    result = call("run", "wrong.net")
    assert result.exit_code == 2
    assert "wrong.net:3:1" in result.stderr
    assert "wrong.net:4" in result.stderr
    assert "did you mean .tran?" in result.stderr
    assert "2 errors" in result.stderr
    assert "Traceback" not in result.stderr


def test_errors_as_json(call):
    result = call("run", "wrong.net", "--json")
    assert result.exit_code == 2
    data = json.loads(result.stderr)
    assert data["exit_code"] == 2
    assert sorted(e["line"] for e in data["errors"]) == [3, 4]


def test_missing_netlist(call):
    result = call("run", "no.net")
    assert result.exit_code == 2
    assert "no.net" in result.stderr
    assert "Traceback" not in result.stderr


def test_no_analysis(call):
    Path("bare.net").write_text("bare\nR1 a 0 1\nV1 a 0 1\n")
    result = call("run", "bare.net")
    assert result.exit_code == 2
    assert "NS4006" in result.stderr


def test_a_contradiction_names_its_elements_and_keeps_the_rows_before(call):
    result = call("run", "contradiction.net")
    assert result.exit_code == 3
    assert "NS3001" in result.stderr
    assert "v1" in result.stderr
    assert "d1" in result.stderr
    _, rows = read("contradiction.csv")
    assert 0.8e-3 < rows[-1, 0] < 1.1e-3


def test_the_netlist_itself_is_not_overwritten(call):
    text = Path("rc.net").read_text()
    result = call("run", "rc.net", "-o", "./rc.net")
    assert result.exit_code == 2
    assert "NS4002" in result.stderr
    assert Path("rc.net").read_text() == text


def test_an_included_file_is_not_overwritten(call):
    Path("load.inc").write_text("R2 out 0 1k\n")
    Path("main.net").write_text(Path("rc.net").read_text() + ".include load.inc\n")
    result = call("run", "main.net", "-o", "load.inc")
    assert result.exit_code == 2
    assert "NS4002" in result.stderr
    assert Path("load.inc").read_text() == "R2 out 0 1k\n"


def test_missing_output_folder(call):
    result = call("run", "rc.net", "-o", "no/such/a.csv")
    assert result.exit_code == 2
    assert "there is no folder" in result.stderr


def test_two_runs_give_identical_bytes(call):
    for name in ("one.csv", "two.csv"):
        assert call("run", "rectifier.net", "-o", name).exit_code == 0
    assert Path("one.csv").read_bytes() == Path("two.csv").read_bytes()


def test_misspelt_command(call):
    result = call("rnu", "rc.net")
    assert result.exit_code == 2
    assert "did you mean run?" in result.stderr
    assert "nsspice run rc.net" in call("rc.net").stderr


def test_help_lists_the_commands(call):
    result = call("--help")
    assert result.exit_code == 0
    for name in ("run", "explain", "test", "compare"):
        assert name in result.stdout
        assert call(name, "--help").exit_code == 0


@pytest.mark.parametrize(
    ("name", "hint"),
    [("a.xlsx", "extension .csv, .raw, .npz"), ("a.MAT", ".csv"), ("a.png", "--plot a.png")],
)
def test_a_table_of_another_format_is_refused_before_the_run(call, name, hint):
    result = call("run", "rc.net", "-o", name)
    assert result.exit_code == 2
    assert "NS4008" in result.stderr
    assert hint in result.stderr
    assert not Path(name).exists()


def test_any_other_name_gets_the_table_as_text(call):
    assert call("run", "rc.net", "-o", "a.txt").exit_code == 0
    assert Path("a.txt").read_text().startswith("time,")


def test_a_report_beside_the_csv_file(call):
    assert call("run", "--report", "rc.net").exit_code == 0
    assert Path("rc.csv").exists()
    assert "Certificate" in Path("rc.html").read_text("utf-8")
    assert call("run", "rc.net", "--report", "x.pdf").exit_code == 2
    # an error keeps what was computed, in the page as well
    assert call("run", "contradiction.net", "--report").exit_code == 3
    assert Path("contradiction.html").exists()


def test_a_raw_file_holds_all_steps_as_plots(call):
    """As ngspice writes them, one after the other; each title tells the values of its step."""
    assert call("run", "stepped.net", "-o", "a.raw").exit_code == 0
    assert call("run", "stepped.net", "-o", "a.raw").exit_code == 0  # replaced, not extended
    content = Path("a.raw").read_bytes()
    assert content.count(b"Title: ") == content.count(b"Binary:") == 2
    assert b"Title: stepped divider, r = 1000\n" in content
    assert b"Title: stepped divider, r = 3000\n" in content
    assert not list(Path().glob("a.step*"))


def test_other_analyses_have_raw_files_of_their_own(call):
    assert call("run", "divider.net", "-o", "a.raw").exit_code == 0
    assert {p.name for p in Path().glob("*.raw")} == {"a.op.raw", "a.dc.raw", "a.tran.raw"}


def test_numpy_archives_are_written_and_replaced(call):
    for _ in range(2):  # the second run knows the file as its own
        assert call("run", "rc.net", "-o", "a.npz", "--signals", "v(out)").exit_code == 0
    with np.load("a.npz") as archive:
        assert list(archive) == ["time", "v(out)"]
        assert archive["time"].size == 11
    np.savez("other.npz", x=np.zeros(3))
    result = call("run", "rc.net", "-o", "other.npz")
    assert result.exit_code == 2
    assert "NS4018" in result.stderr


def test_a_missing_package_is_told_before_the_run(call, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    result = call("run", "long.net", "-o", "a.parquet")
    assert result.exit_code == 2
    assert "NS4010" in result.stderr
    assert "pip install pyarrow" in result.stderr
