"""What ngspice says of a deck as it was written, at cut steps: the judge of ``public_decks.py``.

The text goes to ngspice unchanged but for its analyses: neither nsspice's reader nor its
translation takes part.  One analysis of each kind is compared, with the values of the deck itself.
"""

from __future__ import annotations

import re
import subprocess
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nsspice.analyses.request.request import Request
from nsspice.analyses.studies.batch import Job, jobs_of, run_job
from nsspice.circuit import Circuit
from nsspice.netlist.deck import AcCard, DcCard, TranCard
from nsspice.output.raw import read_raw

Floats = npt.NDArray[np.float64]

KINDS = ("op", "dc", "ac", "tran")
#: steps of ngspice in a run, at least, and in a step of its rows
_STEPS, _BETWEEN = 20_000, 4.0
#: folders upwards to which decks may refer
_LEVELS = 3
#: seconds for a run of ngspice
_PATIENCE = 60
#: the part of the largest signal of its unit below which a signal is not judged by its own range
_SMALL = 1e-3
#: what ngspice leaves undecided of a signal [V, A]
_NOISE = {"v": 1e-6, "i": 1e-9}
_CARDS = re.compile(
    r"\s*\.(tran|dc|ac|op|noise|tf|pz|sens|four|meas\w*|print|plot|save|probe|pss|disto|width|sp|end)\b",
    re.IGNORECASE,
)
_TIGHT = ".options reltol=1e-5 vntol=1e-8 abstol=1e-13 itl4=200"


def judged(path: Path, circuit: Circuit) -> dict[str, Any]:
    """Return the largest difference of each kind of analysis, as a part of the signal's range."""
    found: dict[str, Any] = {}
    for job in jobs_of(circuit.deck):
        if job.kind in KINDS and job.kind not in found:
            plain = replace(job, steps=(), alterations=())
            found[job.kind] = _difference(path, circuit, plain)
    return found


def _difference(path: Path, circuit: Circuit, job: Job) -> Any:
    """Return (difference, signal), or why there is none."""
    command = _command(job)
    if command is None:
        return "no command of ngspice"
    solution = run_job(circuit, job, Request())
    raw = _ngspice(path, command)
    if isinstance(raw, str):
        return raw
    names, data = raw
    theirs = {_own(name): row for name, row in zip(names, data, strict=True)}
    if job.kind == "ac":
        parts = (("re", np.real), ("im", np.imag))
        theirs = {f"{k}({n})": part(row) for n, row in theirs.items() for k, part in parts}
    axis = np.real(data[0])
    shared = [n for n in solution.columns if n in theirs and _unit(n) in _NOISE]
    if not shared:
        return "no signal in common"
    errors, ranges = {}, {}
    for name in shared:
        own, other = np.asarray(solution[name]), np.asarray(theirs[name])
        if job.kind == "tran":
            errors[name] = _apart(solution.axis, np.real(own), axis, np.real(other))
        elif own.size != other.size:
            return f"{own.size} points, ngspice has {other.size}"
        else:
            errors[name] = float(np.abs(own - other).max())
        # of a single point the value itself
        ranges[name] = float(np.ptp(other)) if other.size > 1 else float(abs(other[0]))
    worst, name = max((errors[n] / _scale(n, ranges), n) for n in shared)
    return worst, name


def _apart(time: Floats, own: Floats, axis: Floats, other: Floats) -> float:
    """Return how far rows are from all that ngspice has within two of its steps."""
    slack = 2.0 * float(axis[-1] - axis[0]) / _STEPS
    # with uic ngspice leaves the first instant unsolved; of the last it has one side
    inside = (time > max(time[0], axis[0])) & (time < axis[-1] - slack)
    if not inside.any():
        return 0.0
    t, y = time[inside], own[inside]
    low, high = np.full(t.size, np.inf), np.full(t.size, -np.inf)
    for at in (t - slack, t, t + slack):
        value = np.interp(at, axis, other)
        low, high = np.minimum(low, value), np.maximum(high, value)
    first, last = (np.searchsorted(axis, t + s, "left") for s in (-slack, slack))
    for k in np.flatnonzero(last > first):
        between = other[first[k] : last[k]]
        low[k], high[k] = min(low[k], between.min()), max(high[k], between.max())
    return float(np.maximum(0.0, np.maximum(y - high, low - y)).max())


def _scale(name: str, ranges: dict[str, float]) -> float:
    largest = max(r for n, r in ranges.items() if _unit(n) == _unit(name))
    return max(ranges[name], _SMALL * largest, _NOISE[_unit(name)] / _SMALL)


def _unit(name: str) -> str:
    """Return ``v`` or ``i`` of ``v(a)``, ``re(i(l1))``."""
    return name.removeprefix("re(").removeprefix("im(")[:1] if "(" in name else ""


def _own(name: str) -> str:
    """Return nsspice's name of a vector."""
    name = name.lower()
    branch = re.fullmatch(r"(?:i\()?(.*)#branch\)?", name)
    if branch:
        return f"i({branch[1]})"
    return name if "(" in name else f"v({name})"


def _command(job: Job) -> str | None:
    card = job.card
    if isinstance(card, TranCard):
        start = card.tstart or 0.0
        between = min((card.tstop - start) / _STEPS, (card.tstep or card.tstop) / _BETWEEN)
        uic = " uic" if card.uic else ""
        # edges without a length are as long as the step of the card
        return f"tran {card.tstep or between!r} {card.tstop!r} {start!r} {between!r}{uic}"
    if isinstance(card, DcCard):
        return _dc(card)
    if isinstance(card, AcCard):
        return _ac(card)
    return "op" if job.kind == "op" else None


def _dc(card: DcCard) -> str | None:
    words = ["dc"]
    for sweep in card.sweeps:
        values = np.asarray(sweep.values, dtype=np.float64)
        if values.size < 2 or np.ptp(np.diff(values)) > 1e-9 * np.ptp(values):
            return None
        words += [
            sweep.name,
            *(repr(float(v)) for v in (values[0], values[-1], np.diff(values).mean())),
        ]
    return " ".join(words)


def _ac(card: AcCard) -> str | None:
    f = np.asarray(card.frequencies, dtype=np.float64)
    if f.size == 1:
        return f"ac lin 1 {f[0]!r} {f[0]!r}"
    ratios = np.diff(np.log(f))
    if np.ptp(ratios) < 1e-6:
        for word, base in (("dec", 10.0), ("oct", 2.0)):
            points = np.log(base) / ratios.mean()
            if abs(points - round(points)) < 1e-6 * points:
                return f"ac {word} {round(points)} {float(f[0])!r} {float(f[-1])!r}"
    if np.ptp(np.diff(f)) < 1e-6 * f[-1]:
        return f"ac lin {f.size} {float(f[0])!r} {float(f[-1])!r}"
    return None


def _ngspice(path: Path, command: str) -> tuple[list[str], Any] | str:
    """Run a deck with one analysis; return names and values, or what went wrong."""
    with tempfile.TemporaryDirectory() as folder:
        here = _beside(path.resolve(), Path(folder))
        deck = here / "judged.cir"
        deck.write_text(_text(path, command), "utf-8")
        try:
            done = subprocess.run(
                ["ngspice", "-b", deck.name],
                cwd=here,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=_PATIENCE,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return f"ngspice takes more than {_PATIENCE} s"
        raw = here / "judged.raw"
        if not raw.exists():
            said = [line for line in (done.stdout + done.stderr).splitlines() if "rror" in line]
            return "ngspice fails: " + (said[0].strip() if said else "without a word")[:120]
        try:
            names, data = read_raw(raw, imaginary=True)
        except Exception as error:  # what ngspice wrote may be anything
            return f"ngspice's file: {error}"
        stop = command.split()
        if stop[0] == "tran" and np.real(data[0][-1]) < float(stop[2]) * (1.0 - 1e-9):
            return f"ngspice stops at {np.real(data[0][-1]):g} s"
        return names, data


def _beside(path: Path, folder: Path) -> Path:
    """Return a folder from which all files are seen as from that of a deck, some levels up."""
    for parent in reversed(path.parents[:_LEVELS]):
        for other in parent.iterdir():
            if other not in path.parents:
                folder.joinpath(other.name).symlink_to(other)
        inner = next((p for p in path.parents[:_LEVELS] if p.parent == parent), None)
        if inner is not None:
            folder = folder / inner.name
            folder.mkdir()
    return folder


def _text(path: Path, command: str) -> str:
    """Return the deck with one analysis of our own in place of all others."""
    lines = path.read_text("utf-8", "replace").splitlines()
    kept, script, dropped = lines[:1], False, False
    for line in lines[1:]:
        word = line.strip().lower()
        if word.startswith(".control"):
            script = True
        elif word.startswith(".endc"):
            script = False
        elif word.startswith("+") and dropped:
            continue
        elif not script:
            dropped = bool(_CARDS.match(line))
            if not dropped:
                kept.append(line)
    own = [
        _TIGHT,
        ".control",
        "set noaskquit",
        "save all",
        command,
        "write judged.raw",
        ".endc",
        ".end",
    ]
    return "\n".join([*kept, *own]) + "\n"
