"""Is a commit slower than another one?  Both are built and timed in turn: `make bench-compare`.

usage: python tools/compare_commits.py [--base REV] [--rounds N] [--bound RATIO]

The netlists of `DECKS` are run by both builds, A B A B ..., in processes of their own; the ratio of
each pair counts, so that a machine whose speed drifts does not matter.  Exits with 1 if the median
ratio of a deck is above the bound.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

#: netlists of both commits, each for another hot path
DECKS = {
    "exact engine, converter": "converters/buck.net",
    "exact engine, many modes": "rectifiers/cockcroft_walton_4.net",
    "exact engine, one call": "rectifiers/half_wave_inductive.net",
    "steps with error control, junctions": "smooth/multiplier.net",
    "steps with error control, transistors": "bipolar/schmitt_trigger.net",
    "points without storage": "smooth/half_wave.net",
}

#: prints the least time of some runs of each deck, in seconds
_TIMER = """
import json, sys, time, warnings
import nsspice
found = {}
for name, path in json.loads(sys.argv[1]).items():
    circuit = nsspice.read(path)
    times = []
    begin = time.perf_counter()
    while len(times) < 3 or time.perf_counter() - begin < 0.5:
        start = time.perf_counter()
        circuit.run()
        times.append(time.perf_counter() - start)
    found[name] = min(times)
print(json.dumps(found))
"""


def build(tree: Path) -> Path:
    """Install a tree into an environment of its own; return its Python."""
    python = tree / ".compare" / "bin" / "python"
    subprocess.run([sys.executable, "-m", "venv", tree / ".compare"], check=True)
    subprocess.run([python, "-m", "pip", "install", "--quiet", tree], check=True)
    return python


def measure(python: Path, tree: Path) -> dict[str, float]:
    """Return the least time of each deck by one build [s]."""
    decks = {name: str(tree / "netlists" / deck) for name, deck in DECKS.items()}
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    out = subprocess.run(
        [python, "-c", _TIMER, json.dumps(decks)],
        check=True, capture_output=True, text=True, cwd=tempfile.gettempdir(), env=environment,
    ).stdout  # fmt: skip
    found: dict[str, float] = json.loads(out)
    return found


def compared(base: list[dict[str, float]], head: list[dict[str, float]]) -> dict[str, float]:
    """Return for each deck the median of the ratios head to base, pair by pair.

    Examples
    --------
    >>> compared([{"a": 1.0}, {"a": 2.0}, {"a": 1.0}], [{"a": 1.1}, {"a": 2.2}, {"a": 5.0}])
    {'a': 1.1}
    """
    pairs = list(zip(base, head, strict=True))
    return {
        name: round(statistics.median(h[name] / b[name] for b, h in pairs), 3) for name in base[0]
    }


def main() -> int:
    """Build both, time them in turn, print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--base", default="HEAD~1", help="commit to compare with")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--bound", type=float, default=1.2, help="largest ratio that is accepted")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "base"
        git = ["git", "-C", str(ROOT)]
        subprocess.run([*git, "worktree", "add", "--detach", tree, options.base], check=True)
        try:
            builds = {tree: build(tree), ROOT: build(ROOT)}
            times: dict[Path, list[dict[str, float]]] = {tree: [], ROOT: []}
            for _ in range(options.rounds):
                for place, python in builds.items():
                    times[place].append(measure(python, place))
        finally:
            subprocess.run([*git, "worktree", "remove", "--force", tree], check=True)
    ratios = compared(times[tree], times[ROOT])
    for name, ratio in ratios.items():
        mark = "SLOWER" if ratio > options.bound else ""
        print(f"{ratio:6.3f}  {name}  {mark}")
    return 1 if max(ratios.values()) > options.bound else 0


if __name__ == "__main__":
    sys.exit(main())
