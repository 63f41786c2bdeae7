"""Sweeps side by side: the same bits, lost workers, interrupted runs, journals."""

from __future__ import annotations

import itertools
import json
import multiprocessing
import os
import time
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.errors import UsageError
from nsspice.sweeps import executors, worker
from nsspice.sweeps.executors import chunks_of, run_here
from nsspice.sweeps.worker import run_chunk

BUCK = """buck
.param d=0.5 rload=5
Vin in 0 24
Vg g 0 PULSE(0 1 0 0 0 {d*10u} 10u)
S1 in sw g 0 ideal
D1 0 sw
L1 sw out 100u
C1 out 0 10u
Rload out 0 {rload}
.model ideal SW(VT=0.5)
.pss
.measure pss mean AVG v(out)
.measure pss ripple PP v(out)
"""
OVER = {"d": np.linspace(0.3, 0.7, 5), "rload": [2.0, 5.0, 40.0, 120.0]}


def bits(table: nsspice.sweeps.SweepTable) -> list[bytes]:
    return [table[name].tobytes() for name in table.measures]


@pytest.fixture(scope="module")
def alone() -> nsspice.sweeps.SweepTable:
    return nsspice.sweep(BUCK, OVER, workers=1)


def test_the_measures_are_right(alone) -> None:
    # continuous conduction: the mean is the duty times the input
    grid = alone.grid("mean")[:, 0]
    assert grid == pytest.approx(24.0 * OVER["d"], rel=1e-10)


@pytest.mark.parametrize("workers", [2, 4])
def test_processes_give_the_same_bits(alone, workers) -> None:
    assert bits(nsspice.sweep(BUCK, OVER, workers=workers)) == bits(alone)


def test_threads_of_the_caller_give_the_same_bits(alone) -> None:
    with ThreadPoolExecutor(3) as pool:
        assert bits(nsspice.sweep(BUCK, OVER, executor=pool)) == bits(alone)


def test_a_worker_that_knows_nothing_is_sent_the_plan(alone, monkeypatch) -> None:
    monkeypatch.setattr(executors, "learn", lambda plan: plan.key)  # nobody tells this process
    worker._plans.clear()
    worker._ready.clear()
    with ThreadPoolExecutor(2) as pool:
        assert bits(nsspice.sweep(BUCK, OVER, executor=pool)) == bits(alone)


def test_a_killed_process_costs_nothing(alone) -> None:
    killed = []

    def kill(done: float) -> None:
        running = multiprocessing.active_children()
        if running and not killed:
            killed.append(running[0].pid)
            running[0].kill()

    table = nsspice.sweep(BUCK, OVER, workers=2, progress=kill)
    assert killed
    assert bits(table) == bits(alone)
    assert set(table.status) == {"ok"}


class Fatal(Executor):
    """Breaks as a pool of processes does of which a point kills one."""

    made = 0

    def __init__(self) -> None:
        Fatal.made += 1
        self.broken = False

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        rows = args[1]
        self.broken = self.broken or rows[0, 0] == 0.5
        if self.broken:
            future.set_exception(BrokenExecutor("a process ended"))
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def test_a_point_that_kills_its_process_is_named(monkeypatch) -> None:
    monkeypatch.setattr(executors._Processes, "_started", lambda self: Fatal())
    table = nsspice.sweep(BUCK, {"d": [0.4, 0.5, 0.6]}, workers=2)
    assert table.status == ["ok", "NS3090", "ok"]
    assert Fatal.made > 1


def _ends_at_a_half(key, rows, plan=None):
    if rows[0, 0] == 0.5:
        time.sleep(0.2)  # its neighbour is in the pool
        os._exit(1)
    time.sleep(0.1)
    return run_chunk(key, rows, plan)


def test_its_neighbours_in_the_pool_are_not_blamed(monkeypatch) -> None:
    """Processes that end in earnest, whatever else is in their pool at the time."""
    monkeypatch.setattr(executors, "run_chunk", _ends_at_a_half)
    table = nsspice.sweep(BUCK, {"d": [0.5, 0.6, 0.4, 0.3]}, workers=2)
    assert table.status == ["NS3090", "ok", "ok", "ok"]


def test_ctrl_c_keeps_what_is_finished_and_a_journal_goes_on(
    alone, monkeypatch, tmp_path: Path
) -> None:
    journal = tmp_path / "sweep.jsonl"

    def stopped(plan, chunks, workers, executor):
        for k, found in enumerate(run_here(plan, chunks)):
            if k == 5:
                raise KeyboardInterrupt
            yield found

    with monkeypatch.context() as patch:
        patch.setattr("nsspice.sweeps.run.run_chunks", stopped)
        table = nsspice.sweep(BUCK, OVER, workers=1, journal=journal)
    done = sum(c.rows.shape[0] for c in chunks_of(alone.points.values, True)[:5])
    assert table.interrupted
    assert table.status == ["ok"] * done + ["not run"] * (len(table) - done)
    with journal.open("ab") as file:  # a line that was torn by a kill
        file.write(b'{"point": 1')
    again = nsspice.sweep(BUCK, OVER, workers=1, journal=journal, resume=True)
    assert bits(again) == bits(alone)
    lines = [json.loads(line) for line in journal.read_text().splitlines()]
    assert sorted(line["point"] for line in lines[1:]) == list(range(len(alone)))


def test_a_journal_of_another_sweep_is_refused(tmp_path: Path) -> None:
    journal = tmp_path / "sweep.jsonl"
    nsspice.sweep(BUCK, {"d": [0.5]}, journal=journal)
    with pytest.raises(UsageError, match="is there already"):
        nsspice.sweep(BUCK, {"d": [0.5]}, journal=journal)
    with pytest.raises(UsageError, match="another sweep"):
        nsspice.sweep(BUCK, {"d": [0.6]}, journal=journal, resume=True)
    with pytest.raises(UsageError, match="another sweep"):
        nsspice.sweep(BUCK.replace("100u", "99u"), {"d": [0.5]}, journal=journal, resume=True)
    other = tmp_path / "notes.txt"
    other.write_text("mine\n")
    with pytest.raises(UsageError, match="not the journal"):
        nsspice.sweep(BUCK, {"d": [0.5]}, journal=other, resume=True)
    assert other.read_text() == "mine\n"


def test_chunks_do_not_depend_on_workers() -> None:
    for count, continued in itertools.product((1, 63, 64, 65, 1000, 5000), (False, True)):
        rows = np.arange(float(count))[:, None]
        chunks = chunks_of(rows, continued)
        assert np.vstack([c.rows for c in chunks]).tolist() == rows.tolist()
        assert max(c.rows.shape[0] for c in chunks) <= 32


@pytest.mark.parametrize("executor", ["slurm:here", 7])
def test_other_executors_are_refused(executor) -> None:
    with pytest.raises(UsageError, match="executor cannot be"):
        nsspice.sweep(BUCK, {"d": [0.5]}, executor=executor)


def test_no_workers_are_refused() -> None:
    with pytest.raises(UsageError, match="0 workers"):
        nsspice.sweep(BUCK, {"d": [0.5]}, workers=0)
