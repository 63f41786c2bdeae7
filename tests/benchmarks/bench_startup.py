"""What a user waits for: whole processes."""

from __future__ import annotations

import sys
from pathlib import Path

from side_by_side import alternate, processor_time, report

DECK = Path(__file__).parents[2] / "netlists" / "rectifiers" / "half_wave.net"


def test_small_deck_and_version() -> None:
    run = [sys.executable, "-m", "nsspice", "run", str(DECK), "--quiet"]
    cost = alternate(
        {
            "python -c pass, processor": lambda: processor_time([sys.executable, "-c", "pass"])[0],
            "import numpy, wall": lambda: processor_time([sys.executable, "-c", "import numpy"])[1],
            "--version, processor": lambda: processor_time(
                [sys.executable, "-m", "nsspice", "--version"]
            )[0],
            "small deck, wall": lambda: processor_time(run)[1],
        },
        rounds=9,
    )
    report("whole processes", [(name, f"{1e3 * value:.0f} ms") for name, value in cost.items()])
    # the aims are 0.1 s of processor time and 0.25 s, on a machine where Python starts in 20 ms and
    # imports numpy, without which nothing can be simulated, in 0.1 s
    assert cost["--version, processor"] <= 5 * cost["python -c pass, processor"]
    assert cost["small deck, wall"] <= 2.5 * cost["import numpy, wall"]
