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
