"""Runs one deck with the program ``ngspice -b`` and reads its raw file with spicelib."""

from __future__ import annotations

import re
import shutil
import subprocess
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from .raw_run import RawRun


def is_installed() -> bool:
    """Return whether the program and the reader of its files are there."""
    return shutil.which("ngspice") is not None and find_spec("spicelib") is not None


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
    from spicelib import RawRead

    try:
        raw = RawRead(str(path), dialect="ngspice", verbose=False)
        names = [str(name) for name in raw.get_trace_names()]
        return names, np.array([np.real(raw.get_trace(n).get_wave()) for n in names])
    except Exception:  # an interrupted run leaves a file that no reader takes
        return [], np.zeros((0, 0))
