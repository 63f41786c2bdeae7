"""One leg of a modular multilevel converter, whose modes are hardly ever met twice."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

#: a diode without resistance that blocks for ever: the same circuit, but modes are reduced
REDUCED = "Vq q lm 20k\nDq 0 q"
#: an average, and a largest value between two rows
MEASURES = ".measure tran mean AVG i(lo)\n.measure tran most MAX v(pu0,xu0)"


def leg(cells: int, more: str = "") -> str:
    """Half bridges of 1 kV, complementary switches with diodes, carriers shifted in phase."""
    half, carrier = 500 * cells, 1e-3
    lines = [f"leg of {cells} cells an arm", f"Vp dcp 0 {half}", f"Vn 0 dcn {half}"]
    lines += ["Vru ru 0 SIN(0.5 -0.45 50)", "Vrl rl 0 SIN(0.5 0.45 50)"]
    for arm, top, bottom, shift in (("u", "dcp", "um", 0.0), ("l", "lm", "dcn", 0.5)):
        for k in range(cells):
            name = f"{arm}{k}"
            delay = (k + shift) / cells * carrier
            delay -= carrier if delay > 0 else 0.0
            after = bottom if k == cells - 1 else f"x{name}"
            lines += [
                f"Vc{name} c{name} 0 PULSE(0 1 {delay:.9g} 0.5m 0.5m 0 1m)",
                f"S1{name} {top} p{name} r{arm} c{name} cmp",
                f"D1{name} {top} p{name} dm",
                f"S2{name} {top} {after} c{name} r{arm} cmp",
                f"D2{name} {after} {top} dm",
                f"C{name} p{name} {after} 2m IC=1000",
            ]
            top = after
    lines += ["Lu um a 2m IC=0", "Ll a lm 2m IC=0", f"Rl a b {5 * cells}"]
    lines += [f"Lo b 0 {5e-3 * cells:.9g} IC=0", ".model dm D(Ron=1m Roff=1g Vfwd=0)", more]
    lines += [".model cmp SW(Ron=1m Roff=1g VT=0)", ".tran 10u 2m uic", MEASURES, ".end"]
    return "\n".join(lines)


@pytest.mark.parametrize("cells", [8])
def test_series_are_closed_forms(cells: int) -> None:
    """Two ways through the same segments: Taylor coefficients, and spectra of modes."""
    signals = ["i(lo)", "v(pu0,xu0)", "i(lu)"]
    series, closed = (
        nsspice.tran(nsspice.read(leg(cells, more)), method="modewise", signals=signals)
        for more in ("", REDUCED)
    )
    assert series.stats["reduced"] < 0.1 * series.stats["modes"]
    assert closed.stats["reduced"] >= closed.stats["modes"]
    assert series.certificate is not None
    assert series.certificate.passed
    for name in signals:
        # both are exact but for rounding; instants of events are known to what their guards are
        assert np.abs(series[name] - closed[name]).max() < 1e-9 * np.abs(closed[name]).max()
    for name, value in closed.measures.items():
        assert series.measures[name] == pytest.approx(value, rel=1e-9)
