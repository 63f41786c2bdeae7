"""What users hand over that is no netlist for nsspice, and small things that irritated them."""

import subprocess
import sys

import numpy as np
import pytest

import nsspice
from nsspice.analyses.solution.solution import Solution
from nsspice.netlist import parse_text
from nsspice.output.raw import read_raw, write_raw
from nsspice.output.si import number

SCHEMATICS = {
    "LTspice": "Version 4\nSHEET 1 880 680\nWIRE 80 80 0 80\n",
    "LTspice (a symbol)": "Version 4\nSymbolType CELL\n",
    "KiCad": '(kicad_sch (version 20230121) (generator eeschema)\n  (paper "A4")\n)\n',
    "QSPICE": "\xabschematic\n  \xabcomponent (0,0) 0 0\n",
    "Qucs": "<Qucs Schematic 0.0.19>\n<Properties>\n",
    "xschem": "v {xschem version=3.4.4 file_version=1.2}\n",
}


@pytest.mark.parametrize("program", SCHEMATICS)
def test_schematics_are_recognised(program):
    with pytest.raises(nsspice.NetlistError) as caught:
        parse_text(SCHEMATICS[program], "drawing")
    (finding,) = caught.value.diagnostics
    assert finding.code == "NS1094"
    assert program in finding.message
    assert "netlist" in finding.hint.lower()


def test_old_kicad_and_titles_that_only_look_like_it():
    with pytest.raises(nsspice.NetlistError, match="KiCad"):
        parse_text("EESchema Schematic File Version 4\nEELAYER 30 0\n")
    for title in ("Version 4 of the buck", "KiCad schematic", "Qucs Schematic"):
        assert parse_text(f"{title}\nV1 a 0 1\nR1 a 0 1\n").title == title


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("Z1 c g e irg4", "NS1060", "no model irg4"),
        ("K1 L1 L2 0.99 KMOD", "NS1060", "no model kmod"),
        ("K1 L1 L2 kval", "NS1021", "kval"),
    ],
)
def test_what_is_not_simulated_is_called_by_its_name(line, code, words):
    deck = f"t\nV1 a 0 1\nL1 a b 1m\nL2 b 0 1m\n{line}\n.tran 1u 1m\n"
    with pytest.raises(nsspice.NetlistError) as caught:
        parse_text(deck)
    (finding,) = caught.value.diagnostics
    assert finding.code == code
    assert words in finding.message
    assert finding.span.line == 5


def test_a_bare_catalogue_is_a_note():
    for card in (".lib standard.dio", ".lib C:\\x\\lib\\cmp\\standard.bjt", ".lib nom.lib"):
        deck = parse_text(f"t\nV1 a 0 1\nR1 a 0 1\n{card}\n.op\n")
        assert [w.code for w in deck.warnings] == ["NS1053"], card
    with pytest.raises(nsspice.NetlistError):
        parse_text("t\nV1 a 0 1\nD1 a 0 mine\n.lib my_standard.dio\n.op\n")


def test_zero_has_no_sign():
    assert number(-0.0, "V") == "0 V"
    assert number(-0.0) == "0"
    solution = nsspice.op(nsspice.read("t\nV1 a 0 0\nE1 b 0 a 0 -1\nR1 b 0 1\n"))
    assert "-0 " not in solution.summary()


def test_without_scipy_a_conflict_is_an_error_with_a_hint(monkeypatch):
    monkeypatch.setitem(sys.modules, "scipy.optimize", None)
    circuit = nsspice.read("t\nV1 a 0 5\nD1 a 0\n.model d D(ideal)\n.op\n")
    with pytest.raises(nsspice.NumericalError) as caught:
        nsspice.op(circuit)
    assert caught.value.code == "NS3010"
    assert "install scipy" in str(caught.value)


def test_a_reader_that_has_enough_is_no_error(tmp_path):
    (tmp_path / "a.net").write_text("t\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n.tran 1u 1\n")
    command = [sys.executable, "-m", "nsspice", "run", "a.net", "-o", "-", "-q"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=tmp_path, stdout=pipe, stderr=pipe) as process:
        assert process.stdout.readline().startswith(b"time")
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait(60) == 141


def test_raw_files_are_read_back(tmp_path):
    t = np.linspace(0.0, 1e-3, 101)
    solution = Solution("tran", "t", "time", t, {"v(a)": np.sin(1e4 * t), "i(r1)": t / 3})
    write_raw(solution, tmp_path / "a.raw")
    names, data = read_raw(tmp_path / "a.raw")
    assert names == ["time", "v(a)", "i(r1)"]
    assert np.array_equal(data, [t, np.sin(1e4 * t), t / 3])
    # what an interrupted program leaves: whole points only
    content = (tmp_path / "a.raw").read_bytes()
    (tmp_path / "b.raw").write_bytes(content[:-30])
    assert np.array_equal(read_raw(tmp_path / "b.raw")[1], data[:, :-2])
    (tmp_path / "c.raw").write_bytes(content[:40])
    with pytest.raises(ValueError, match="not a raw file"):
        read_raw(tmp_path / "c.raw")


def test_text_and_complex_raw_files(tmp_path):
    head = (
        "Title: ac\r\nPlotname: AC Analysis\r\nFlags: complex\r\nNo. Variables: 2\r\n"
        "No. Points: 2\r\nVariables:\r\n\t0\tfrequency\tfrequency\r\n\t1\tv(a)\tvoltage\r\n"
    )
    text = head + "Values:\r\n0\t1.0,0.0\r\n\t2.0,-1.0\r\n1\t10.0,0.0\r\n\t4.0,3.0\r\n"
    (tmp_path / "a.raw").write_bytes(text.encode())
    names, data = read_raw(tmp_path / "a.raw")
    assert names == ["frequency", "v(a)"]
    assert data.tolist() == [[1.0, 10.0], [2.0, 4.0]]
    numbers = np.array([1.0, 0.0, 2.0, -1.0, 10.0, 0.0, 4.0, 3.0])
    (tmp_path / "b.raw").write_bytes(head.encode() + b"Binary:\r\n" + numbers.tobytes())
    assert np.array_equal(read_raw(tmp_path / "b.raw")[1], data)
