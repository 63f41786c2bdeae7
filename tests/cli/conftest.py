"""A folder of small decks and a way to call the command line in it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

DECKS = {
    "rc.net": """RC charged through a resistor
V1 in 0 1
R1 in out 1k
C1 out 0 1u IC=0
.tran 0.1m 1m uic
.measure tran vend FIND v(out) AT=1m
.measure tran never WHEN v(out)=7
""",
    "divider.net": """divider with everything
.param r=1k
V1 a 0 2
R1 a b {r}
R2 b 0 1k
.op
.dc V1 0 2 1
.tran 0.1m 0.2m
""",
    "stepped.net": """stepped divider
.param r=1k
V1 a 0 2
R1 a b {r}
R2 b 0 1k
.op
.step param r list 1k 3k
""",
    "rectifier.net": """rectifier
V1 in 0 SIN(0 10 50)
D1 in out
R1 out 0 1k
.tran 0.1m 20m
""",
    "contradiction.net": """a source across a diode from half time on
V1 a 0 PWL(0 -1 1m -1 1m 1)
D1 a 0
C1 a 0 1u
.tran 0.1m 2m
""",
    "wrong.net": """two mistakes
R1 a 0 1k
.trann 1u 1m
D1 a 0 nomodel
""",
    "long.net": """a run of minutes
V1 in 0 SIN(0 10 50)
D1 in out
R1 out 0 1k
C1 out 0 1u
.tran 1u 1000 0 1u
""",
}


@pytest.fixture
def decks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with all decks; it is also the current folder."""
    for name, text in DECKS.items():
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def call(decks: Path) -> Callable[..., Result]:
    """Call the command line inside this process."""
    from nsspice.cli.app import app

    def caller(*args: str, **options: object) -> Result:
        return CliRunner().invoke(app, list(args), **options)  # type: ignore[arg-type]

    return caller


@pytest.fixture
def process(decks: Path) -> Callable[..., subprocess.CompletedProcess[str]]:
    """Call the command line as a process of its own."""

    def caller(*args: str, **options: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "nsspice", *args]
        return subprocess.run(  # type: ignore[call-overload, no-any-return]
            command, capture_output=True, text=True, timeout=60, check=False, **options
        )

    return caller
