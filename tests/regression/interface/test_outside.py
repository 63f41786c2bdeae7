"""Faults from outside: signals, files of others, decks that explode, texts for terminals."""

import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import nsspice
from nsspice.analyses.request.interrupts import Interrupts
from nsspice.cli.app import app
from nsspice.netlist import parse_file, parse_text
from nsspice.output.csv import CsvSink
from nsspice.output.ownership import written_by_nsspice

DECK = "a buck\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n.tran 1u 1m\n"
#: 1e9 rows, for which 4 GB have to be free: it does not end before a signal comes
LONG = DECK.replace("1u 1m", "10n 10")
LAB = "Time (s),CH1 (V)\n0.0,1.00\n1e-3,0.98\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("buck.net").write_text(DECK)
    Path("long.net").write_text(LONG)
    return tmp_path


def nsspice_run(*words):
    return CliRunner().invoke(app, ["run", *words], catch_exceptions=False)


@contextmanager
def ended(command, **more):
    """A process that does not outlive a failed test: it writes some hundred MB a minute."""
    with subprocess.Popen(command, **more) as running:
        try:
            yield running
        finally:
            running.kill()


def heard(name):
    """Lets a process hear a signal even under nohup, which hands on that it is ignored."""
    return lambda: signal.signal(getattr(signal, name), signal.SIG_DFL)


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_signals_keep_complete_rows(folder, name):
    command = [sys.executable, "-m", "nsspice", "run", "long.net"]
    with ended(command, stderr=subprocess.PIPE, text=True, preexec_fn=heard(name)) as running:
        deadline = time.monotonic() + 60.0
        part = Path("long.csv.part")
        while not (part.exists() and part.stat().st_size > 100_000):
            assert running.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)
        assert not Path("long.csv").exists()
        running.send_signal(getattr(signal, name))
        _, messages = running.communicate(timeout=60)
    assert running.returncode == 130
    assert "INTERRUPTED" in messages
    assert "Traceback" not in messages
    assert not part.exists()
    text = Path("long.csv").read_bytes()
    assert text.endswith(b"\n")
    lines = text.splitlines()
    assert len({line.count(b",") for line in lines}) == 1
    assert float(lines[-1].split(b",")[0]) == pytest.approx((len(lines) - 2) * 1e-8)


def test_a_killed_run_leaves_a_part(folder):
    Path("long.csv").write_text("time,v(a)\n0,1\n")
    command = [sys.executable, "-m", "nsspice", "run", "long.net", "-q"]
    with ended(command, stderr=subprocess.DEVNULL) as running:
        deadline = time.monotonic() + 60.0
        part = Path("long.csv.part")
        while not (part.exists() and part.stat().st_size > 100_000):
            assert time.monotonic() < deadline
            time.sleep(0.02)
        running.kill()
    assert Path("long.csv").read_text() == "time,v(a)\n0,1\n"  # what was there before
    assert part.exists()


def test_a_library_leaves_sigterm_to_its_program():
    before = signal.getsignal(signal.SIGTERM)
    with Interrupts():
        assert signal.getsignal(signal.SIGTERM) is before
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        with Interrupts() as interrupts:
            signal.raise_signal(signal.SIGTERM)
            assert interrupts.pressed
        assert signal.getsignal(signal.SIGTERM) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("link", [False, True])
def test_files_of_others_are_not_replaced(folder, link):
    lab = Path("lab", "scope.csv") if link else Path("buck.csv")
    lab.parent.mkdir(exist_ok=True)
    lab.write_text(LAB)
    if link:
        Path("buck.csv").symlink_to(lab)
    refused = nsspice_run("buck.net", "-q")
    assert refused.exit_code == 2
    assert "NS4018" in refused.output
    assert lab.read_text() == LAB
    assert nsspice_run("buck.net", "-q", "--force").exit_code == 0
    assert lab.read_text().startswith("time,v(a)")
    assert Path("buck.csv").is_symlink() is link
    assert nsspice_run("buck.net", "-q").exit_code == 0  # now it is its own
    lab.write_text("")
    assert nsspice_run("buck.net", "-q").exit_code == 0  # nothing is lost with an empty file


def test_all_own_files_are_known(folder):
    for _ in range(2):
        words = ("buck.net", "-q", "-o", "a.raw", "--plot", "a.png", "--report", "a.html")
        assert nsspice_run(*words).exit_code == 0
    for name in ("a.svg", "a.pdf"):
        assert nsspice_run("buck.net", "-q", "--plot", name).exit_code == 0
        assert written_by_nsspice(Path(name))
    assert not list(Path().glob("*.part"))
    Path("a.html").write_text("<!DOCTYPE html>\n<html><head><title>a lab's page</title>\n")
    Path("a.raw").write_text("Title: x\nDate: now\nPlotname: Transient Analysis\nFlags: real\n")
    Path("a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    for words in (["-o", "a.raw"], ["--plot", "a.png"], ["--report", "a.html"]):
        assert "NS4018" in nsspice_run("buck.net", "-q", *words).output


@pytest.mark.parametrize(
    "text",
    [
        LAB,
        "time,v(out)\n0.000,1.000\n0.001,0.999\n",
        "time;v(a)\n0;1\n",
        "time,v(a)\r\n0,1\r\n",
        "notes of the lab, not a table\n",
        "x,y\n1,2\n",
        "time,v(a)\n0,1,2\n",
        "\xff\xfe",
    ],
)
def test_tables_of_others(tmp_path, text):
    path = tmp_path / "a.csv"
    path.write_bytes(text.encode("latin-1"))
    assert not written_by_nsspice(path)


def test_tables_of_every_analysis_are_own(tmp_path):
    deck = (
        "t\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n.tran 1u 1m\n.dc V1 0 1 0.1\n.op\n"
        ".save v(a,b) i(r1) v(a) v(b)\n"
    )
    for k, solution in enumerate(nsspice.read(deck).run()):
        path = tmp_path / f"{k}.csv"
        solution.to_csv(path)
        assert written_by_nsspice(path), solution.analysis


def test_a_full_disk_keeps_the_older_file(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text("time,v(a)\n0,1\n")
    sink = CsvSink(path)
    sink.open(["time", "v(a)"])
    sink.write(np.zeros((3, 2)))

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("nsspice.output.csv.publish", full)
    with pytest.raises(
        nsspice.NsspiceError, match=r"after 3 rows; they are kept in .*a\.csv\.part"
    ):
        sink.close()
    assert path.read_text() == "time,v(a)\n0,1\n"
    assert Path(f"{path}.part").read_text() == "time,v(a)\n" + "0,0\n" * 3


def test_steps_that_explode_are_refused():
    deck = DECK + "".join(f".param {n}=1\n.step param {n} 1 1000 1\n" for n in "pqr")
    with pytest.raises(nsspice.UsageError) as caught:
        nsspice.read(deck).run()
    assert caught.value.code == "NS4017"
    assert "1000 x 1000 x 1000" in str(caught.value)


def test_includes_that_double_end(tmp_path):
    """2^30 empty files: each of 30 files includes the next one twice."""
    for k in range(30):
        (tmp_path / f"{k}.inc").write_text(f".include {k + 1}.inc\n" * 2)
    (tmp_path / "30.inc").write_text("* nothing\n")
    (tmp_path / "a.net").write_text("t\n.include 0.inc\nV1 a 0 1\nR1 a 0 1\n.op\n")
    begin = time.process_time()
    with pytest.raises(nsspice.NetlistError) as caught:
        parse_file(tmp_path / "a.net")
    assert [d.code for d in caught.value.diagnostics] == ["NS1051"]
    assert "more than 10000 files" in str(caught.value)
    assert time.process_time() - begin < 20.0  # a millisecond a file would be much


def test_a_confined_deck_reads_nothing_from_outside(folder):
    outside = folder / "outside"
    outside.mkdir()
    (outside / "secret.txt").write_text("root:x:0:0\n")
    home = folder / "home"
    (home / "sub").mkdir(parents=True)
    (home / "models.inc").write_text(".model d D(ideal)\n")
    (home / "link.inc").symlink_to(outside / "secret.txt")
    rest = "V1 a 0 1\nR1 a 0 1\n.op\n"
    for card in (".include ../outside/secret.txt", f".lib {outside}/secret.txt", ".inc link.inc"):
        (home / "a.net").write_text(f"t\n{card}\n{rest}")
        with pytest.raises(nsspice.NetlistError) as caught:
            nsspice.read(home / "a.net", confined=True)
        assert [d.code for d in caught.value.diagnostics] == ["NS1054"]
        assert "root:x" not in str(caught.value)
        refused = nsspice_run("home/a.net", "-q", "--confined")
        assert refused.exit_code == 2
        assert "NS1054" in refused.output
        with pytest.raises(nsspice.NetlistError) as caught:  # what it is for
            nsspice.read(home / "a.net")
        assert "root:x" in str(caught.value)
    (home / "a.net").write_text(f"t\n.include sub/../models.inc\n{rest}")
    assert nsspice.read(home / "a.net", confined=True).deck.confined
    with pytest.raises(nsspice.NetlistError, match="NS1054"):
        parse_text(f"t\n.include /etc/hostname\n{rest}", confined=True, directory=home)


def test_nothing_acts_on_a_terminal(folder):
    evil = "x\x1b[2J\x9b31m\u202e"
    Path("evil.net").write_text(f"t {evil}\nV1 {evil} 0 1\nR1 {evil} 0 1\nR2 q 0 1\n.op\n")
    acting = set("\x1b\x9b\u202e\x07")
    command = [sys.executable, "-m", "nsspice"]
    for words in (["run", "evil.net"], ["run", "evil.net", "--json"], ["explain", "evil.net"]):
        done = subprocess.run(
            [*command, *words], capture_output=True, text=True, encoding="utf-8", check=False
        )
        assert not acting & set(done.stdout + done.stderr), words
        shown = (done.stdout + done.stderr).lower()
        assert "\\x1b[2j" in shown or "\\u001b[2j" in shown
    Path("bad.net").write_text(f"t\nV1 a 0 {evil}(\n.op\n")
    done = subprocess.run(
        [*command, "run", "bad.net"], capture_output=True, text=True, encoding="utf-8", check=False
    )
    assert done.returncode == 2
    assert not acting & set(done.stderr)


def test_long_sources_are_read_in_proportion():
    """50 000 points took 7.5 s, most of it in a parser that learns nothing from them."""

    def deck(count, form):
        points = [f"{k * 1e-6:.9g} {k % 7}" for k in range(count)]
        return f"t\nV1 a 0 {form.format(' '.join(points))}\nR1 a 0 1k\n.tran 1m 50m\n"

    begin = time.process_time()
    long = parse_text(deck(50_000, "PWL({})"))
    spent = time.process_time() - begin
    values = np.array(long.elements[0].source.values).reshape(-1, 2)
    assert np.array_equal(values[:, 0], [float(f"{k * 1e-6:.9g}") for k in range(50_000)])
    assert np.array_equal(values[:, 1], np.arange(50_000) % 7)
    assert spent < 3.0  # 0.6 s where it was written
    # what stands beside the points is still read, and points that are no numbers are named
    for form in ("PWL({}) r=0", "PWL ( {} ) AC 1", "DC 2 PWL({})", "PWL {}"):
        found = parse_text(deck(300, form)).elements[0].source
        assert len(found.values) == 600, form
    twice = parse_text(deck(200, "PWL REPEAT FOR 2 ({}) ENDREPEAT")).elements[0].source
    assert len(twice.values) == 800
    with pytest.raises(nsspice.NetlistError) as caught:
        parse_text(deck(300, "PWL({})").replace(" 0.00025 ", " 2*k "))
    (finding,) = caught.value.diagnostics
    assert "2*k" in finding.message
    assert finding.span.text[finding.span.column - 1 :].startswith("2*k ")


def test_permissions_of_a_replaced_file_stay(folder):
    assert nsspice_run("buck.net", "-q").exit_code == 0
    os.chmod("buck.csv", 0o640)
    assert nsspice_run("buck.net", "-q").exit_code == 0
    assert Path("buck.csv").stat().st_mode & 0o777 == 0o640
