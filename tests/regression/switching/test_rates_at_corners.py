"""Currents of capacitors and junctions in rows at corners and switchings: those right after them.

Rates come from the laws and not from differences in short steps: where these are 1e-17 s long,
unknowns have no digits for them.  Sources move on: a capacitor across one that begins to rise
carries its current at once.
"""

import numpy as np
import pytest

import nsspice

#: rows at each corner of the source
RISE = """A source that rises and falls, with capacitors across it and behind a diode
V1 a 0 PULSE(0 5 10u 10u 10u 20u 70u)
C1 a 0 1u
R1 a 0 1k
D1 a b {diode}
C2 b 0 1n
R2 b 0 10k
.model ideal D(ideal)
.model junction D(IS=1e-14)
.tran 5u 60u
"""

BUCK = """Buck with a junction: rows at both edges of the gate
V1 in 0 24
S1 in sw g 0 fast
D1 0 sw junction
L1 sw out 100u
C1 out 0 100u IC=10
R1 out 0 5
VG g 0 PULSE(0 1 0 10n 10n 5u 10u)
.model fast SW(VT=.5 VH=.1 RON=10m ROFF=10meg)
.model junction D(IS=1e-12 RS=10m)
.tran 0.5u 200u uic
"""

STORED = """A junction with charges, and rows at the corners of its source
V1 a 0 PULSE(-2 5 10u 2u 3u 20u 50u)
R1 a b 100
D1 b 0 junction
C2 b c 1n
R2 c 0 1k
.model junction D(IS=1e-14 CJO=100p TT=50n)
.tran 1u 100u
"""


def test_ideal_diodes_as_with_the_exact_engine():
    """Where nothing turns, rates are those of steps with a tolerance of 1e-7."""
    circuit = nsspice.read(RISE.format(diode="ideal"))
    names = ["i(c1)", "i(c2)", "i(v1)"]
    exact = nsspice.tran(circuit, method="modewise", signals=names)
    run = nsspice.tran(circuit, method="sdirk", reltol=1e-7, signals=names)
    assert run.certificate.passed
    for name in names:
        assert run[name] == pytest.approx(exact[name], rel=1e-5, abs=1e-9), name


@pytest.mark.parametrize("diode", ["ideal", "junction"])
@pytest.mark.parametrize("method", ["sdirk", "moreau"])
def test_a_capacitor_across_a_source_carries_what_its_slope_says(diode, method):
    """C u' right after each corner, u' = 0.5 V/us; the node's law gives the source's current."""
    circuit = nsspice.read(RISE.format(diode=diode))
    run = nsspice.tran(circuit, method=method, signals=["i(c1)", "i(v1)", "v(a)", "i(d1)"])
    time = run.axis
    corners = [10e-6, 20e-6, 40e-6, 50e-6]
    if method == "moreau":
        corners = []  # nothing jumps there: its rows are those of the steps that end there
    for corner, current in zip(corners, [0.5, 0.0, -0.5, 0.0], strict=False):
        row = int(np.argmin(abs(time - corner)))
        assert run["i(c1)"][row] == pytest.approx(current, rel=1e-9, abs=1e-12)
    total = run["i(v1)"] + run["i(c1)"] + run["v(a)"] / 1e3 + run["i(d1)"]
    assert abs(total).max() < 1e-9 * 0.5


def test_the_capacitor_of_a_buck_carries_what_the_winding_brings():
    """i(C) = i(L) - v/R at the edges of the gate, to what the certificate grants, 1e-8 of 3 A."""
    run = nsspice.tran(nsspice.read(BUCK), signals=["i(c1)", "i(l1)", "v(out)"])
    missed = run["i(c1)"] - (run["i(l1)"] - run["v(out)"] / 5)
    edges = np.isclose((run.axis * 1e6) % 5, 0, atol=1e-3) | np.isclose((run.axis * 1e6) % 5, 5)
    assert edges.sum() > 20
    assert abs(missed[edges]).max() < 1e-8 * 3


def test_the_charge_of_a_junction_counts_at_corners():
    """i(R1) = i(D1) + i(C2), currents of 42 mA, to a tenth of what the certificate grants a law."""
    run = nsspice.tran(nsspice.read(STORED), signals=["i(r1)", "i(d1)", "i(c2)"])
    missed = run["i(r1)"] - run["i(d1)"] - run["i(c2)"]
    assert abs(missed).max() < 1e-9 * 0.042


def test_capacitors_begin_with_the_slopes_of_sources():
    """With initial values the first row is the one right after time zero: 2 pi 5 V 1 kHz 1 uF."""
    text = "x\nV1 a 0 SIN(1 5 1k)\nC1 a 0 1u IC=1\nR1 a 0 1k\nD1 a b dx\nR2 b 0 1k\n.model dx D\n"
    run = nsspice.tran(
        nsspice.read(text), 200e-6, 50e-6, uic=True, method="sdirk", signals=["i(c1)"]
    )
    assert run["i(c1)"][0] == pytest.approx(2 * np.pi * 5 * 1e3 * 1e-6, rel=1e-9)


BRIDGED = """A capacitor behind a bridge, across its source, beside a switch that leads nowhere
V1 a b SIN(0 5 2839)
Rb b 0 1meg
D1 a c vf
D2 0 b vf
C1 c 0 14.09u
VG g 0 PULSE(0 5 0 0.176118u 0.176118u 11.0727u 17.6118u)
S1 c d g 0 sw
.model vf D(Vfwd=0.7)
.model sw SW(VT=2.5 Ron=5m Roff=1meg)
.tran 0.88059u 52.835u
"""


def test_what_is_drowned_beside_short_increments_hides_no_current():
    """A node with 1 MOhm alone, beside 14 uF in steps of 1e-16 s: rows at the gate's periods."""
    circuit = nsspice.read(BRIDGED)
    exact = nsspice.tran(circuit, method="modewise", signals=["i(v1)"])
    run = nsspice.tran(circuit, method="sdirk", reltol=1e-7, signals=["i(v1)"])
    assert run.certificate.passed
    assert run["i(v1)"] == pytest.approx(exact["i(v1)"], abs=1e-4)
