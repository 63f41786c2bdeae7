"""One leg of a modular multilevel converter, whose modes are hardly ever met twice."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from decks.cells import leg

import nsspice

#: a diode without resistance that blocks for ever: the same circuit, but modes are reduced
REDUCED = "Vq q lm 20k\nDq 0 q"
#: an average, and a largest value between two rows
MEASURES = ".measure tran mean AVG i(lo)\n.measure tran most MAX v(pu0,xu0)"


@pytest.mark.parametrize("cells", [8])
def test_series_are_closed_forms(cells: int) -> None:
    """Two ways through the same segments: Taylor coefficients, and spectra of modes."""
    signals = ["i(lo)", "v(pu0,xu0)", "i(lu)"]
    series, closed = (
        nsspice.tran(nsspice.read(leg(cells, 2e-3, more=more)), method="modewise", signals=signals)
        for more in (MEASURES, f"{REDUCED}\n{MEASURES}")
    )
    assert series.stats["reduced"] == 0
    assert closed.stats["reduced"] >= closed.stats["modes"]
    assert series.certificate is not None
    assert series.certificate.passed
    for name in signals:
        # both are exact but for rounding; instants of events are known to what their guards are
        assert np.abs(series[name] - closed[name]).max() < 1e-9 * np.abs(closed[name]).max()
    for name, value in closed.measures.items():
        assert series.measures[name] == pytest.approx(value, rel=1e-9)


@pytest.mark.parametrize("cells", [8, 16])
def test_series_are_what_spectra_gave(cells: int) -> None:
    """Rows of the engine that reduced every mode to its spectrum, before there were series."""
    rows = np.genfromtxt(Path(__file__).with_suffix(".csv"), delimiter=",", names=True)
    run = nsspice.tran(nsspice.read(leg(cells)), method="modewise")
    assert run.certificate is not None
    assert run.certificate.passed
    assert run.stats["reduced"] == 0
    known = rows[f"cells_{cells}"]
    assert np.abs(run["i(lo)"][::10] - known).max() < 1e-9


def test_a_large_leg_needs_no_closed_form() -> None:
    """With 48 cells an arm dense modes would be beyond the limit."""
    run = nsspice.tran(nsspice.read(leg(48, 0.3e-3)), method="modewise")
    assert run.certificate is not None
    assert run.certificate.passed
    assert run.stats["reduced"] == 0


def test_dead_time_and_blocking() -> None:
    """While both switches of a cell are open its diodes decide: blocked cells are only charged."""
    dead, blocked = 1e-6, 5e-3
    cells = [f"v(p{arm}{k},x{arm}{k})" for arm in "ul" for k in (0, 7)]
    signals = [*cells, "i(lo)", "i(lu)", "i(ll)"]
    deck = leg(16, 8e-3, dead=dead, blocked=blocked, off="1meg")
    run = nsspice.tran(nsspice.read(deck), method="modewise", signals=signals)
    assert run.certificate is not None
    assert run.certificate.passed
    turns = [event for event in run.events if event.element.startswith("s")]
    assert max(event.time for event in turns) == pytest.approx(blocked, rel=1e-12)
    # a carrier of 2 V/ms and a reference of 141 V/s at most, in the same direction or against it
    least, most = (dead * 2000 / (2000 + sign * 45 * np.pi) for sign in (1, -1))
    for cell in ("u0", "l3"):
        own = sorted((e.time, e.change) for e in turns if e.element[2:] == cell)
        between = [turn for turn in own if 1e-5 < turn[0] < blocked * (1 - 1e-9)]
        opens = [time for time, change in between if change == "off"]
        closes = [time for time, change in between if change == "on"]
        assert len(opens) == len(closes) >= 8
        gaps = np.subtract(closes, opens)
        assert least * (1 - 1e-9) < gaps.min() < gaps.max() < most * (1 + 1e-9)
    late = run.time > blocked
    for name in cells:
        # but for what two parallel open pairs take from 2 mF within a row
        leak = run[name].max() / 0.5e6 * 10e-6 / 2e-3
        assert np.diff(run[name][late]).min() > -1.001 * leak
    # the cells that the currents charge bring them to nothing
    assert abs(run["i(lu)"][late][0]) > 10.0
    assert np.abs([run[name][-1] for name in ("i(lu)", "i(ll)", "i(lo)")]).max() < 0.1
    # i(lo) leaves the star of the three inductors
    assert np.abs(run["i(lu)"] - run["i(ll)"] - run["i(lo)"]).max() < 1e-9 * 80


@pytest.mark.parametrize("off", ["1meg", "1g"])
def test_diodes_in_series_that_stop_one_after_the_other(off: str) -> None:
    """In a dead time diodes of one arm carry nearly the same current: they stop within picoseconds.

    A nanoampere that falls is not zero yet: the mode in which its diode conducts holds.
    """
    deck = leg(4, 1e-3, dead=1e-6, off=off)
    run = nsspice.tran(nsspice.read(deck), method="modewise")
    assert run.certificate is not None
    assert run.certificate.passed
    steps = nsspice.tran(nsspice.read(deck), method="sdirk", reltol=1e-7)
    scale = np.abs(run["i(lo)"]).max()
    assert np.abs(run["i(lo)"] - steps["i(lo)"]).max() < 1e-6 * scale
