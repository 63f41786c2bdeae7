"""Where chunks of points run: this process, processes on all cores, or somebody's cluster."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from dataclasses import dataclass
from multiprocessing.context import BaseContext
from typing import Any

from ..errors import Diagnostic, UsageError
from ..lazy import need_library
from .plan import Plan
from .points import Floats
from .worker import Outcome, UnknownPlan, learn, run_chunk

#: chunks of a sweep, about: enough for any number of workers to end together
_CHUNKS = 64
#: points of a chunk whose steady states are continued from each other, if that makes so many chunks
_CONTINUED = 8
#: points of one chunk at most: what is lost with a worker, and what Ctrl-C waits for
_LARGEST = 32
#: a process that ends twice over a chunk that runs alone is not an accident
_ATTEMPTS = 2
#: what is left to do is worth processes beyond this [s]: to start one takes some tenths
_WORTH = 1.0


@dataclass(frozen=True, slots=True)
class Chunk:
    """Some neighbouring points.

    Parameters
    ----------
    first : int
        Number of its first point.
    rows : ndarray, shape (k, n)
    """

    first: int
    rows: Floats


#: what a chunk has given, or the reason why nobody could run it
Finished = tuple[Chunk, "list[Outcome] | str"]


def chunks_of(rows: Floats, continued: bool = False) -> list[Chunk]:
    """Return the points in chunks, whose sizes depend on the number of points alone.

    Were its size that of the workers' share, results would depend on their number, since a chunk
    continues from point to point where there are steady states (``continued``).
    """
    count = int(rows.shape[0])
    least = min(_CONTINUED, max(1, count // _CONTINUED)) if continued else 1
    size = min(max(least, -(-count // _CHUNKS)), _LARGEST)
    return [Chunk(k, rows[k : k + size]) for k in range(0, count, size)]


def run_here(plan: Plan, chunks: Sequence[Chunk]) -> Iterator[Finished]:
    """Run chunks in this process."""
    key = learn(plan)
    for chunk in chunks:
        yield chunk, run_chunk(key, chunk.rows)


def run_chunks(
    plan: Plan,
    chunks: Sequence[Chunk],
    workers: int | None,
    executor: Executor | str | Any | None,
) -> Iterator[Finished]:
    """Run chunks side by side; they come as they are finished.

    Parameters
    ----------
    plan : Plan
    chunks : sequence of Chunk
    workers : int or None
        Processes; None takes all cores where that pays.
    executor : Executor, str, Client or None
        Any ``concurrent.futures.Executor``; a ``dask.distributed.Client``, or ``"dask:ADDRESS"`` of
        its scheduler.

    Raises
    ------
    UsageError
        NS4005 for another executor, NS4010 without the package ``distributed``.
    """
    if executor is not None:
        with _Borrowed.of(executor) as borrowed:
            yield from _side_by_side(plan, chunks, borrowed)
        return
    chunks = list(chunks)
    count = min(_cores() if workers is None else workers, len(chunks))
    if workers is None:
        # the first chunks show what the others cost
        while chunks and count > 1:
            begin = time.perf_counter()
            yield from run_here(plan, [chunks.pop(0)])
            if (time.perf_counter() - begin) * len(chunks) > _WORTH:
                break
    if count <= 1 or len(chunks) <= 1:
        yield from run_here(plan, chunks)
        return
    with _Processes(plan, count) as own:
        yield from _side_by_side(plan, chunks, own)


def _cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


class _Borrowed:
    """An executor that belongs to the caller, who says how many workers it has."""

    def __init__(self, executor: Executor, client: Any = None) -> None:
        self.executor, self._client = executor, client
        #: chunks that wait inside it: more would only make Ctrl-C slow
        self.depth = 64

    @classmethod
    def of(cls, given: Any) -> _Borrowed:
        if isinstance(given, Executor):
            return cls(given)
        if isinstance(given, str) and given.partition(":")[0] == "dask":
            client = _dask(given.partition(":")[2])
            return cls(client.get_executor(), client)
        if hasattr(given, "get_executor"):  # dask.distributed.Client
            return cls(given.get_executor())
        message = f"executor cannot be {given!r}"
        hint = "give a concurrent.futures.Executor, a dask Client or dask:ADDRESS"
        raise UsageError(Diagnostic("NS4005", message, hint=hint))

    def __enter__(self) -> _Borrowed:
        return self

    def __exit__(self, *_: object) -> None:
        if self._client is not None:
            self._client.close()

    def renew(self) -> bool:
        """Return False: what is broken belongs to somebody else."""
        return False


def _dask(address: str) -> Any:
    client = need_library("distributed").Client
    return client(address) if address else client()


class _Processes:
    """Processes of this machine, restarted when one of them has died."""

    def __init__(self, plan: Plan, count: int) -> None:
        self._plan, self._count = plan, count
        self.depth = 2 * count
        self.executor = self._started()

    def _started(self) -> Executor:
        return ProcessPoolExecutor(self._count, _context(), _begin, (self._plan,))

    def renew(self) -> bool:
        """Start processes in place of a broken pool; return True."""
        self.executor.shutdown(wait=False, cancel_futures=True)
        self.executor = self._started()
        return True

    def __enter__(self) -> _Processes:
        return self

    def __exit__(self, *_: object) -> None:
        self.executor.shutdown(wait=True, cancel_futures=True)


def _context() -> BaseContext:
    """Return how processes begin.

    A forked one is there at once, with all modules loaded; but only a process without other threads
    may be forked, or a lock that one of them holds stays locked for ever.
    """
    if sys.platform == "linux" and threading.active_count() == 1:
        return multiprocessing.get_context("fork")
    return multiprocessing.get_context("spawn")


def _begin(plan: Plan) -> None:
    """Prepare a process: it knows the plan, and leaves Ctrl-C to the one that collects results."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    learn(plan)


@dataclass(slots=True)
class _Tries:
    """How often a chunk has ended a process by itself, and whether its worker needs the plan."""

    chunk: Chunk
    count: int = 0
    with_plan: bool = False
    alone: bool = False


def _side_by_side(
    plan: Plan, chunks: Sequence[Chunk], home: _Borrowed | _Processes
) -> Iterator[Finished]:
    """Keep workers busy; send chunks again whose worker did not know the plan, or has died.

    A process that ends takes all chunks with it that its pool has.  These are then run one by one,
    so that none is blamed but that which ends a process by itself.
    """
    key = learn(plan)
    waiting = [_Tries(chunk) for chunk in reversed(chunks)]
    suspects: list[_Tries] = []
    running: dict[Future[list[Outcome]], _Tries] = {}

    def submit(queue: list[_Tries], alone: bool) -> None:
        tries = queue[-1]
        tries.alone = alone
        sent = plan if tries.with_plan else None
        running[home.executor.submit(run_chunk, key, tries.chunk.rows, sent)] = tries
        queue.pop()

    while waiting or running or suspects:
        broken = False
        try:
            if suspects and not running:
                submit(suspects, alone=True)
            while waiting and not suspects and len(running) < home.depth:
                if any(tries.alone for tries in running.values()):
                    break
                submit(waiting, alone=False)
            done, _ = wait(running, return_when=FIRST_COMPLETED)
        except BrokenExecutor:
            done, broken = set(running), True
        for future in done:
            tries = running.pop(future)
            try:
                yield tries.chunk, future.result()
                continue
            except UnknownPlan:
                tries.with_plan = True
            except BrokenExecutor as error:
                broken, tries.count = True, tries.count + tries.alone
                if tries.count >= _ATTEMPTS or not isinstance(home, _Processes):
                    yield tries.chunk, f"the process that ran this point ended: {error}"
                else:
                    suspects.append(tries)
                continue
            except Exception as error:  # of somebody's cluster: a lost worker, a lost connection
                tries.count += 1
                tries.with_plan = True
                if tries.count >= _ATTEMPTS:
                    yield tries.chunk, f"{type(error).__name__}: {error}"
                    continue
            waiting.append(tries)
        if broken and home.renew():
            suspects += running.values()
            running.clear()
