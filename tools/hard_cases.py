"""Run every deck of netlists/pathological with nsspice and with ngspice, and write what came out.

    python tools/hard_cases.py measure     # runs everything, writes docs/hard_cases.json
    python tools/hard_cases.py peers       # what Siconos and Pulsim do with the cases they can take
    python tools/hard_cases.py page        # writes docs/reference/hard-cases.md and its pictures

``measure`` needs ngspice; ``peers`` uses the Pythons named by SICONOS_PYTHON and PULSIM_PYTHON.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

import nsspice
from nsspice.analyses import read
from nsspice.analyses.solution.solution import Solution
from nsspice.compare.checks import ValueCheck
from nsspice.compare.expectation import read_expectation
from nsspice.compare.ngspice import run as run_ngspice

ROOT = Path(__file__).parents[1]
DECKS = ROOT / "netlists" / "pathological"
STORE = ROOT / "docs" / "hard_cases.json"
PEERS = ROOT / "docs" / "peer_cases.json"
#: seconds that ngspice gets for one deck
PATIENCE = 12.0
#: ngspice may miss a check by this part of the expected range and still be called right
FAIR = 0.02


def main() -> None:
    """Do what the command line asks for."""
    what = sys.argv[1:] or ["measure", "page"]
    if "measure" in what:
        measure()
    if "peers" in what:
        measure_peers()
    if "page" in what:
        from hard_cases_page import write

        write(json.loads(STORE.read_text()), json.loads(PEERS.read_text()), ROOT)


def measure() -> None:
    """Store what both programs do with every deck, after each of them."""
    found: dict[str, Any] = {}
    for netlist in sorted(DECKS.glob("*.net")):
        entry = {"title": netlist.read_text().splitlines()[0]}
        entry["nsspice"] = ours(netlist)
        entry["ngspice"] = theirs(netlist)
        found[netlist.stem] = entry
        STORE.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n")
        print(f"{netlist.stem:45s} {entry['nsspice']['text']:30s} | {entry['ngspice']['text']}")


def measure_peers() -> None:
    """Store what Siconos and Pulsim find."""
    found: dict[str, Any] = {}
    for peer, default in (("siconos", "/usr/bin/python3"), ("pulsim", sys.executable)):
        python = os.environ.get(f"{peer.upper()}_PYTHON", default)
        with tempfile.TemporaryDirectory() as folder:  # Siconos leaves files where it runs
            done = subprocess.run(
                [python, str(ROOT / "tools" / "peer_cases.py"), peer],
                capture_output=True, text=True, cwd=folder, timeout=300, check=False,
            )  # fmt: skip
        lines = [json.loads(s) for s in done.stdout.splitlines() if s.startswith("{")]
        if not lines:
            print(f"{peer}: cannot run with {python}: {done.stderr.splitlines()[-1:]}")
            continue
        for line in lines:
            found.setdefault(line.pop("case"), {})[peer] = line
    PEERS.write_text(json.dumps(found, indent=1) + "\n")


def ours(netlist: Path) -> dict[str, Any]:
    """Run a deck with nsspice and check it."""
    begin = time.perf_counter()
    report = nsspice.check(netlist)
    seconds = round(time.perf_counter() - begin, 3)
    expectation = read_expectation(netlist)
    if expectation.refused is not None:
        text = f"refused: {expectation.refused.code}, named"
    else:
        text = f"{len(expectation.checks)} checks hold"
    return {"passed": report.passed, "text": text if report.passed else "FAILS", "seconds": seconds}


def theirs(netlist: Path) -> dict[str, Any]:
    """Run a deck with ngspice, ideal laws replaced by sharp smooth ones."""
    expectation = read_expectation(netlist)
    try:
        circuit = read(netlist)
    except nsspice.NsspiceError:
        return raw(netlist)
    begin = time.perf_counter()
    try:
        found = run_ngspice(circuit, timeout=PATIENCE)
    except nsspice.NsspiceError as error:
        reason = getattr(error, "reason", "") or error.diagnostics[0].message
        seconds = round(time.perf_counter() - begin, 2)
        return {"verdict": "fails", "text": f"fails: {reason}", "seconds": seconds}
    seconds = round(found.seconds, 3)
    if expectation.refused is not None:
        peak = max(float(np.max(np.abs(v))) for v in found.vectors.values())
        text = f"no complaint; largest value {peak:.1e}"
        return {"verdict": "silent", "text": text, "seconds": seconds}
    return {**judge(expectation, found), "seconds": seconds}


def judge(expectation: Any, found: Any) -> dict[str, Any]:
    """Compare ngspice's waveforms with the known answers."""
    signals = {k: np.asarray(v) for k, v in found.vectors.items()}
    kind = "tran" if found.axis.size > 1 else "op"
    solution = Solution(kind, "", "time" if kind == "tran" else "", found.axis, signals)
    worst, where = 0.0, ""
    judged = 0
    for check in expectation.checks:
        if not isinstance(check, ValueCheck):
            continue
        try:
            outcome = check.apply(solution, Path("."))
        except Exception:
            continue
        if not np.isfinite(outcome.error):
            continue
        judged += 1
        kinds = {name[:2] for name in check.signals()}
        alike = [float(np.max(np.abs(y))) for name, y in signals.items() if name[:2] in kinds]
        scale = max(abs(check.value), *alike, 1e-300)
        share = max(0.0, outcome.error - check.tolerance) / scale
        if share > worst:
            worst, where = share, f"{outcome.text}: off by {outcome.error:.3g}"
    if not judged:
        return {"verdict": "runs", "text": "runs; has no impulses to compare"}
    if worst <= FAIR:
        return {"verdict": "right", "text": f"right within {max(worst, 1e-6):.0e}"}
    return {"verdict": "wrong", "text": f"wrong: {where}"}


def raw(netlist: Path) -> dict[str, Any]:
    """Give a deck that nsspice refuses before it runs to ngspice as it stands."""
    text = netlist.read_text()
    text = re.sub(r"(?mi)^(D\S+ \S+ \S+)\s*$", r"\1 DIDEAL", text)
    text = text.replace("\n.end", "\n.model DIDEAL D(N=0.01)\n.end")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "deck.cir"
        file.write_text(text)
        try:
            done = subprocess.run(
                ["ngspice", "-b", "-r", str(Path(folder) / "out.raw"), str(file)],
                capture_output=True, text=True, timeout=PATIENCE, check=False,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            return {"verdict": "fails", "text": "fails: time-out", "seconds": PATIENCE}
    lines = (done.stdout + done.stderr).splitlines()
    bad = [s.strip() for s in lines if re.search(r"(?i)error|singular|abort|too small|fail", s)]
    if bad:
        return {"verdict": "fails", "text": f"fails: {bad[0][:70]}", "seconds": None}
    return {"verdict": "silent", "text": "no complaint", "seconds": None}


if __name__ == "__main__":
    main()
