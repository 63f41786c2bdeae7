"""Conveniences of a terminal: completion, watching a deck, pytest's options."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from pathlib import Path

EXPECT = """source = "closed form"
[[check]]
signal = "v(b)"
analysis = "op"
value = {value}
tolerance = 1e-12
why = "a voltage divider"
"""


def test_completion_knows_commands_and_options(call):
    script = call("completion", "bash").stdout
    assert "_NSSPICE_COMPLETE" in script
    environment = {**os.environ, "_NSSPICE_COMPLETE": "bash_complete", "COMP_CWORD": "2"}
    for words, word, expected in (
        ("nsspice run --al", "2", "--all-points"),
        ("nsspice exa", "1", "examples"),
    ):
        environment |= {"COMP_WORDS": words, "COMP_CWORD": word}
        done = subprocess.run(
            [sys.executable, "-c", "from nsspice.cli import program; program()"],
            env=environment, capture_output=True, text=True, timeout=60, check=False,
        )  # fmt: skip
        assert expected in done.stdout


def test_completion_is_installed_where_the_shell_looks(call, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert call("completion", "fish", "--install").exit_code == 0
    assert "nsspice" in (tmp_path / "fish" / "completions" / "nsspice.fish").read_text()
    monkeypatch.setenv("SHELL", "/bin/tcsh")
    assert call("completion").exit_code == 2


def test_checks_by_pytest(call, decks):
    Path("divider.expect.toml").write_text(EXPECT.format(value=1.0))
    Path("rc.expect.toml").write_text(EXPECT.format(value=1.0))
    Path("rectifier.expect.toml").write_text('source = "x"\n[[check]]\nsignal = "v(out)"\n'
        'statistic = "max"\nvalue = 3\ntolerance = 1e-9\nwhy = "wrong"\n')  # fmt: skip
    chosen = ["-k", "divider or rectifier", "-n", "2", "--junit-xml", "x.xml"]
    done = subprocess.run([sys.executable, "-m", "nsspice", "test", ".", *chosen], check=False,
        capture_output=True, text=True, timeout=120)  # fmt: skip
    assert done.returncode == 1, done.stdout + done.stderr
    assert "1 failed, 1 passed" in done.stdout
    assert "v(out)" in done.stdout  # what failed, with its numbers
    cases = {case.get("name") for case in ET.parse("x.xml").iter("testcase")}
    assert cases == {"divider", "rectifier"}


def test_a_saved_deck_is_run_again(decks):
    process = subprocess.Popen(
        [sys.executable, "-m", "nsspice", "run", "rc.net", "--watch"],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stderr is not None
        _until(process.stderr, "watching")
        text = Path("rc.net").read_text()
        Path("rc.net").write_text("one mistake\nR1 a 0 oops\n")
        _until(process.stderr, "watching")  # the error was told, and it goes on
        Path("rc.net").write_text(text.replace("1m uic", "2m uic"))
        assert "0 s to 2 ms" in _until(process.stderr, "watching")
    finally:
        if sys.platform == "win32":  # no such signal there
            process.kill()
        else:
            process.send_signal(signal.SIGINT)
        process.communicate(timeout=20)
        code = process.returncode
    assert code == 0 or sys.platform == "win32"


def _until(stream, word: str) -> str:
    """Return the lines up to one with a word."""
    end, lines = time.monotonic() + 60, []
    while time.monotonic() < end:
        lines.append(stream.readline())
        if word in lines[-1]:
            return "".join(lines)
    raise AssertionError("".join(lines))
