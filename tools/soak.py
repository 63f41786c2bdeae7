"""Long runs over fresh random netlists: every feasible step solved, nothing wrong accepted.

    python tools/soak.py --first 20000 --count 625 --workers 2 --store soak.jsonl

Each of the eight hard classes of ``tests/decks/random_circuits.py`` is drawn with the seeds from
FIRST on, 5000 netlists with the default count. Truth is the linear feasibility of each step,
decided by another solver (``tests/property/test_random_networks.py``); every run is then repeated
as a user's and must be certified. Finished seeds are kept in the store, so that an interrupted soak
goes on.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "property")]


def one(kind: str, seed: int) -> dict[str, object]:
    """Check one netlist; return what happened."""
    from decks.random_circuits import generate
    from test_random_networks import check

    import nsspice

    counts: Counter[str] = Counter()
    out: dict[str, object] = {"kind": kind, "seed": seed}
    try:
        random = generate(kind, seed)
        check(random, counts)
        try:
            circuit = nsspice.read(random.text)
            run = nsspice.tran(circuit, 6 * random.step, random.step, step=random.step, uic=True)
            certificate = run.certificate
            out["certified"] = bool(certificate is not None and certificate.passed)
        except nsspice.NsspiceError as error:
            out["refused"] = error.code
    except AssertionError as error:
        out["wrong"] = str(error).splitlines()[0][:200]
    except Exception as error:
        out["crash"] = f"{type(error).__name__}: {error}"[:200]
    return {**out, **counts}


def main() -> int:
    """Run all seeds that the store does not have; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=20_000)
    parser.add_argument("--count", type=int, default=625)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--store", type=Path, default=Path("soak.jsonl"))
    parser.add_argument("--seconds", type=float, default=float("inf"))
    args = parser.parse_args()
    from decks.random_circuits import CLASSES

    done = []
    if args.store.exists():
        done = [json.loads(line) for line in args.store.read_text().splitlines()]
    known = {(d["kind"], d["seed"]) for d in done}
    todo = [(k, s) for s in range(args.first, args.first + args.count) for k in CLASSES]
    todo = [job for job in todo if job not in known]
    begin = time.monotonic()
    with args.store.open("a") as store, ProcessPoolExecutor(args.workers) as pool:
        while todo and time.monotonic() - begin < args.seconds:
            batch, todo = todo[:64], todo[64:]
            for job in as_completed([pool.submit(one, *b) for b in batch]):
                done.append(job.result())
                store.write(json.dumps(done[-1]) + "\n")
                store.flush()
    return report(done)


def report(done: list[dict[str, object]]) -> int:
    """Print the figures; return 1 if anything was wrong."""
    total: Counter[str] = Counter()
    for item in done:
        total["netlists"] += 1
        for key in ("solved", "infeasible", "undecided"):
            total[key] += int(item.get(key, 0))  # type: ignore[call-overload]
        total["runs certified"] += item.get("certified") is True
        total["runs that fail the certificate"] += item.get("certified") is False
        total["runs refused by name"] += "refused" in item
        total["wrong"] += "wrong" in item
        total["crashes"] += "crash" in item
    for key, value in total.items():
        print(f"{key:32s} {value}")
    for item in done:
        if "wrong" in item or "crash" in item or item.get("certified") is False:
            print(item)
    return int(bool(total["wrong"] or total["crashes"]))


if __name__ == "__main__":
    raise SystemExit(main())
