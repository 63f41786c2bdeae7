"""Guards are located inside every step, however long: steps with error control against exact ones.

Where all that is stored is constant no error limits the step, which grows to a fiftieth of a run;
the sources alone end the mode.  The search for the next mode held them, found none, and went on
over the instant with an implicit step of the length of the last one: 0.17 ms late, 0.275 V of 12 V.
"""

from __future__ import annotations

from collections.abc import Callable
from random import Random

import numpy as np
import pytest
from decks.random_events import gated_load, zener_chain

import nsspice

#: part of the range of a signal: a step errs by 1e-5 of it, and thirty steps of one sign by this
ERROR = 3e-4
#: part of the run: three periods, in which a guard crosses zero with a slope of its range per
#: period and is off by that part
LATE = ERROR

LATE_EVENT = """\
reverse breakdown that ends while both capacitors are clamped
V1 in 0 SIN(1.0 40.0 289.01734104046244 0 0 30.0)
R1 in z0 4997.0
D0 z1 z0 DZ
RB0 z1 z0 62300.0
CB0 z1 0 1.89e-07
D1 z1 z2 DI
D2 z2 0 DZ2
CZ z0 0 6.58e-07
.model DI D(ideal)
.model DZ D(Vfwd=0.6 Vrev=4.7)
.model DZ2 D(Vfwd=0.7 Vrev=3.3 Ron=0)
.tran 26u 10.38m
.end
"""


def _runs(deck: str) -> list[nsspice.Solution]:
    circuit = nsspice.read(deck)
    stop = circuit.deck.analyses[0].tstop
    methods = ("modewise", "sdirk")
    return [nsspice.tran(circuit, stop=stop, step=stop / 400, method=m) for m in methods]


def _error(exact: nsspice.Solution, found: nsspice.Solution, signal: str) -> float:
    """Return the error as a part of the largest value; two output points may lie beside a jump."""
    size = max(np.abs(exact[signal]).max(), 1e-9)
    return float(np.sort(np.abs(exact[signal] - found[signal]))[-3] / size)


def _lateness(exact: nsspice.Solution, found: nsspice.Solution) -> float:
    times = np.array([event.time for event in found.events] or [np.inf])
    late = [np.abs(times - event.time).min() for event in exact.events]
    return float(max(late, default=0.0) / exact.time[-1])


def test_sources_alone_end_a_mode() -> None:
    exact, found = _runs(LATE_EVENT)
    # the current of the breakdown ends where the source has fallen to what is clamped and bled
    off = [e.time for e in found.events if (e.element, e.change) == ("d0.rev", "off")]
    clamped = 0.7 + 4.7
    wanted = clamped + 4997.0 * 4.7 / 62300.0
    omega = 2 * np.pi * 289.01734104046244
    instant = (np.pi - np.arcsin((wanted - 1.0) / 40.0) - np.pi / 6) / omega
    assert off[0] == pytest.approx(instant, abs=1e-6)
    assert all(_error(exact, found, signal) <= ERROR for signal in ("v(z0)", "v(z1)", "i(v1)"))


def _held(deck: str) -> list[str]:
    """Return signals that do not float between blocking diodes."""
    lines = [line.split() for line in deck.splitlines()[1:] if line[0] == "C"]
    return ["i(v1)", "v(z0)", *(f"v({line[1]})" for line in lines)]


@pytest.mark.parametrize("seed", [*range(20), 1083, 1454, 1675, 2141, 2313, 2359])
def test_random_zener_chains(seed: int) -> None:
    deck = zener_chain(Random(seed))
    exact, found = _runs(deck)
    assert [s for s in _held(deck) if _error(exact, found, s) > ERROR] == []


@pytest.mark.parametrize("seed", [*range(20), 156, 218, 231, 244])
def test_random_gates(seed: int) -> None:
    exact, found = _runs(gated_load(Random(seed)))
    assert [s for s in exact.signals if _error(exact, found, s) > ERROR] == []
    assert len(exact.events) == len(found.events)
    assert _lateness(exact, found) <= LATE


@pytest.mark.soak
@pytest.mark.parametrize("make", [zener_chain, gated_load])
def test_many(make: Callable[[Random], str]) -> None:
    for seed in range(1000, 3000):
        deck = make(Random(seed))
        exact, found = _runs(deck)
        signals = _held(deck) if make is zener_chain else exact.signals
        assert [(seed, s) for s in signals if _error(exact, found, s) > ERROR] == []
