"""Runs one deck with the program ``ngspice -b`` and reads its raw file."""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np

from ...output.raw import read_raw
from .raw_run import RawRun


def is_installed() -> bool:
    """Return whether the program is there."""
    return shutil.which("ngspice") is not None


def run_program(text: str, folder: Path, timeout: float) -> RawRun:
    """Run a deck.

    Parameters
    ----------
    text : str
    folder : Path
        For the files of the run.
    timeout : float
        [s]

    Raises
    ------
    subprocess.TimeoutExpired
    """
    deck, raw = folder / "deck.cir", folder / "data.raw"
    deck.write_text(text.replace("\n.end\n", "\n.options acct\n.end\n"), encoding="utf-8")
    begin = time.perf_counter()
    done = subprocess.run(
        ["ngspice", "-b", "-r", str(raw), str(deck)],
        capture_output=True,
        text=True,
        errors="replace",
        timeout=timeout,
        check=False,
        cwd=folder,
    )
    wall = time.perf_counter() - begin
    out = f"{done.stdout}\n{done.stderr}"
    counters = {
        key.strip(): float(value)
        for key, value in re.findall(r"^([A-Z][^=\n]*?) = ([-+.\deE]+)\.?\s*$", out, re.M)
    }
    names, data = _read(raw) if raw.exists() else ([], np.zeros((0, 0)))
    version = re.search(r"ngspice-\d+(\.\d+)?", out)
    return RawRun(
        runner="ngspice -b",
        version=(version[0] if version else "ngspice").replace("-", " "),
        log=out.splitlines(),
        names=names,
        data=data,
        seconds=counters.get("Total analysis time (seconds)", wall),
        counters=counters,
    )


def _read(path: Path) -> tuple[list[str], Any]:
    try:
        return read_raw(path)
    except (ValueError, IndexError, StopIteration):  # what an interrupted run may leave
        return [], np.zeros((0, 0))
