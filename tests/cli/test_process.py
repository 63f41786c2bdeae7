"""The command line as a process: start-up, Ctrl-C, closed pipes, full disks."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import nsspice


@contextmanager
def started(command: list[str], **streams: Any) -> Iterator[subprocess.Popen[Any]]:
    """Start a process that does not outlive the test, should that fail halfway."""
    with subprocess.Popen(command, **streams) as running:
        try:
            yield running
        finally:
            running.kill()


def test_version(process):
    result = process("--version")
    assert result.returncode == 0
    assert result.stdout == f"nsspice {nsspice.__version__}\n"


def test_the_version_is_that_of_the_crate():
    crate = Path(nsspice.__file__).with_name("core") / "Cargo.toml"
    assert f'\nversion = "{nsspice.__version__}"\n' in crate.read_text()


def test_a_small_run_does_not_import_slow_libraries(decks):
    code = (
        "import sys\nfrom nsspice.cli import main\n"
        "sys.argv = ['nsspice', 'run', 'rc.net', '-q']\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code\n"
        "print([m for m in ('scipy', 'matplotlib', 'rich', 'pandas') if m in sys.modules])"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert result.stdout.strip() == "[]"


def test_importing_the_package_imports_nothing_else():
    code = "import sys, nsspice; print('numpy' in sys.modules, len(dir(nsspice)) > 10)"
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "False True"


def test_version_costs_little():
    """A tenth of a second of processor time, with room for a loaded machine."""
    command = [sys.executable, "-m", "nsspice", "--version"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    for _ in range(5):
        subprocess.run(command, check=True, capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    assert used / 5 < 0.1


def test_ctrl_c_keeps_the_rows(decks):
    command = [sys.executable, "-m", "nsspice", "run", "long.net"]
    with started(command, stderr=subprocess.PIPE, text=True) as running:
        deadline = time.monotonic() + 30.0
        while not (
            Path("long.csv.part").exists() and Path("long.csv.part").stat().st_size > 100_000
        ):
            assert running.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.02)
        running.send_signal(signal.SIGINT)
        begin = time.monotonic()
        _, messages = running.communicate(timeout=20)
        spent = time.monotonic() - begin
    assert running.returncode == 130
    assert "INTERRUPTED" in messages
    assert "Traceback" not in messages
    assert spent < 2.0  # answered within 0.2 s; writing the summary and a loaded machine on top
    lines = Path("long.csv").read_text().splitlines()
    assert len({line.count(",") for line in lines}) == 1
    assert float(lines[-1].split(",")[0]) == pytest.approx((len(lines) - 2) * 1e-6)


def test_a_killed_run_leaves_complete_rows(decks):
    command = [sys.executable, "-m", "nsspice", "run", "long.net", "-q"]
    with started(command, stderr=subprocess.DEVNULL) as running:
        deadline = time.monotonic() + 30.0
        while not (
            Path("long.csv.part").exists() and Path("long.csv.part").stat().st_size > 100_000
        ):
            assert time.monotonic() < deadline
            time.sleep(0.02)
        running.kill()
    text = Path("long.csv.part").read_text()
    assert len({line.count(",") for line in text.splitlines()[:-1]}) == 1


def test_a_closed_pipe_ends_quietly(decks):
    command = [sys.executable, "-m", "nsspice", "run", "long.net", "-o", "-", "-q"]
    with started(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout is not None
        assert running.stdout.readline().startswith(b"time,")
        running.stdout.close()
        assert running.stderr is not None
        messages = running.stderr.read().decode()
        assert running.wait(20) == 141  # as a shell shows it of programs that SIGPIPE ends
    assert messages == ""


def test_a_full_disk_is_told(decks):
    """Linux has a device that is always full; tests/unit/output simulates one for other systems."""
    target = "/dev/full" if os.path.exists("/dev/full") else os.devnull
    with open(target, "wb") as full:
        done = subprocess.run(
            [sys.executable, "-m", "nsspice", "run", "rc.net", "-o", "-", "-q"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
            timeout=60,
        )
    assert "Traceback" not in done.stderr
    assert ("No space left" in done.stderr) == (target == "/dev/full")
    assert done.returncode == (2 if target == "/dev/full" else 0)


def test_more_rows_than_the_disk_takes_are_refused_before_the_run(decks):
    """A picosecond between rows for a kilosecond: 1e15 of them."""
    Path("many.net").write_text("many rows\nV1 a 0 1\nR1 a 0 1k\n.tran 1p 1000\n")
    done = subprocess.run(
        [sys.executable, "-m", "nsspice", "run", "many.net"],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == 2
    assert "NS4001" in done.stderr
    assert "1e+15 rows" in done.stderr
    assert not Path("many.csv").exists()


def test_memory_stays_bounded_in_the_number_of_rows(decks):
    """Ten times the rows, the same memory: rows go to the file as they come."""
    sizes = []
    for rows in (100_000, 1_000_000):
        deck = Path("rc.net").read_text().splitlines()
        deck[4] = f".tran 1u {rows}u uic"
        Path("rows.net").write_text("\n".join(deck[:5]) + "\n")
        code = (
            "import resource, sys\nfrom nsspice.cli import main\n"
            "sys.argv = ['nsspice', 'run', 'rows.net', '-q']\n"
            "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code\n"
            "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
        )
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
        )
        sizes.append(int(done.stdout))
    assert sizes[1] < 1.5 * sizes[0]


def test_a_small_run_with_jumps_and_measures_loads_nothing_large(process):
    Path("half_wave.net").write_text(
        "half-wave\nV1 in 0 SIN(0 10 50)\nD1 in out\nL1 out r 20m IC=0\nR1 r 0 10\n"
        ".tran 20u 20m uic\n.measure tran top MAX v(in,out)\n"
    )
    environment = {**os.environ, "PYTHONPROFILEIMPORTTIME": "1"}
    done = process("run", "half_wave.net", "-q", env=environment)
    assert done.returncode == 0
    loaded = {line.rpartition("|")[2].strip() for line in done.stderr.splitlines()}
    assert "numpy" in loaded
    assert not loaded & {"numpy.ma", "scipy", "matplotlib", "rich"}
