"""Cost against size: legs, strings, ladders and phases beside ngspice, as a table and a picture.

``python tests/benchmarks/bench_cells.py [picture.svg]``
"""

from __future__ import annotations

import math
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from benchmarks.side_by_side import ngspice_transient  # noqa: E402
from decks import cells  # noqa: E402

import nsspice  # noqa: E402

#: decks by size, and the sizes
FAMILIES: dict[str, tuple[Callable[..., str], tuple[int, ...]]] = {
    "multilevel leg, cells an arm": (cells.leg, (8, 16, 48, 100)),
    "string, panels": (cells.string, (20, 60)),
    "ladder with clamps, sections": (cells.ladder, (20, 50)),
    "interleaved buck, phases": (cells.phases, (8, 32)),
}
ROUNDS = 5


def exact(deck: str) -> tuple[float, bool, float]:
    """Processor time of a run [s], whether its certificate holds, and modes in closed form."""
    circuit = nsspice.read(deck)
    begin = time.process_time()
    run = nsspice.tran(circuit, method="modewise", on_failure="ignore")
    spent = time.process_time() - begin
    passed = run.certificate is not None and run.certificate.passed
    return spent, passed, run.stats["reduced"]


def other(deck: str) -> float:
    """Seconds of ngspice's transient analysis, NaN where it does not finish."""
    try:
        return ngspice_transient(deck)[0]
    except (RuntimeError, subprocess.TimeoutExpired):
        return math.nan


def main(picture: str | None) -> None:
    """Run the decks in turn and print the table; draw the picture if it has a name."""
    print("| deck | size | nsspice, s | growth | certificate | closed forms | ngspice, s |")
    print("|---|---|---|---|---|---|---|")
    curves = {}
    for name, (deck, sizes) in FAMILIES.items():
        curve: list[tuple[int, float, float]] = []
        for size in sizes:
            runs = [exact(deck(size)) for _ in range(ROUNDS)]
            seconds = sorted(run[0] for run in runs)[ROUNDS // 2]
            theirs = other(deck(size, sharp=True))
            growth = ""
            if curve:
                before = curve[-1]
                growth = f"n^{math.log(seconds / before[1]) / math.log(size / before[0]):.2f}"
            held = "holds" if all(run[1] for run in runs) else "fails"
            print(
                f"| {name} | {size} | {seconds:.3f} | {growth} | {held} | {runs[0][2]:.0f} "
                f"| {theirs:.2f} |",
                flush=True,
            )
            curve.append((size, seconds, theirs))
        curves[name] = curve
    if picture:
        draw(curves, picture)


def draw(curves: dict[str, list[tuple[int, float, float]]], picture: str) -> None:
    """Draw seconds against size, ngspice dashed."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(7, 4.5))
    for name, curve in curves.items():
        sizes, ours, theirs = zip(*curve, strict=True)
        (line,) = axes.loglog(sizes, ours, "o-", label=name)
        axes.loglog(sizes, theirs, "o--", color=line.get_color(), alpha=0.5)
    axes.set(xlabel="size", ylabel="processor time [s]", title="solid: nsspice, dashed: ngspice")
    axes.legend()
    axes.grid(True, which="both", alpha=0.3)
    figure.savefig(picture)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
