"""How fast netlists are read, and that the time grows with their length and not faster."""

from __future__ import annotations

import random
import time

import pytest

from nsspice.netlist import parse_text


def large_deck(lines: int) -> str:
    """Return a deck of R, C, D, V lines and some instances of a subcircuit."""
    draw = random.Random(lines)
    rows = [
        "large deck",
        ".param rr=2k",
        ".model dm D(ideal)",
        ".subckt cell a b r=1k",
        "R1 a m {r}",
        "C1 m 0 1n ic=0",
        "D1 m b dm",
        ".ends",
        ".tran 1u 1m",
    ]
    while len(rows) < lines:
        k = len(rows)
        nodes = f"n{k // 3} n{draw.randrange(k)}"
        kind = draw.random()
        if kind < 0.4:
            rows.append(f"R{k} {nodes} {draw.uniform(1, 100):.4g}k")
        elif kind < 0.6:
            rows.append(f"C{k} {nodes} {draw.uniform(1, 100):.3g}n ic=0")
        elif kind < 0.8:
            rows.append(f"D{k} {nodes} dm")
        elif kind < 0.9:
            rows.append(f"V{k} {nodes} PULSE(0 5 0 1u 1u {draw.randint(1, 99)}u 100u)")
        elif kind < 0.95:
            rows.append(f"R{k} {nodes} {{rr*{k}}}")
        else:
            rows.append(f"X{k} {nodes} cell r={k}")
    return "\n".join(rows)


def seconds(text: str, repeats: int) -> float:
    """Return the least processor time of some runs."""
    best = float("inf")
    for _ in range(repeats):
        start = time.process_time()
        parse_text(text)
        best = min(best, time.process_time() - start)
    return best


def test_a_hundred_thousand_lines_in_linear_time(capsys: pytest.CaptureFixture[str]) -> None:
    short, long = large_deck(10_000), large_deck(100_000)
    first, second = seconds(short, 3), seconds(long, 2)
    with capsys.disabled():
        print(f"\n 10k lines {first:.2f} s ({1e4 / first:.0f} lines/s)")
        print(f"100k lines {second:.2f} s ({1e5 / second:.0f} lines/s)")
    assert second < 10.0
    assert second / first < 10 * 1.5


def test_one_long_line_in_linear_time(capsys: pytest.CaptureFixture[str]) -> None:
    def line(points: int) -> str:
        return "t\nV1 a 0 PWL(" + " ".join(f"{k}u {k % 7}" for k in range(points)) + ")"

    assert len(parse_text(line(1000)).elements[0].source.values) == 2000
    first, second = seconds(line(10_000), 3), seconds(line(100_000), 2)
    with capsys.disabled():
        print(f"\na line of 10k points {first:.3f} s, of 100k points {second:.2f} s")
    assert second / first < 10 * 1.5


def test_a_small_deck(capsys: pytest.CaptureFixture[str]) -> None:
    small = seconds(large_deck(12), 20)
    with capsys.disabled():
        print(f"\n12 lines {1e3 * small:.2f} ms")
    assert small < 0.1 * seconds(large_deck(10_000), 1)
