"""Random decks of all families by all methods, judged by their written rows alone.

    python tools/sweep_oracle.py --first 50000 --count 100 --store sweep.jsonl

One JSON line for each deck; finished decks are kept in the store, so that an interrupted sweep goes
on.  A run is right if its rows obey every equation of the deck (``tests/oracle/rows``).  The table
counts

    certified right / WRONG     refused right / wrong     ended by name     crashed / timed out

and apart runs that are certified, and right in the rows that a user asks for, but not in points of
the engine that it adds to them.  The equations of single rows are judged in both.
The exit code is 1 if a certified run is wrong, or a process crashed.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import signal
import subprocess
import sys
import time
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from oracle.rows.written import Violation

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

#: kinds of results, in the order of the table's columns
KINDS = (
    "certified right", "certified WRONG", "wrong between", "refused right", "refused wrong",
    "by name", "crash", "timeout",
)  # fmt: skip
#: mean difference from another engine below which a run agrees with it
AGREES = 1e-3
#: least time [s] after which a run is taken to hang
HANGS = 1000.0
#: violations that are not worth storing
SMALL = 1e-9


def one(family: str, seed: int, method: str) -> dict[str, object]:
    """Run and judge one deck by one method; return what is stored of it."""
    from oracle.rows.families import FAMILIES
    from oracle.rows.judged_run import judged

    run = judged(FAMILIES[family](seed), method)
    kind = "by name"
    if run.rows:
        right = "right" if run.right else "WRONG" if run.outcome == "certified" else "wrong"
        kind = f"{run.outcome} {right}"
        if kind == "certified right" and not run.right_between:
            kind = "wrong between"
    return {
        "family": family, "seed": seed, "method": method, "kind": kind, "code": run.outcome,
        "message": run.message[:160], "engines": run.engines, "rows": run.rows,
        "seconds": round(run.seconds, 2), "worst": _stored(run.worst),
        "between": _stored(run.between), "stored": run.stored,
    }  # fmt: skip


def _stored(found: list[Violation]) -> list[list[object]]:
    """Return the largest violations, those that are worth it."""
    return [[v.law, v.element, v.time, v.size] for v in found if v.size > SMALL][:5]


def serve(pipe: Connection, limit: float) -> None:
    """Judge what the pipe asks for; a run of more than ``limit`` seconds ends the process."""
    while True:
        family, seed, method = pipe.recv()
        signal.setitimer(signal.ITIMER_VIRTUAL, limit)
        try:
            pipe.send(one(family, seed, method))
        except Exception as error:  # whatever happens in a run is a result of the sweep
            text = f"{type(error).__name__}: {error}"[:200]
            kind = "unread" if type(error).__name__ == "Unreadable" else "crash"
            what = {"family": family, "seed": seed, "method": method}
            pipe.send({**what, "kind": kind, "message": text})


class Worker:
    """A process that judges runs, replaced when a run takes too long or kills it."""

    def __init__(self, limit: float) -> None:
        self.limit = limit
        self._start()

    def _start(self) -> None:
        self.pipe, other = multiprocessing.Pipe()
        self.process = multiprocessing.get_context("fork").Process(
            target=serve, args=(other, self.limit), daemon=True
        )
        self.process.start()
        other.close()

    def ask(self, family: str, seed: int, method: str) -> dict[str, object]:
        """Return what became of a run."""
        self.pipe.send((family, seed, method))
        hangs = False
        try:
            # one that waits takes no time of the processor, nor does it on a busy machine
            if self.pipe.poll(max(HANGS, 50 * self.limit)):
                return self.pipe.recv()
            hangs = True
        except EOFError:
            pass
        self.stop()
        late = hangs or self.process.exitcode == -signal.SIGVTALRM
        self._start()
        kind = "timeout" if late else "crash"
        return {"family": family, "seed": seed, "method": method, "kind": kind}

    def stop(self) -> None:
        """End the process."""
        self.process.join(1.0)
        self.process.kill()
        self.process.join()
        self.pipe.close()


def deck(worker: Worker, family: str, seed: int, methods: list[str]) -> list[dict[str, object]]:
    """Return the results of a deck by all methods, compared with one another."""
    from oracle.rows.judged_run import Judged, distance

    runs = [worker.ask(family, seed, method) for method in methods]
    stored = {str(r["method"]): Judged(str(r["method"]), "", stored=r.pop("stored"))
              for r in runs if r.get("stored")}  # fmt: skip
    for run in runs:
        others = [m for m in ("modewise", "sdirk", "auto") if m in stored and m != run["method"]]
        if run["method"] in stored and others:
            apart = distance(stored[str(run["method"])], stored[others[0]])
            run["apart"], run["from"] = float(f"{apart:.3g}"), others[0]
    return runs


def main() -> int:
    """Judge all decks that the store does not have; return the exit code."""
    from oracle.rows.families import FAMILIES
    from oracle.rows.judged_run import METHODS

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--first", type=int, default=50_000)
    parser.add_argument("--count", type=int, default=20, help="seeds of each family")
    parser.add_argument("--families", nargs="+", default=list(FAMILIES), metavar="NAME")
    parser.add_argument("--methods", nargs="+", default=list(METHODS), metavar="NAME")
    parser.add_argument("--store", type=Path, default=Path("sweep.jsonl"))
    parser.add_argument("--limit", type=float, default=60.0, help="of one run [s of the processor]")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="of the whole sweep")
    parser.add_argument("--report", action="store_true", help="only print the store")
    args = parser.parse_args()
    lines = args.store.read_text().splitlines() if args.store.exists() else []
    done = [json.loads(line) for line in lines]
    known = {(d["family"], d["seed"]) for d in done}
    todo = [(f, s) for s in range(args.first, args.first + args.count) for f in args.families]
    begin, worker = time.monotonic(), Worker(args.limit)
    commit = subprocess.run(
        ["git", "-C", ROOT, "describe", "--always", "--dirty"], capture_output=True, text=True
    ).stdout.strip()
    with args.store.open("a") as store:
        for family, seed in todo:
            if args.report or time.monotonic() - begin > args.seconds:
                break
            if (family, seed) in known:
                continue
            runs = deck(worker, family, seed, args.methods)
            done.append({"family": family, "seed": seed, "commit": commit, "runs": runs})
            store.write(json.dumps(done[-1]) + "\n")
            store.flush()
    worker.process.kill()
    return report([run for d in done for run in d["runs"]])


def report(runs: list[dict[str, Any]]) -> int:
    """Print the table and every run that is not as it should be; return the exit code."""
    counts = Counter((r["family"], r["method"], r["kind"]) for r in runs)
    print(f"{'family':18s}{'method':10s}" + "".join(f"{k:>17s}" for k in KINDS))
    for family, method in dict.fromkeys((r["family"], r["method"]) for r in runs):
        figures = "".join(f"{counts[family, method, k] or '':>17}" for k in KINDS)
        print(f"{family:18s}{method:10s}{figures}")
    for r in runs:
        if r["kind"] not in ("certified right", "by name"):
            apart = r.get("apart", 1.0)
            agrees = "agrees" if apart <= AGREES else f"apart {apart}"
            found = r["between"] if r["kind"] == "wrong between" else r.get("worst", [])
            worst = " ".join(f"{law}:{e}@{time:.9g}={size:.1e}" for law, e, time, size in found[:3])
            who = f"{r['family']} {r['seed']} {r['method']}"
            print(f"{who}: {r['kind']}, {agrees}; {worst}{r.get('message', '')}")
    return int(any(r["kind"] in ("certified WRONG", "crash") for r in runs))


if __name__ == "__main__":
    raise SystemExit(main())
