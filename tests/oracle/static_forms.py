"""Closed forms and scalar roots of the static thesis examples, and their tables.

``python -m oracle.static_forms`` in the folder ``tests`` writes ``appB_ex43_scr.csv`` anew.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

DATA = Path(__file__).parents[2] / "netlists" / "thesis" / "data"

#: example 4.3 of appendix B: phi(0) = 2, phi'(0) = 3, phi' >= -6/7, phi(2) = 4, phi'(2) = 6
LOAD, SLOPE, END, BREAKDOWN = 1.0, 8.0, 2.0, 1.0


def phi(z: float) -> float:
    """Return the forward curve of the thyristor [V] at a current [A]."""
    return 2.0 + z * (3.0 + z * (-4.5 + z * 1.75))


def scr_voltage(z: float) -> float:
    """Return the thyristor's voltage for a current that is not zero."""
    if z < 0.0:
        return SLOPE * z - BREAKDOWN
    return phi(z) if z <= END else SLOPE * (z - END) + phi(END)


def scr_current(p: float) -> float:
    """Return the current for ``p in R i + G(i)`` by bisection; the sum is strictly monotone."""
    if -BREAKDOWN <= p <= phi(0.0):
        return 0.0
    low, high = (0.0, abs(p) / LOAD) if p > 0.0 else (-abs(p) / LOAD, 0.0)
    for _ in range(200):
        middle = 0.5 * (low + high)
        if LOAD * middle + scr_voltage(middle) < p:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def write_scr(path: Path = DATA / "appB_ex43_scr.csv") -> None:
    """Write the table for p = 10 sin t."""
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["t_s", "p_V", "i_A", "v_V"])
        for k in range(2001):
            t = k * 0.005
            p = 10.0 * math.sin(t)
            i = scr_current(p)
            table.writerow([f"{x:.17g}" for x in (t, p, i, p - LOAD * i)])


if __name__ == "__main__":
    write_scr()
