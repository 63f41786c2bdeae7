"""Sweeps on a local Dask cluster: the same bits, a lost worker, decks whose files are elsewhere."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.analyses.request.targets import target_of
from nsspice.sweeps.executors import chunks_of, run_chunks
from nsspice.sweeps.plan import Options, Plan

distributed = pytest.importorskip("distributed")

DECK = """RC with a model from a file
.param r=1k
.include "part.lib"
V1 a 0 SIN(0 5 1k)
D1 a b part
R1 b 0 {r}
C1 b 0 1u
.tran 10u 2m
.measure tran top MAX v(b)
"""


@pytest.fixture(scope="module")
def client():
    with (
        distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            processes=True,
            dashboard_address=None,
            silence_logs=50,  # a killed worker is what is tested
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def deck_in(folder: Path) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "part.lib").write_text(".model part D(Vfwd=0.7 Ron=10m)\n")
    (folder / "a.net").write_text(DECK)
    return folder / "a.net"


@pytest.mark.filterwarnings("ignore")  # of the cluster about its ports and clocks
def test_a_killed_worker_loses_nothing(client, tmp_path: Path) -> None:
    over = {"r": np.geomspace(100.0, 10e3, 24)}
    deck = deck_in(tmp_path / "here")
    alone = nsspice.sweep(deck, over, workers=1)
    circuit = nsspice.read(deck)
    seen: list[float] = []

    def kill(done: float) -> None:
        if len(seen) == 3:
            client.cluster.workers[0].process.process._process.kill()
        seen.append(done)

    table = nsspice.sweep(circuit, over, executor=client, progress=kill)
    assert table["top"].tobytes() == alone["top"].tobytes()
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    assert set(table.status) == {"ok"}


@pytest.mark.filterwarnings("ignore")
def test_workers_need_no_files_of_their_own(client, tmp_path: Path) -> None:
    deck = deck_in(tmp_path / "there")
    circuit = nsspice.read(deck)
    alone = nsspice.sweep(circuit, {"r": [500.0]}, workers=1)
    plan = Plan.of(circuit.deck, [target_of(circuit, "r")], (), Options())
    shutil.rmtree(deck.parent)
    ((_, found),) = run_chunks(
        plan, chunks_of(np.array([[500.0]])), None, f"dask:{client.scheduler.address}"
    )
    assert found[0].values == {"top": alone["top"][0]}
