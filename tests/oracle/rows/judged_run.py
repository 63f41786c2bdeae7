"""One run of a deck by one method, written as CSV and judged by its rows alone."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import nsspice

from .flat_deck import FlatDeck, read
from .judge import violations
from .written import Rows, Violation, read_csv

METHODS = ("modewise", "sdirk", "moreau", "auto")
#: rows in one of the deck's, and at most in all, of a first run; then finer ones
FINE, MOST = 10, 20_000
FINER, MORE = (8, 64), 150_000
#: largest violation of a right run: of closed forms what rounding leaves, of steps ten times what
#: their error control is asked for by default
ROUNDING, STEPS = 1e-6, 1e-4
_QUADRATURE = ("charge", "flux")
#: equations of single rows
_ALGEBRAIC = ("KCL", "resistor", "source", "controlled source", "diode", "switch", "thyristor")


@dataclass
class Judged:
    """What became of a run."""

    method: str
    #: certified, refused (its certificate fails), or the code of the error that ended it
    outcome: str
    message: str = ""
    #: engines of its islands
    engines: str = ""
    rows: int = 0
    seconds: float = 0.0
    #: the largest violation of each equation, algebraic ones in the rows that were asked for
    worst: list[Violation] = field(default_factory=list)
    #: of algebraic ones in the engine's own points too
    between: list[Violation] = field(default_factory=list)
    #: signals at the deck's own instants, for comparison with other runs
    stored: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def tolerance(self) -> float:
        return ROUNDING if set(self.engines.split()) == {"modewise"} else STEPS

    @property
    def right(self) -> bool:
        return bool(self.rows) and _largest(self.worst) <= self.tolerance

    @property
    def right_between(self) -> bool:
        return _largest(self.between) <= self.tolerance


def _largest(found: list[Violation]) -> float:
    return max((v.size for v in found), default=0.0)


def judged(text: str, method: str) -> Judged:
    """Run a deck and judge its rows.

    What quadrature finds is confirmed with finer rows: a wrong charge stays, what rows do not
    resolve falls.
    """
    deck, begin = read(text), time.monotonic()
    fine = min(FINE, max(1, int(MOST * deck.step / deck.stop)))
    try:
        run, rows = _rows(text, deck, method, fine)
    except nsspice.NsspiceError as error:
        return Judged(
            method, error.code, str(error).splitlines()[0], seconds=time.monotonic() - begin
        )
    passed = run.certificate is None or run.certificate.passed
    out = Judged(method, "certified" if passed else "refused")
    out.engines = " ".join(sorted({str(i.method) for i in run.islands}))
    out.rows = rows.time.size
    stepped = method == "moreau"
    found = violations(text, rows, stepped=stepped)
    if stepped and len(run.islands) > 1:
        # at the instants of other islands steps are interpolated, which have no sums there
        found = [v for v in found if v.law not in _QUADRATURE]
    out.between = by_law([v for v in found if v.law in _ALGEBRAIC])
    shown = violations(text, rows.on_grid(deck.step / fine), stepped=stepped)
    out.worst = by_law([
        *(v for v in found if v.law not in _ALGEBRAIC),
        *(v for v in shown if v.law in _ALGEBRAIC),
    ])  # fmt: skip
    for factor in FINER:
        doubtful = [v.size for v in out.worst if v.law in _QUADRATURE and v.size > out.tolerance]
        if not doubtful or fine * factor * deck.stop / deck.step > MORE:
            break
        finer = violations(text, _rows(text, deck, method, fine * factor)[1], stepped=stepped)
        out.worst = by_law([
            *(v for v in out.worst if v.law not in _QUADRATURE),
            *(v for v in finer if v.law in _QUADRATURE),
        ])  # fmt: skip
    out.stored = _stored(deck, rows)
    out.seconds = time.monotonic() - begin
    return out


def _rows(text: str, deck: FlatDeck, method: str, fine: int) -> tuple[nsspice.Solution, Rows]:
    """Run and write; return the run and what was read again."""
    run = nsspice.tran(
        nsspice.read(text), deck.stop, deck.step / fine, uic=deck.uic, method=method,
        signals=deck.signals(), all_points=True, on_failure="ignore",
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rows.csv"
        run.to_csv(path)
        return run, read_csv(path)


def by_law(found: list[Violation]) -> list[Violation]:
    """Return the largest violation of each law."""
    best: dict[str, Violation] = {}
    for v in found:
        if v.law not in best or v.size > best[v.law].size:
            best[v.law] = v
    return sorted(best.values(), key=lambda v: -v.size)


def _stored(deck: FlatDeck, rows: Rows) -> dict[str, np.ndarray]:
    """Return voltages of capacitors and currents of inductors at the deck's instants."""
    at = np.arange(1, int(deck.stop / deck.step * (1 + 1e-9)) + 1) * deck.step
    out = {}
    for e in deck.elements:
        if e.letter == "c":
            out[f"v({e.name})"] = np.interp(at, rows.time, rows.voltage(*e.nodes))
        elif e.letter == "l":
            out[f"i({e.name})"] = np.interp(at, rows.time, rows.columns[f"i({e.name})"])
    return out


def distance(one: Judged, other: Judged) -> float:
    """Return the largest mean difference of stored signals, as a share of the largest of a kind.

    Next to edges a row may lie on either side: the mean counts.
    """
    largest = {
        kind: max(
            (float(np.abs(s).max()) for n, s in other.stored.items() if n[0] == kind), default=0
        )
        for kind in "vi"
    }
    shares = [
        float(np.abs(one.stored[n] - s).mean()) / (largest[n[0]] or 1.0)
        for n, s in other.stored.items()
    ]
    return max(shares, default=0.0)
