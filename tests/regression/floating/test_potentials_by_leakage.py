"""Bridges whose output floats between blocking junctions: leakage alone gives its potential.

Slopes of blocking junctions are 1e-25 S beside coils of 1e-9 S.  The sum of the laws of both nodes
holds nothing else; where its pivot was taken for rounding, Newton's method crept or was flung away.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.converter_parts import BRIDGE, SECONDARY

import nsspice

#: the magnetising current stays in the secondary while the switches are open; took 400 000 steps
COIL = (
    """full bridge with a resistance and a coil, junctions that store nothing
Vin vi 0 24
Rin vi a 10m
Vg g 0 PULSE(0 1 0 0 0 1.89158u 4.02464u)
Vh h 0 PULSE(0 1 2.01232u 0 0 1.89158u 4.02464u)
"""
    + BRIDGE
    + """Rp p p3 0.353
L1 p3 q 500.7u
L2 s 0 57.3u
L3 0 t 57.3u
"""
    + SECONDARY
    + """Rf f o 56.9m
C1 o 1_y 7.21u
RC1 1_y 0 11.8m
R1 o 0 2.104
.model ds D(IS=1.13e-15)
.model sw SW(VT=0.5 VH=0.1)
.tran 0.2012u 20.123u uic
"""
)
#: a tank in series, and series resistances: 36 unknowns; tolerances of 1e-6 and below failed
TANK = (
    """full bridge with a resonant tank
Vin a 0 100
Vg g 0 PULSE(0 1 0 0 0 134.526u 286.226u)
Vh h 0 PULSE(0 1 143.113u 0 0 134.526u 286.226u)
"""
    + BRIDGE
    + """Lr p p2 11.86m
Cr p2 p3 172.6n
L1 p3 q 593.2m
L2 s 0 29.44m
L3 0 t 29.44m
"""
    + SECONDARY
    + """Lo f o_x 118.6m
RLo o_x o 92.2m
C1 o 0 208.4u
R1 o 0 28.29
.model ds D(IS=3.59e-15 RS=75m)
.model sw SW(VT=0.5)
.tran 14.31u 2.8623m
"""
)


#: 40 sections of RC at the supply, which it does not notice: 63 unknowns, whose factors are sparse
LADDER = "Rz0 vi z0 1k\n" + "".join(
    f"Rz{k + 1} z{k} z{k + 1} 1k\nCz{k} z{k} 0 1n\n" for k in range(40)
)
LARGE = COIL.replace(".tran", LADDER + ".tran")


@pytest.mark.parametrize("deck", [COIL, TANK, LARGE], ids=["coil", "tank", "large"])
def test_a_floating_output_costs_no_more_than_others(deck: str) -> None:
    runs = {tol: nsspice.tran(nsspice.read(deck), reltol=tol) for tol in (1e-4, 1e-6, 1e-8)}
    for run in runs.values():
        assert run.certificate.passed
        assert run.stats["steps"] < 5000
    fine = runs[1e-8]
    for tol in (1e-4, 1e-6):
        for name in ("v(o)", "i(l2)", "i(l3)"):
            apart = np.mean(np.abs(runs[tol][name] - fine[name]))
            # errors of steps add up, so far to no more than a hundred times that of one
            assert apart < 100.0 * tol * np.ptp(fine[name]), (tol, name)


def test_potentials_stay_between_the_rails() -> None:
    """Junctions that carry leakage alone block: nothing lifts what floats beyond their knees."""
    run = nsspice.tran(nsspice.read(COIL))
    idle = (run["v(g)"] < 0.5) & (run["v(h)"] < 0.5) & (np.abs(run["i(l1)"]) < 1e-12)
    assert idle.sum() > 5
    for node in ("v(p)", "v(q)"):
        assert (run[node][idle] > 0.0).all()
        assert (run[node][idle] < run["v(a)"][idle]).all()


#: six series resistances; where all diodes block their leakages are the same to the last digit, and
#: the potential of the output is open within volts: 40 000 steps for 2 ms, and no certificate
THREE_PHASE = """three-phase bridge whose output floats
VA a 0 SIN(0 170 60)
VB b 0 SIN(0 170 60 0 0 -120)
VC c 0 SIN(0 170 60 0 0 -240)
D1 a p DM
D3 b p DM
D5 c p DM
D2 n a DM
D4 n b DM
D6 n c DM
C1 p n 1000u
R1 p n 100
{tie}
.model DM D(IS=1e-12 RS=0.1)
.tran 50u {stop}
"""


@pytest.mark.parametrize("stop", ["2m", "30m"])
def test_equal_leakages_leave_the_potential_where_it_is(stop: str) -> None:
    run, tied = (
        nsspice.tran(nsspice.read(THREE_PHASE.format(stop=stop, tie=tie)))
        for tie in ("", "R9 n 0 1meg")
    )
    assert run.certificate.passed
    assert run.stats["steps"] < 1000
    # the tie carries 0.2 mA, beside some 20 A that charge the capacitor
    out = run["v(p)"] - run["v(n)"]
    assert np.abs(out - (tied["v(p)"] - tied["v(n)"])).max() < 1e-4 * 294.0
    # no diode blocks more than the largest line voltage, nor conducts by its potential alone
    assert np.abs(run["v(p)"]).max() < 300.0
