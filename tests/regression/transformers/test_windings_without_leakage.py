"""Transformers with K=1 beside junctions and ideal switches: voltages are as turns in every step.

The fluxes of two such windings are one flux.  In the steps behind a switching, of 1e-17 s and
less, the rounding error of each flux divided by the length is volts, and no leakage limits the
currents that their difference drives.  So the law of one winding is free of fluxes: a ratio of
voltages.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.converter_parts import BRIDGE, RESONANT, SECONDARY

import nsspice

#: dead times in which the bridge floats on the leakage of its diodes
DOUBLER = (
    """current doubler behind a full bridge
Vin vi 0 12
Rin vi a 1.38m
Vg g 0 PULSE(0 1 0 0 0 1.969u 5.199u)
Vh h 0 PULSE(0 1 2.5995u 0 0 1.969u 5.199u)
"""
    + BRIDGE
    + """L1 p q 2.7m
L2 s t 10.8m
K1 L1 L2 1
D5 0 s ds
D6 0 t ds
Rt t 0 1meg
L3 s o 0.54m
L4 t o 0.54m
C1 o 0 1.34u
R1 o 0 651
.model ds D(IS=6.5e-10 N=1.9 CJO=0.28n)
.model sw SW(VT=0.5 RON=6.4m ROFF=27meg)
.tran 0.52u 52u uic
"""
)

CENTRE_TAP = (
    """full bridge, rectifier with a centre tap
Vin vi 0 12
Rin vi a 1.6m
Vg g 0 PULSE(0 1 0 38n 38n 17.99u 38.27u)
Vh h 0 PULSE(0 1 19.13u 38n 38n 17.99u 38.27u)
"""
    + BRIDGE
    + """Rp p p3 0.59
L1 p3 q 67m
L2 s 0 16.75m
L3 0 t 16.75m
"""
    + SECONDARY
    + """Rf f o 85m
C1 o 0 15u
R1 o 0 30
.model ds D(IS=3.6e-15 N=1.5)
.model sw SW(VT=0.5 RON=7.7m ROFF=87meg)
.tran 1.91u 382u uic
"""
)

#: a deck, its primary, each secondary with the ratio of its turns, and what is stored for long
CASES = {
    "doubler": (DOUBLER, "v(p,q)", {"v(s,t)": 2.0}, ("v(o)", "i(l3)")),
    "centre tap": (CENTRE_TAP, "v(p3,q)", {"v(s)": 0.5, "v(t)": -0.5}, ("v(o)",)),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("reltol", [1e-4, 1e-5, 1e-6])
def test_voltages_are_as_turns(case: str, reltol: float) -> None:
    """The ratio holds in every row, to the residual of Newton's method (1e-14 to 1e-11).

    The largest terms of these laws are the voltages; rows come from polynomials through solutions,
    which keep linear laws.
    """
    deck, primary, secondaries, _ = CASES[case]
    run = nsspice.tran(nsspice.read(deck), reltol=reltol)
    assert run.certificate.passed
    for signal, ratio in secondaries.items():
        expected = ratio * run[primary]
        assert np.abs(run[signal] - expected).max() < 1e-10 * np.abs(expected).max()


@pytest.mark.parametrize("case", CASES)
def test_tolerances_agree(case: str) -> None:
    """Errors are a few times the tolerance, see ``docs/explanation/error-control.md``."""
    deck, _, _, stored = CASES[case]
    fine = nsspice.tran(nsspice.read(deck), reltol=1e-8)
    assert fine.certificate.passed
    for reltol in (1e-4, 1e-6):
        run = nsspice.tran(nsspice.read(deck), reltol=reltol)
        for signal in stored:
            assert np.abs(run[signal] - fine[signal]).max() < 5.0 * reltol * np.ptp(fine[signal])


def test_no_winding_jumps() -> None:
    """What the windings store goes on through each switching, whichever of them carries it."""
    run = nsspice.tran(nsspice.read(CENTRE_TAP))
    turns = run["i(l1)"] + 0.5 * run["i(l2)"] + 0.5 * run["i(l3)"]
    # the flux that volts change: at most 12 V / 67 mH for the distance of two rows
    assert np.abs(np.diff(turns)).max() < 12.0 / 67e-3 * 1.91e-6 * 1.05


def test_a_resonant_tank_has_one_current() -> None:
    """Coil and winding in series carry one current, also beside the charge of the capacitor there.

    In steps of 1e-22 s the rounding of that charge (17 uC) is amperes; the sum of the laws at the
    ends of the capacitor has none of it, and the bridge around it floats as a whole, too.
    """
    run = nsspice.tran(nsspice.read(RESONANT), all_points=True)
    assert run.certificate.passed
    coil, winding = run["i(lr)"], run["i(l1)"]
    assert np.abs(coil - winding).max() < 1e-10 * np.abs(coil).max()
