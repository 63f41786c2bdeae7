"""A junction with a diffusion charge alone beside a winding: what it stores while it blocks.

At -10 V the slope of the charge is 1e-95 F, which with a winding of 6 mH would make a time
constant of 1e-49 s; in steps that are short beside that, rounding of the flux was 1e28 V.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest

import nsspice

FORWARD = """Forward converter, reset winding with a junction that has TT but no capacitance
VIN in 0 5
VG g 0 PULSE(0 1 0 0.11u 0.11u 7.9u 29.8u)
L1 in sw 6.2m
L2 s 0 1.55m
L3 0 r 6.2m
K1 L1 L2 L3 0.99
DR r in dn
S1 sw 0 g 0 sm
D1 s x dm
D2 0 x dm
LO x out 1.24m
RSN sw sn 60
CSN sn 0 33n
CSW sw 0 80p
RS1 sw s1 14
CS1 s1 0 0.82n
RO out 0 47
CO out ny 5u
RY ny 0 0.07
.model sm SW(VT=0.5 VH=0.2 RON=0.36 ROFF=16meg)
.model dm D(IS=5.4e-10 N=1.95 RS=1.4)
.model dn D(IS=1.4e-10 N=1.95 TT=1.9n)
.tran 1u 250u uic
"""
SIGNALS = ("i(l1)", "i(l2)", "v(sn)", "v(out)")


def agree(run: nsspice.Solution, fine: nsspice.Solution, names: Iterable[str], part: float) -> None:
    """Assert that signals differ by less than a part of their ranges."""
    for name in names:
        error = np.abs(run[name] - fine[name]).max() / np.ptp(fine[name])
        assert error <= part, name


@pytest.mark.parametrize("reltol", [1e-4, 1e-5])
def test_tolerances_agree(reltol: float) -> None:
    """Errors of steps add up over some hundred periods of the leakage: ten times the tolerance."""
    circuit = nsspice.read(FORWARD)
    fine = nsspice.tran(circuit, method="sdirk", reltol=1e-7)
    run = nsspice.tran(circuit, method="sdirk", reltol=reltol)
    for each in (run, fine):
        assert each.certificate.passed
        assert (
            np.abs(each["v(sw)"]).max() < 15.0
        )  # 5 V, what the reset winding adds, and some ringing
    agree(run, fine, SIGNALS, 10.0 * reltol)


SNAP = """A leakage inductance tears the last charge out of a junction
VIN in 0 12
VG g 0 PULSE(0 1 0 6n 6n 0.8u 3.55u)
L1 in sw 160u
L3 0 r 160u
K1 L1 L3 0.998
DR r in dn
S1 sw 0 g 0 sm
RSN sw sn 3.4
CSN sn 0 6.3n
.model sm SW(VT=0.5 VH=0.2 RON=0.012 ROFF=1.9meg)
.model dn D(IS=6.3e-10 N=1.94 RS=2.6 TT=10.8n)
.tran 0.7u 14u uic
"""


@pytest.mark.parametrize("reltol", [1e-4, 1e-5, 1e-6])
def test_the_last_charge_is_passed_over(reltol: float) -> None:
    """The current cannot stop and no charge is left: the voltage has no bound in any step.

    With `q' = i + IS - q / TT` and `v = N Vt ln(q / (TT IS))` a reverse current takes `q` to zero
    in finite time.  One implicit step passes over that instant; to look closer costs ten times
    all the rest.
    """
    circuit = nsspice.read(SNAP)
    fine = nsspice.tran(circuit, method="sdirk", reltol=1e-8)
    run = nsspice.tran(circuit, method="sdirk", reltol=reltol)
    assert fine.certificate.passed
    assert run.certificate.passed
    agree(run, fine, ("i(l1)", "v(sn)"), 10.0 * reltol)
    assert run.stats["linearised"] < 40 * run.stats["steps"]


#: its leakage of 1e-13 A is all that flows; a part in 1e11 of its charge is
#: 1e-14 A in the ringing of the coil and its capacitance
RESTING = """coil behind a junction that blocks 24 V
D1 k vs d
Vs vs 0 24
Lr k x 2m
Rr x 0 25
.model d D(IS=1e-13 CJO=30p)
.tran 50u 4m
"""


@pytest.mark.parametrize("reltol", [1e-3, 1e-5, 1e-6])
def test_the_rounding_of_a_charge_is_no_motion_of_a_coil(reltol: float) -> None:
    """Each period was followed: 723 000 steps, and no end with reltol = 1e-6."""
    run = nsspice.tran(nsspice.read(RESTING), reltol=reltol)
    assert run.certificate.passed
    assert run.islands[0].stats["steps"] < 200
    # what Newton's method leaves of the charge, beside the leakage
    assert np.abs(run["i(d1)"] + 1e-13).max() < 1e-15


#: at rest for 5 ms, and again from 45 ms on
RELAY = """high-side driver of a relay with its clamp and snubber
.model n NPN(IS=1e-14 BF=200 VAF=80 CJE=20p CJC=8p TF=0.5n TR=50n RB=20 RC=0.5)
.model p PNP(IS=1e-13 BF=100 VAF=50 CJE=50p CJC=30p TF=1n TR=100n RB=10 RC=0.2)
.model df D(IS=1e-9 N=1.8 RS=40m CJO=15p TT=4u)
.model dz D(IS=1e-14 BV=15 IBV=5m RS=2 CJO=100p)
Vs vs 0 24
Q1 k b vs p
Rbe b vs 4.7k
Rb b c1 4.7k
Q2 c1 b2 0 n
Rg g b2 22k
Vg g 0 PULSE(0 5 5m 1u 1u 40m 100m)
Lr k x 200m
Rr x 0 250
D1 y k df
Dz y 0 dz
Rsn k sn 1k
Csn sn 0 10n
.tran 50u 80m
"""


@pytest.mark.parametrize("reltol", [1e-5, 1e-6])
def test_a_relay_at_rest(reltol: float) -> None:
    """30 000 steps, 410 000 with reltol = 1e-6, nearly all of them at rest."""
    run = nsspice.tran(nsspice.read(RELAY), reltol=reltol)
    assert run.certificate.passed
    assert run.islands[0].stats["steps"] < 5000
    # 24 V less the saturation of Q1; 15 V of the clamp, a junction, and 90 mA in 2 Ohm
    assert run["i(lr)"].max() == pytest.approx(24.0 / 250.0, rel=0.02)
    assert -17.0 < run["v(k)"].min() < -15.0
