"""Starting ngspice: the library in a child process, or the program."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from ...errors import Diagnostic, UsageError
from . import batch
from .child import NO_LIBRARY, NO_PYSPICE
from .raw_run import RawRun

INSTALL = (
    "install the Python side with pip install 'nsspice[ngspice]' and ngspice itself with "
    "apt install ngspice libngspice0 (Debian), dnf install ngspice libngspice (Fedora) or "
    "brew install ngspice libngspice (macOS)"
)


class _Missing(Exception):
    """A way to run ngspice is not installed; the text says what is missing."""


def execute(text: str, runner: str | None, timeout: float) -> RawRun:
    """Run a deck in the first way that is installed, or in the one that is asked for.

    Parameters
    ----------
    text : str
        The deck.
    runner : str or None
        ``library``, ``program`` or None.
    timeout : float
        [s]

    Raises
    ------
    UsageError
        NS4013 if nothing is installed.
    subprocess.TimeoutExpired
        If it takes too long.
    """
    missing = []
    with tempfile.TemporaryDirectory(prefix="nsspice-") as name:
        folder = Path(name)
        if runner in (None, "library"):
            try:
                return _run_library(text, folder, timeout)
            except _Missing as why:
                missing.append(str(why))
        if runner in (None, "program"):
            if batch.is_installed():
                return batch.run_program(text, folder, timeout)
            missing.append("there is no program ngspice")
    raise UsageError(
        Diagnostic("NS4013", f"ngspice cannot be run: {'; '.join(missing)}", hint=INSTALL)
    )


def _run_library(text: str, folder: Path, timeout: float) -> RawRun:
    folder.joinpath("deck.cir").write_text(text, encoding="utf-8")
    child = Path(__file__).with_name("child.py")
    done = subprocess.run(
        [sys.executable, str(child), str(folder)],
        capture_output=True,
        text=True,
        errors="replace",
        timeout=timeout,
        check=False,
        cwd=folder,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )
    if done.returncode == NO_PYSPICE:
        raise _Missing("the package PySpice is not installed")
    if done.returncode == NO_LIBRARY:
        raise _Missing("the ngspice library is not installed")
    result = folder / "result.json"
    if not result.exists() or not result.stat().st_size:
        lines = [*done.stdout.splitlines(), *done.stderr.splitlines()]
        lines.append(f"Error: ngspice ended with code {done.returncode}")
        return RawRun("libngspice", "ngspice", log=lines)
    found = json.loads(result.read_text(encoding="utf-8"))
    data = folder / "data.npy"
    return RawRun(
        runner="libngspice",
        version=found["version"],
        log=found["log"],
        names=found.get("names", []),
        data=np.load(data) if data.exists() else np.zeros((0, 0)),
        seconds=found["seconds"],
        counters=found["counters"],
    )
