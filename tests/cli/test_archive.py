"""``nsspice run --archive`` and ``nsspice verify``: stored results, judged without a run."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

Call = Callable[..., Result]

BUCK = """buck
.param duty=0.5
.include models/switch.inc
V1 in 0 12
S1 in sw g 0 fast
D1 0 sw
L1 sw out 100u
C1 out 0 10u
R1 out 0 5
Vg g 0 PULSE(0 1 0 0 0 {duty*10u} 10u)
.tran 1u 200u uic
.op
"""


@pytest.fixture
def stored(call: Call) -> Path:
    """Return the folder of a run of a deck that includes a file."""
    Path("models").mkdir()
    Path("models/switch.inc").write_text(".model fast SW(VT=0.5 RON=1m)\n", "utf-8")
    Path("buck.net").write_text(BUCK, "utf-8")
    assert call("run", "buck.net", "--param", "duty=0.4", "--archive", "kept").exit_code == 0
    return Path("kept")


def judged(call: Call) -> tuple[int, dict[str, object]]:
    told = call("verify", "kept", "--json")
    return told.exit_code, json.loads(told.stdout)


def sign_again(folder: Path, name: str) -> None:
    """Put the hash of a changed file into the record, as somebody would who hides it."""
    path = folder / "run.json"
    record = json.loads(path.read_text("utf-8"))
    record["files"][name] = hashlib.sha256((folder / name).read_bytes()).hexdigest()
    path.write_text(json.dumps(record), "utf-8")


def test_a_stored_run_is_certified_where_its_sources_are_gone(call: Call, stored: Path) -> None:
    Path("buck.net").unlink()
    Path("models/switch.inc").unlink()
    code, found = judged(call)
    assert (code, found["changed"]) == (0, [])
    tran, op = found["runs"]  # type: ignore[misc]
    assert (tran["table"], tran["rows"], tran["passed"]) == ("buck.tran.csv", 201, True)
    # Kirchhoff's laws at sw, out, in; the diode and the switch with its control; both sources
    assert tran["judged"]["set-valued elements"] == 2
    assert tran["judged"]["controls of switches"] == 1
    assert tran["judged"]["sources"] == 2
    assert tran["judged"]["sums"] >= 2
    assert tran["laws"] <= 1e-8
    assert (op["passed"], op["laws"]) == (True, None)
    assert "certificate holds" in call("verify", "kept").stderr


def test_values_that_break_a_law_are_named(call: Call, stored: Path) -> None:
    table = stored / "buck.tran.csv"
    lines = table.read_text("utf-8").splitlines()
    column = lines[0].split(",").index("i(l1)")
    cells = lines[50].split(",")
    cells[column] = repr(1.001 * float(cells[column]))
    table.write_text("\n".join([*lines[:50], ",".join(cells), *lines[51:], ""]), "utf-8")
    code, found = judged(call)
    assert code == 1
    assert found["changed"] == ["buck.tran.csv has been changed"]
    sign_again(stored, "buck.tran.csv")
    code, found = judged(call)
    assert (code, found["changed"]) == (1, [])
    (finding,) = found["runs"][0]["findings"]  # type: ignore[index]
    assert "the law of node" in finding
    assert "at 4.9e-05 s" in finding


def test_another_deck_does_not_have_these_rows(call: Call, stored: Path) -> None:
    included = stored / "deck/models/switch.inc"
    included.write_text(".model fast SW(VT=0.5 RON=2m)\n", "utf-8")
    sign_again(stored, "deck/models/switch.inc")
    code, found = judged(call)
    assert code == 1
    assert "the characteristic of s1" in found["runs"][0]["findings"][0]  # type: ignore[index]


def test_rows_that_are_missing_are_told(call: Call, stored: Path) -> None:
    table = stored / "buck.tran.csv"
    lines = table.read_text("utf-8").splitlines()
    table.write_text("\n".join([*lines[:-10], ""]), "utf-8")
    sign_again(stored, "buck.tran.csv")
    code, found = judged(call)
    assert code == 1
    assert found["runs"][0]["findings"] == ["191 rows, where the run had 201"]  # type: ignore[index]
    table.unlink()
    told = call("verify", "kept")
    assert told.exit_code == 1
    assert "buck.tran.csv is missing" in told.stderr


@pytest.mark.parametrize("text", [None, "{}", '{"format": 99}', "no json"])
def test_what_is_no_run_folder_is_refused(call: Call, text: str | None) -> None:
    Path("kept").mkdir()
    if text is not None:
        Path("kept/run.json").write_text(text, "utf-8")
    told = call("verify", "kept")
    assert told.exit_code == 2
    assert "NS4031" in told.stderr
    assert "--archive kept" in told.stderr


def test_the_end_of_the_run_is_that_of_the_command(call: Call) -> None:
    # the pulse has the length of the run where its card does not say one
    Path("pulse.net").write_text("pulse\nV1 a 0 PULSE(0 1)\nR1 a 0 1\n.tran 1u 10u\n", "utf-8")
    assert call("run", "pulse.net", "--tstop", "5u", "--archive", "kept").exit_code == 0
    code, found = judged(call)
    assert code == 0
    assert found["runs"][0]["rows"] == 6  # type: ignore[index]


LINES = """rectifier
V1 a 0 SIN(0 5 1k)
D1 a b dio
R1 b 0 100
.model dio D(IS=1n RS=0.1)
.tran 1u 2m
"""


def test_diodes_that_are_broken_lines_are_judged(call: Call) -> None:
    Path("line.net").write_text(LINES, "utf-8")
    assert call("run", "line.net", "--junctions", "lines", "--archive", "kept").exit_code == 0
    code, found = judged(call)
    (run,) = found["runs"]  # type: ignore[misc]
    assert (code, run["judged"]["set-valued elements"], run["left_out"]) == (0, 1, [])
    # what Kirchhoff's laws and the source cannot see: one current all around, and R1's voltage
    table = Path("kept/line.csv")
    lines = table.read_text("utf-8").splitlines()
    names = lines[0].split(",")
    cells = lines[251].split(",")
    for name in ("i(v1)", "i(d1)", "i(r1)", "v(b)"):
        if name in names:
            cells[names.index(name)] = repr(1.0001 * float(cells[names.index(name)]))
    table.write_text("\n".join([*lines[:251], ",".join(cells), *lines[252:], ""]), "utf-8")
    sign_again(Path("kept"), "line.csv")
    code, found = judged(call)
    (finding,) = found["runs"][0]["findings"]  # type: ignore[index]
    assert code == 1
    assert "the characteristic of d1 is violated at 0.00025 s" in finding


def test_rows_of_coarser_lines_are_not_those_of_finer_ones(call: Call) -> None:
    Path("line.net").write_text(LINES, "utf-8")
    assert call("run", "line.net", "--junctions", "lines:0.2", "--archive", "kept").exit_code == 0
    assert judged(call)[0] == 0
    record = Path("kept/run.json")
    record.write_text(record.read_text("utf-8").replace("lines:0.2", "lines:0.1"), "utf-8")
    code, found = judged(call)
    assert code == 1
    assert "the characteristic of d1" in found["runs"][0]["findings"][0]  # type: ignore[index]


def test_a_junction_with_a_charge_is_told_to_be_left_out(call: Call) -> None:
    Path("line.net").write_text(LINES.replace("RS=0.1", "RS=0.1 CJO=1n"), "utf-8")
    assert call("run", "line.net", "--junctions", "lines", "--archive", "kept").exit_code == 0
    told = call("verify", "kept")
    assert told.exit_code == 0
    assert "not judged: d1" in told.stderr


def test_junctions_are_read_as_the_command_said(call: Call) -> None:
    Path("line.net").write_text(LINES, "utf-8")
    assert call("run", "line.net", "--junctions", "lines", "--archive", "kept").exit_code == 0
    record = Path("kept/run.json")
    known = json.loads(record.read_text("utf-8"))
    assert known["junctions"] == "lines"
    assert judged(call)[0] == 0
    # what the record says is obeyed: the same deck with a difference that cannot be asked for
    record.write_text(json.dumps({**known, "junctions": "lines:7"}), "utf-8")
    told = call("verify", "kept")
    assert told.exit_code == 2
    assert "junctions cannot be 'lines:7'" in told.stderr
    # a folder of a version that did not note it is read as its deck says
    del known["junctions"]
    record.write_text(json.dumps(known), "utf-8")
    assert judged(call)[0] == 0


def test_a_folder_has_its_own_tables(call: Call, stored: Path) -> None:
    assert call("run", "buck.net", "--archive", "kept", "-o", "a.csv").exit_code == 2
