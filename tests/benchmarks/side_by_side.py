"""Honest timing: programs in turn within one run, medians, ratios; the machine is named."""

from __future__ import annotations

import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import nsspice

# bytecode of the programs measured: an installed package has it, whatever the environment says
BYTECODE = tempfile.TemporaryDirectory()


def alternate(tasks: dict[str, Callable[[], float]], rounds: int) -> dict[str, float]:
    """Run the tasks in turn, after one round that is not counted; return the median of each."""
    seconds: dict[str, list[float]] = {name: [] for name in tasks}
    for counted in range(rounds + 1):
        for name, task in tasks.items():
            value = task()
            if counted:
                seconds[name].append(value)
    return {name: statistics.median(values) for name, values in seconds.items()}


class Stopwatch:
    """A sink that forgets the rows (what streaming costs without a disk) and times them."""

    def __init__(self) -> None:
        self.first: float | None = None
        self.rows = 0

    def open(self, columns: list[str]) -> None:
        self.columns = columns

    def write(self, rows: np.ndarray) -> None:
        if self.first is None:
            self.first = time.perf_counter()
        else:
            self.rows += len(rows)

    def close(self) -> None:
        pass


def nsspice_step(deck: Callable[[float], str], stop: float, theta: float = 1.0) -> float:
    """Seconds per step of a transient, all signals recorded, inside the process.

    The clock runs from the first block of rows to the end of the run, certificate included, so that
    reading and assembling the deck do not count.
    """
    circuit, sink = nsspice.read(deck(stop)), Stopwatch()
    solution = nsspice.tran(circuit, theta=theta, sink=sink, keep=False)
    end = time.perf_counter()
    steps = max(run.stats["steps"] for run in solution.islands)
    assert sink.first is not None
    assert steps >= sink.rows  # a row per step, so that rows count steps
    return (end - sink.first) / sink.rows


def ngspice_point(text: str, options: str = "") -> float:
    """Seconds per accepted point of ngspice's transient analysis, by its own account."""
    seconds, points = ngspice_transient(text, options)
    return seconds / points


def ngspice_transient(text: str, options: str = "") -> tuple[float, int]:
    """Seconds and accepted points of ngspice's transient analysis, by its own account."""
    card = next(line for line in text.splitlines() if line.startswith(".tran"))
    body = text.replace(card + "\n", "").replace(".end\n", "")
    script = f"{options}\n.control\n{card[1:]}\nrusage all\nquit\n.endc\n.end\n"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "deck.cir"
        path.write_text(body + script)
        out = subprocess.run(
            ["ngspice", "-b", str(path)], capture_output=True, text=True, timeout=600, check=False
        ).stdout
    seconds = re.search(r"Transient analysis time = (\S+)", out)
    points = re.search(r"Accepted timepoints = (\d+)", out)
    if seconds is None or points is None:
        raise RuntimeError(f"ngspice did not finish:\n{out[-2000:]}")
    return float(seconds[1]), int(points[1])


def processor_time(command: list[str]) -> tuple[float, float]:
    """Processor and wall seconds of one process."""
    import resource

    env = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    env["PYTHONPYCACHEPREFIX"] = BYTECODE.name
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(command, cwd=folder, env=env, capture_output=True, check=True)
    wall = time.perf_counter() - begin
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return cpu, wall


def report(title: str, rows: list[tuple[str, str]]) -> None:
    """Print figures with the machine that made them."""
    machine = platform.processor() or platform.machine()
    print(f"\n{title}  [{machine}, Python {sys.version.split()[0]}]")
    width = max(len(name) for name, _ in rows)
    for name, value in rows:
        print(f"  {name:<{width}}  {value}")
