"""Random converters of junctions with TT and no capacitance: where their energy went, to 1e-6.

In steps of 1e-19 s the charge of such a junction over the length of the step is 1e11 A, and its
rounding amperes.  What that, potentials of teravolts, or the limit of short steps made of a state
was certified once, since the allowance for rounding grew with the largest voltage of the run.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.converter_parts import PUSH_PULL, RESONANT, half_bridge

import nsspice

PULSE = "0 0 19.67u 43.72u"
COIL = """Ll{k} p{k} x{k} 12.65m IC={start}
Rl{k} x{k} star 27.4
"""
GATES = [(0, 21.86, -0.5), (14.57, 36.43, 0), (29.15, 7.286, 1)]
#: reverse recovery begins in a step of 6e-20 s, in which rounding fed 70 uC into a junction
INVERTER = "\n".join(
    [
        "inverter with a star, from currents that do not sum to zero\nVin a 0 24",
        *(
            half_bridge(k, on, off, PULSE) + COIL.format(k=k, start=start)
            for k, (on, off, start) in enumerate(GATES)
        ),
        ".model ds D(IS=2.04e-12 RS=0.17 TT=71.8n)\n.model sw SW(VT=0.5)",
        ".tran 2.186u 437u uic",
    ]
)
#: the limit of three steps behind an edge put 8e9 C into a junction
TORN = (
    """push-pull converter with leakage
.param primary=50.58u secondary=27.34u k=0.95
Vin vi 0 5
Rin vi a 10.3m
Vg g 0 PULSE(0 1 0 7.859n 7.859n 3.53656u 7.85902u)
Vh h 0 PULSE(0 1 3.92951u 7.859n 7.859n 3.53656u 7.85902u)
"""
    + PUSH_PULL
    + """Lo f o 10.12u
C1 o 0 1.1m
R1 o 0 1.075
.model ds D(IS=1.77n N=1.66 RS=0.402 TT=52.3n)
.model sw SW(VT=0.5)
.tran 0.393u 39.295u uic
"""
)
#: all that holds the potential of the DC side is 1 MOhm
RECTIFIER = """three-phase rectifier behind coils
V0 w0 0 SIN(0 325 140.56k)
L0 w0 p0 5.849u
Dh0 p0 o ds
Dl0 n p0 ds
V1 w1 0 SIN(0 325 140.56k 0 0 -120)
L1 w1 p1 5.849u
Dh1 p1 o ds
Dl1 n p1 ds
V2 w2 0 SIN(0 325 140.56k 0 0 -240)
L2 w2 p2 5.849u
Dh2 p2 o ds
Dl2 n p2 ds
C1 o y 164.7u
RC1 y n 6.32m
R1 o n 1.874
Rg n 0 1meg
.model ds D(IS=1.5e-11 N=1.57 RS=6.79m TT=2.17n)
.tran 0.3557u 3.557u
"""
#: beside these: windings without leakage, whose rates are beyond all that they store
DECKS = {"inverter": INVERTER, "push-pull": TORN, "rectifier": RECTIFIER, "bridge": RESONANT}


@pytest.mark.parametrize("name", DECKS)
def test_no_energy_comes_from_nowhere(name: str) -> None:
    """Sources, stores, heat, jumps and the scheme: their sum vanishes to a millionth of the parts.

    Steps are accepted with residuals of 1e-10; charges of junctions count as heat.  What the sums
    are judged against is little more than these parts.
    """
    run = nsspice.tran(nsspice.read(DECKS[name]))
    assert run.certificate.passed
    energy = run.certificate.energy
    parts = [-energy.delivered, energy.stored, energy.dissipated, energy.lost, energy.scheme]
    size = sum(abs(part) for part in parts)
    assert abs(sum(parts)) < 1e-6 * size
    assert energy.turned < 100.0 * size


def test_energy_of_windings_that_are_torn_off_is_lost() -> None:
    """Four windings and a coil lose a fifth of what is delivered at the instants of their switches.

    What is stored at the end is that of the currents and the voltage there, to the digits of sums
    of a thousand steps.
    """
    run = nsspice.tran(nsspice.read(TORN), reltol=1e-4)
    energy = run.certificate.energy
    root = np.sqrt([50.58e-6, 50.58e-6, 27.34e-6, 27.34e-6])
    windings = (0.95 + 0.05 * np.eye(4)) * np.outer(root, root)
    currents = np.array([run[f"i(l{k})"][-1] for k in range(1, 5)])
    stored = currents @ windings @ currents + 10.12e-6 * run["i(lo)"][-1] ** 2
    stored += 1.1e-3 * run["v(o)"][-1] ** 2
    assert energy.stored == pytest.approx(0.5 * stored, rel=1e-9)
    assert energy.lost == pytest.approx(4.68e-5, rel=1e-2)
    assert abs(energy.scheme) < 1e-4 * energy.delivered
