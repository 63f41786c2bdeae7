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
            "import numpy, processor": lambda: processor_time(
                [sys.executable, "-c", "import numpy"]
            )[0],
            "--version, processor": lambda: processor_time(
                [sys.executable, "-m", "nsspice", "--version"]
            )[0],
            "small deck, wall": lambda: processor_time(run)[1],
        },
        rounds=9,
    )
    report("whole processes", [(name, f"{1e3 * value:.0f} ms") for name, value in cost.items()])
    # ratios to the start of Python itself, which takes some 20 ms
    assert cost["--version, processor"] <= 5 * cost["python -c pass, processor"]
    assert cost["small deck, wall"] <= 12.5 * cost["python -c pass, processor"]
