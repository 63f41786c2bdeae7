"""Gates that take turns at one instant: rounding of the time opens or closes both for no time."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

#: the gates cross their thresholds 31.6 ns behind each edge; no diode, so that a gap of any
#: length takes the current away from the coil
SYNCHRONOUS = """Synchronous buck converter without diodes and without dead time
V1 in 0 48
Vg g 0 PULSE(0 5 0 63.2n 63.2n 43.5564u 63.1998u)
S1 in x g 0 SM
Vh h 0 PULSE(0 5 43.6196u 63.2n 63.2n 19.517u 63.1998u)
S2 x 0 h 0 SM
L1 x out 0.2874
C1 out 0 7.53u
R1 out 0 4318.1
.model SM SW(VT=2.5 RON=10m)
.tran 1.58u 1.264m uic
"""
#: the same with switches without resistance: an overlap of any length shorts the source
STIFF = SYNCHRONOUS.replace(" RON=10m", "")


@pytest.mark.parametrize("deck", [SYNCHRONOUS, STIFF], ids=["RON", "ideal"])
@pytest.mark.parametrize(("method", "part"), [("sdirk", 1e-5), ("moreau", 2e-3)])
def test_neither_gap_nor_overlap(deck: str, method: str, part: float) -> None:
    circuit = nsspice.read(deck)
    exact = nsspice.tran(circuit, method="modewise")
    run = nsspice.tran(circuit, method=method)
    assert exact.certificate.passed
    assert run.certificate.passed
    assert not exact.jumps
    assert not run.jumps
    for name in ("i(l1)", "v(out)"):
        assert np.abs(run[name] - exact[name]).max() < part * np.ptp(exact[name])


def test_nor_with_smooth_laws_beside_it() -> None:
    """The load is a junction: steps with error control by default."""
    smooth = SYNCHRONOUS.replace("R1 out 0 4318.1", "R1 out d 2k\nD1 d 0 DS\n.model DS D(IS=1e-9)")
    run = nsspice.tran(nsspice.read(smooth))
    assert run.islands[0].method == "sdirk"
    assert run.certificate.passed
    assert not run.jumps
    # without a gap the current of the coil never moves by more than 48 V allow in a row
    assert np.abs(np.diff(run["i(l1)"])).max() < 1.01 * 48.0 / 0.2874 * 1.58e-6


def test_true_gaps_are_seen() -> None:
    """A gap of 10 ns, two hundred thousand roundings long: the coil loses its current."""
    late = SYNCHRONOUS.replace("43.6196u", "43.6296u")
    run = nsspice.tran(nsspice.read(late), method="sdirk")
    assert run.certificate.passed
    assert any(jump.stores[0].element == "l1" and jump.stores[0].after == 0.0 for jump in run.jumps)
