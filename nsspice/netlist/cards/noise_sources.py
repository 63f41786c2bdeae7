"""ngspice's random waveforms, TRNOISE and TRRANDOM, as points of a PWL drawn before the run."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace

from ..deck import Deck, Source, TranCard
from ..findings import Findings, Unreadable

KINDS = ("trnoise", "trrandom")
#: samples of one source
MAX_SAMPLES = 1_000_000


def draw_waveforms(deck: Deck, findings: Findings) -> None:
    """Replace the random sources of a deck by their samples up to the end of its transients."""
    stop = max((card.tstop for card in deck.analyses if isinstance(card, TranCard)), default=0.0)
    for index, element in enumerate(deck.elements):
        source = element.source
        if source is None or source.kind not in KINDS:
            continue
        rng = random.Random(f"{deck.seed} {element.name}")
        try:
            drawn = _DRAWN[source.kind](source, stop, rng)
        except Unreadable as found:
            findings.record(found)
            continue
        deck.elements[index] = replace(element, source=drawn)
        message = f"{element.name}: the noise is the same in each run"
        findings.warning("NS1096", message, source.span, "change it with --seed or seed=")


def _noise(source: Source, stop: float, rng: random.Random) -> Source:
    """Return ``TRNOISE(na nt nalpha namp ...)``: Gaussian samples, straight lines between them."""
    deviation, interval, *rest = [v or 0.0 for v in (*source.values, 0.0, 0.0)][:7]
    if any(rest[1:]):
        message = "trnoise: only white noise is simulated, no 1/f noise and no telegraph noise"
        raise Unreadable("NS1002", message, source.span, "write TRNOISE(na nt 0 0)")
    count = _count(source, interval, stop)
    level = source.dc or 0.0
    points = [0.0, level]
    for k in range(1, count + 1):
        points += [k * interval, level + rng.gauss(0.0, deviation)]
    return source._replace(dc=None, kind="pwl", values=tuple(points))


def _random(source: Source, stop: float, rng: random.Random) -> Source:
    """Return ``TRRANDOM(type ts td p1 p2)``: values that hold for ``ts`` each."""
    given = [v if v is not None else 0.0 for v in source.values]
    kind, interval, delay, first, second = (*given, 0.0, 0.0, 0.0, 0.0)[:5]
    if len(given) < 4:
        first = 1.0
    draw = _LAWS.get(kind)
    if draw is None:
        hint = "1 is uniform, 2 Gaussian, 3 exponential, 4 Poisson"
        raise Unreadable("NS2011", f"trrandom: there is no type {kind:g}", source.span, hint)
    count = _count(source, interval, stop)
    level = source.dc or 0.0
    points = [0.0, level]
    value = level
    for k in range(count + 1):
        at = delay + k * interval
        points += [at, value]
        value = level + second + draw(rng, first)
        points += [at, value]
    return source._replace(dc=None, kind="pwl", values=tuple(points))


def _count(source: Source, interval: float, stop: float) -> int:
    """Return the number of samples."""
    if not interval > 0.0:
        message = f"{source.kind}: the time between samples must be positive"
        raise Unreadable("NS2011", message, source.span)
    count = math.ceil(stop / interval * (1.0 - 1e-12))  # quotients of whole numbers are rounded
    if count > MAX_SAMPLES:
        message = f"{source.kind}: {count} samples are more than {MAX_SAMPLES}"
        raise Unreadable("NS1043", message, source.span, "lengthen the time between them")
    return count


def _poisson(rng: random.Random, mean: float) -> float:
    """Return the number of events of mean ``mean``: of exponential gaps until their sum is 1."""
    count, gone = -1, 0.0
    while gone < 1.0:
        gone += rng.expovariate(max(mean, 1e-300))
        count += 1
    return float(count)


_LAWS: dict[float, Callable[[random.Random, float], float]] = {
    1.0: lambda rng, width: rng.uniform(-width, width),
    2.0: lambda rng, deviation: rng.gauss(0.0, deviation),
    3.0: lambda rng, mean: mean * rng.expovariate(1.0),
    4.0: _poisson,
}
_DRAWN = {"trnoise": _noise, "trrandom": _random}
