"""What an agent may do with decks: each call is a process of its own, with limits."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..errors import Diagnostic, UsageError

_ENDINGS = (".net", ".cir", ".sp", ".ckt", ".csv", ".toml")
_LONGEST = 100_000  # characters of a file that is read
_MEGA = 1 << 20


class Tools:
    """Reading and simulating decks below one folder.

    Parameters
    ----------
    folder : Path
        Nothing outside it is read; nothing in it is written.
    seconds : float
        Longest time of a call [s].
    memory : float
        Largest memory of a call [MB]; where the system cannot limit it, only the time counts.
    """

    def __init__(self, folder: Path, seconds: float = 30.0, memory: float = 2048.0) -> None:
        self.folder = folder.resolve()
        self.seconds, self.memory = seconds, memory

    def files(self) -> list[str]:
        """List the decks and waveform files of the folder."""
        found = (p for p in self.folder.rglob("*") if p.suffix.lower() in _ENDINGS and p.is_file())
        inside = (p for p in found if p.resolve().is_relative_to(self.folder))
        return sorted(str(p.relative_to(self.folder)) for p in inside)

    def read(self, file: str) -> str:
        """Return the text of a file of the folder."""
        return self._inside(file).read_text("utf-8", errors="replace")[:_LONGEST]

    def explain(self, deck: str, params: dict[str, float] | None = None) -> dict[str, Any]:
        """Say how a deck would be solved, and which effects it contains, without simulating it."""
        return self._call(deck, "explain", _params(params))[0]

    def run(
        self,
        deck: str,
        params: dict[str, float] | None = None,
        signals: Sequence[str] = (),
        points: int = 100,
    ) -> dict[str, Any]:
        """Simulate a deck; return measures, verdict, and some rows of the signals asked for."""
        chosen = ["--signals", " ".join(signals)] if signals else []
        result, tables = self._call(deck, "run", [*_params(params), *chosen])
        if signals:
            result["waveforms"] = {name: _some(rows, points) for name, rows in tables.items()}
        return result

    def measure(self, deck: str, params: dict[str, float] | None = None) -> dict[str, Any]:
        """Simulate a deck; return only its measures and the verdict on each run."""
        result = self._call(deck, "run", _params(params))[0]
        if "runs" not in result:
            return result
        return {
            "runs": [
                {
                    "analysis": r["analysis"],
                    "parameters": r["parameters"],
                    "measures": r["measures"],
                    "passed": (r["certificate"] or {}).get("passed"),
                }
                for r in result["runs"]
            ]
        }

    def compare(self, deck: str, reference: str, tolerance: float = 1e-3) -> dict[str, Any]:
        """Compare a simulation with the waveforms of a CSV file of the folder."""
        options = [str(self._inside(reference)), "--tolerance", repr(float(tolerance))]
        return self._call(deck, "compare", options)[0]

    def all(self) -> list[Callable[..., Any]]:
        """Return the tools."""
        return [self.files, self.read, self.explain, self.run, self.measure, self.compare]

    def _inside(self, name: str) -> Path:
        """Return a file of the folder, refuse any other."""
        path = (self.folder / name).resolve()
        if not path.is_relative_to(self.folder) or not path.is_file():
            message = f"there is no file {name} in the folder that is served"
            raise UsageError(Diagnostic("NS4001", message, hint="files() lists what there is"))
        return path

    def _call(
        self, deck: str, command: str, options: Sequence[str]
    ) -> tuple[dict[str, Any], dict[str, list[list[str]]]]:
        """Run a command in an empty folder; return its JSON, and the tables that it wrote."""
        with tempfile.TemporaryDirectory() as scratch:
            if "\n" in deck:
                netlist = Path(scratch, "deck.net")
                netlist.write_text(deck, "utf-8")
            else:
                netlist = self._inside(deck)
            words = [sys.executable, "-m", "nsspice", command, str(netlist), *options]
            package = str(Path(__file__).parents[2])
            path = os.pathsep.join(filter(None, [package, os.environ.get("PYTHONPATH", "")]))
            try:
                done = subprocess.run(
                    [*words, "--confined", "--json"],
                    cwd=scratch,
                    capture_output=True,
                    text=True,
                    timeout=self.seconds,
                    check=False,
                    stdin=subprocess.DEVNULL,
                    env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": path},
                    preexec_fn=self._limits(),
                )
            except subprocess.TimeoutExpired:
                return {"error": f"stopped after {self.seconds:g} s"}, {}
            tables = {p.stem: _rows(p) for p in sorted(Path(scratch).glob("*.csv"))}
        for text in (done.stdout, done.stderr):
            try:
                found = json.loads(text)
            except ValueError:
                continue
            return {"exit_code": done.returncode, **found}, tables
        return {"exit_code": done.returncode, "error": done.stderr[-2000:]}, tables

    def _limits(self) -> Callable[[], None] | None:
        """Return what limits the memory of a process before it starts."""
        try:
            import resource
        except ImportError:  # Windows
            return None
        size = int(self.memory * _MEGA)

        def limit() -> None:
            resource.setrlimit(resource.RLIMIT_AS, (size, size))

        return limit


def _params(params: dict[str, float] | None) -> list[str]:
    """Return options that set parameters."""
    pairs = (params or {}).items()
    return [word for name, value in pairs for word in ("--param", f"{name}={float(value)!r}")]


def _rows(path: Path) -> list[list[str]]:
    with path.open(newline="") as file:
        return list(csv.reader(file))


def _some(rows: list[list[str]], points: int) -> dict[str, Any]:
    """Return rows of a table, evenly taken, as numbers."""
    head, *body = rows
    step = max(1, -(-len(body) // max(1, points)))
    kept = body[::step]
    return {
        "columns": head,
        "rows": [[float(cell) for cell in row] for row in kept],
        "every": step,
    }
