"""Work-precision of every method: docs/reference/work-precision.md, by `make work-precision`.

usage: python tools/work_precision.py [--only WORD] [--limit SECONDS] [--write PAGE]

Pulsim is measured where PULSIM_PYTHON names a Python that has it, Siconos where SICONOS_PYTHON does
(Debian's python3-siconos is found by itself).
"""

from __future__ import annotations

import argparse
import datetime
import math
import os
import platform
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Sequence
from pathlib import Path

from peers import measure as measure_peers

import nsspice
from nsspice.compare.cost import CostReport, cost
from nsspice.compare.cost.problem import Problem
from nsspice.compare.cost.report import Measurement
from nsspice.output.si import number

ROOT = Path(__file__).resolve().parents[1]
MARKER = "<!-- written by tools/work_precision.py: do not edit below -->\n"
TARGET = 1e-6
PEERS = ("ngspice", "pulsim", "siconos")

NETLISTS = (
    "thesis/ex424_bridge_oscillator",
    "converters/buck",
    "converters/boost",
    "converters/flyback",
    "converters/lc_bridge_charger",
    "rectifiers/half_wave_inductive",
    "rectifiers/full_bridge_capacitor",
    "rectifiers/cockcroft_walton_4",
    "smooth/bridge",
    "smooth/clamp",
    "smooth/half_wave_capacitor",
    "smooth/multiplier",
    "smooth/buck",
    "smooth/zener",
    "bipolar/astable",
    "bipolar/schmitt_trigger",
)
#: decks that stand for a kind of circuit and belong to no other test
OWN = {
    "dcm_rectifier": """Rectifier with a choke, discontinuous current
V1 a 0 SIN(0 10 50)
L1 a b 50m IC=0
D1 b c
C1 c 0 100u IC=0
R1 c 0 100
.tran 0.1m 60m uic
""",
    "three_phase_bridge": """Three-phase bridge with line inductance, capacitor and load
Va a 0 SIN(0 325 50)
Vb b 0 SIN(0 325 50 0 0 -120)
Vc c 0 SIN(0 325 50 0 0 120)
La a x 1m IC=0
Lb b y 1m IC=0
Lc c z 1m IC=0
D1 x p
D2 y p
D3 z p
D4 n x
D5 n y
D6 n z
C1 p n 500u IC=0
R1 p n 50
Rn n 0 1meg
.tran 50u 40m uic
""",
    "smooth_rectifier": """Smooth junction with charges: peak rectifier
V1 in 0 SIN(0 10 1k)
Rs in a 10
D1 a out DX
C1 out 0 10u IC=0
R1 out 0 1k
.model DX D(IS=1e-12 CJO=10p TT=10n RS=0.1)
.tran 10u 5m uic
""",
    "smooth_and_ideal": """Smooth rectifier with an ideal clamp behind a choke
V1 in 0 SIN(0 10 1k)
Rs in a 10
D1 a out DX
C1 out 0 10u IC=0
L1 out z 1m IC=0
D2 z 0 DI
R2 z 0 10
.model DX D(IS=1e-12 CJO=10p RS=0.1)
.model DI D(ideal Vfwd=2)
.tran 10u 5m uic
""",
}


def decks(only: str) -> dict[str, str]:
    """Return the text of each deck by name."""
    found = {}
    for name in NETLISTS:
        short = name.replace("/", "_") if name.startswith("smooth/") else Path(name).name
        found[short] = (ROOT / "netlists" / f"{name}.net").read_text()
    found.update(OWN)
    return {name: text for name, text in found.items() if only in name}


def process_seconds(text: str) -> float:
    """Return the time of a whole process, from the command to the CSV file: the least of four."""
    best = math.inf
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "deck.net"
        path.write_text(text)
        command = [sys.executable, "-m", "nsspice", "run", str(path), "--quiet"]
        # an installed package has its bytecode, whatever this environment says
        env = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONPYCACHEPREFIX": folder}
        env.pop("PYTHONDONTWRITEBYTECODE", None)
        for _ in range(4):
            begin = time.perf_counter()
            subprocess.run(command, cwd=folder, env=env, capture_output=True, check=True)
            best = min(best, time.perf_counter() - begin)
    return best


def ratios(report: CostReport) -> tuple[float, float, float, float, bool]:
    """Return ngspice's best error, its time, the ratios there and at 1e-6, whether it reaches that.

    Its best error is that of its cheapest run within half of the least: substitutes for ideal
    diodes keep an error that no step takes away, and a run that only repeats it would flatter us.
    """
    nan = float("nan")
    ladders = report.ladders()
    theirs = [rows for name, rows in ladders.items() if name.startswith("ngspice")]
    ours = [rows for name, rows in ladders.items() if not name.startswith(PEERS)]
    runs = [r for rows in theirs for r in rows]
    if not runs:
        return nan, nan, nan, nan, False
    least = min(r.error for r in runs)
    best = min((r for r in runs if r.error <= 1.5 * least), key=lambda r: r.seconds)

    def own(error: float) -> float:
        found = (price(rows, error) for rows in ours)
        return min((seconds for seconds, reached in found if reached), default=nan)

    # a ladder that gets there is a better witness than one that is extrapolated
    missed, seconds = min((not reached, s) for s, reached in (price(r, TARGET) for r in theirs))
    return (
        best.error,
        best.seconds,
        best.seconds / own(best.error),
        seconds / own(TARGET),
        not missed,
    )


def machine() -> str:
    """Return date, processor and versions."""
    cpu = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        cpu = next(
            line.partition(":")[2].strip() for line in lines if line.startswith("model name")
        )
    except (OSError, StopIteration):
        pass
    try:
        out = subprocess.run(["ngspice", "--version"], capture_output=True, text=True, check=False)
        other = next(w for w in out.stdout.split() if w.startswith("ngspice"))
    except (OSError, StopIteration):
        other = "ngspice is not installed"
    today = datetime.date.today().isoformat()
    return (
        f"{today}, {os.cpu_count()} x {cpu}, Python {platform.python_version()}, "
        f"nsspice {nsspice.__version__}, {other}"
    )


def section(name: str, report: CostReport, whole: float) -> str:
    """Return the part of the page for one deck."""
    lines = [
        f"## {name}",
        "",
        f"![error against time](../images/work-precision/{name}.svg)",
        "",
        f"Whole process with the default method: {number(whole, 's', 3)}.",
        "",
        '??? note "All runs"',
        "",
        textwrap.indent("```text\n" + report.describe(TARGET) + "\n```", "    ", lambda _: True),
        "",
    ]
    return "\n".join(lines)


def row(name: str, report: CostReport, whole: float) -> str:
    """Return the line of one deck in the table at the top."""
    error, seconds, at_best, at_target, reached = ratios(report)

    def cell(value: float, form: str) -> str:
        if not math.isfinite(value):
            return "-"
        return f"({value:{form[1:-1]}})" if form.startswith("(") else format(value, form)

    found = report.cheapest(TARGET)
    own = next((a for a in found if not a.method.startswith(PEERS) and a.measured), None)
    mine = f"{own.method} {own.setting}, {number(own.seconds, 's', 3)}" if own else "-"

    def peer(prefix: str) -> str:
        best = next((a for a in found if a.method.startswith(prefix)), None)
        if best is None:
            return "-"
        return (
            ("" if best.measured else "(")
            + number(best.seconds, "s", 3)
            + ("" if best.measured else ")")
        )

    slow = number(seconds, "s", 3) if math.isfinite(seconds) else "-"
    return (
        f"| [{name}](#{name}) | {mine} | {number(whole, 's', 3)} | {cell(error, '.1e')} | {slow} "
        f"| {cell(at_best, '.0f')} | {cell(at_target, '.0f' if reached else '(.0f)')} "
        f"| {peer('pulsim')} | {peer('siconos')} |"
    )


def write(page: Path, table: list[str], sections: list[str]) -> None:
    """Write the part of the page below the marker."""
    head = page.read_text().partition(MARKER)[0]
    body = [
        f"\nMeasured on {machine()}.\n",
        "| deck | cheapest way of nsspice to 1e-6 | whole process, default | ngspice: best error "
        "| its time | ratio at that error | ratio at 1e-6 | Pulsim to 1e-6 | Siconos to 1e-6 |",
        "|---|---|---|---|---|---|---|---|---|",
        *table,
        "",
        *sections,
    ]
    page.write_text(head + MARKER + "\n".join(body))


def price(rows: Sequence[Measurement], error: float) -> tuple[float, bool]:
    """Return what an error costs with one method [s], and whether its runs reach it.

    Between two runs the logarithm of the time is linear in that of the error; beyond the longest
    run time grows with the inverse square root, as if steps of second order went on to improve it.

    Parameters
    ----------
    rows : sequence of Measurement
        Finished runs of one method.
    error : float
        As a share of the range of each signal.

    Examples
    --------
    >>> ladder = [
    ...     Measurement("m", "h", h, 1, error, error, seconds)
    ...     for h, error, seconds in ((4.0, 1e-2, 1.0), (2.0, 1e-3, 2.0), (1.0, 1e-4, 4.0))
    ... ]
    >>> [round(price(ladder, error)[0], 9) for error in (1e-1, 1e-3, 1e-4, 1e-6)]
    [1.0, 2.0, 4.0, 40.0]
    >>> price(ladder, 1e-6)[1]
    False
    """
    front: list[Measurement] = []
    for row in sorted(rows, key=lambda r: (r.seconds, r.error)):
        if not front or row.error < front[-1].error:
            front.append(row)
    if not front:
        return math.nan, False
    for k, row in enumerate(front):
        if row.error > error:
            continue
        before = front[k - 1]
        if k == 0 or row.error == 0.0:
            return row.seconds, True
        part = math.log(before.error / error) / math.log(before.error / row.error)
        return before.seconds * (row.seconds / before.seconds) ** part, True
    longest = max(row.seconds for row in rows)
    return longest * math.sqrt(front[-1].error / error), False


def main() -> None:
    """Measure, print, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="decks whose name contains this word")
    parser.add_argument("--limit", type=float, default=1.0, help="longest time of one run [s]")
    parser.add_argument("--write", type=Path, help="the page whose part below the marker to write")
    options = parser.parse_args()
    pictures = ROOT / "docs" / "images" / "work-precision"
    table, sections = [], []
    for name, text in decks(options.only).items():
        circuit = nsspice.read(text)
        report = cost(circuit, limit=options.limit)
        measure_peers(report, Problem.of(circuit), options.limit)
        whole = process_seconds(text)
        print(report.describe(TARGET), flush=True)
        table.append(row(name, report, whole))
        print(table[-1] + "\n", flush=True)
        sections.append(section(name, report, whole))
        if options.write is not None:
            pictures.mkdir(parents=True, exist_ok=True)
            report.plot(pictures / f"{name}.svg")
            write(options.write, table, sections)  # what is there counts if it is stopped


if __name__ == "__main__":
    main()
