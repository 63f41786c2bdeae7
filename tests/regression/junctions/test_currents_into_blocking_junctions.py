"""Currents that nothing can carry: refused, at whatever potential rounding would excuse them.

Blocking junctions carry no more than their saturation current, controlled sources as much as their
controls say.  Where a source drives more there is no solution; Newton's method then runs off to
teravolts, where a thermal voltage is less than the rounding of a potential, so that a junction may
carry anything, or to potentials on which no law depends.
"""

import numpy as np
import pytest

import nsspice

MODELS = """
.model dx D(IS=1e-14)
.model schottky D(IS=1e-6 N=1.05)
.model charged D(IS=1e-14 CJO=10p TT=5n)
.model zener D(IS=1e-14 BV=5)
.model ideal D(ideal)
.model npn NPN(IS=1e-15 BF=100)
"""

#: none of these has a solution
IMPOSSIBLE = {
    "two that block": "I1 0 a 1m\nD1 b a dx\nD2 0 b dx",
    "one that conducts into one that blocks": "I1 0 a 1m\nD1 a b dx\nD2 0 b dx",
    "schottky into silicon": "I1 0 a 1m\nD1 a b schottky\nD2 0 b dx",
    "ideal into silicon": "I1 0 a 1m\nD1 a b ideal\nD2 0 b dx",
    "picoamperes": "I1 0 a 1p\nD1 a b dx\nD2 0 b dx",
    "a transistor behind": "I1 0 a 1m\nD1 a c dx\nQ1 c b 0 npn\nRb b 0 1k",
    "a controlled source": "V1 c 0 1\nRc c 0 1k\nG1 0 a c 0 1m\nD1 a b dx\nD2 0 b dx",
    "beside a source of voltage": "V1 x 0 5\nRx x 0 1k\nI1 0 a 1m\nD1 b a dx\nD2 x b dx",
    "a node of controlled sources alone": """V0 c b -2.045
G1 a d b d 0.1293
V2 b 0 0.1
D3 c 0 dx
D5 d 0 zener""",
    "a part that only currents tie to ground": """G0 0 c d b 7.548e-06
R1 b e 0.06163
I2 0 c -0.0001342
D3 c e zener
R4 b d 0.01004
V5 a c 3.36""",
    # G1 alone leads to ground, so that nothing flows in it and v(a) = v(b); D2 then carries
    # nothing, and D0, at the 5.7 mV of V3, 0.2 uA
    "a follower of itself": "D0 d a schottky\nG1 0 b a b 0.0002172\nD2 a b dx\nV3 d b 0.005733",
}


@pytest.mark.parametrize("name", IMPOSSIBLE)
def test_what_nothing_carries_is_refused(name):
    circuit = nsspice.read(f"{name}\n{IMPOSSIBLE[name]}\n{MODELS}.op\n.end\n")
    code = None
    try:
        found = nsspice.op(circuit)
    except nsspice.NsspiceError as error:
        code = error.code
    assert code in ("NS3001", "NS3004") or (code is None and not found.certificate.passed)


@pytest.mark.parametrize("amount", [1e-12, 1e-3, 1.0])
def test_a_resistor_there_carries_it(amount):
    """The potential is Ohm's law of the resistor, 1 MOhm: what D2 leaks beside it is below 4e-7."""
    text = f"x\nI1 0 a {amount}\nD1 a b dx\nD2 0 b dx\nR1 b 0 1meg\n{MODELS}.op\n.end\n"
    found = nsspice.op(nsspice.read(text))
    assert found.certificate.passed
    assert found["v(b)"][-1] == pytest.approx(1e6 * amount, rel=1e-6)
    drop = 0.02585 * np.log1p(amount / 1e-14)
    assert found["v(a)"][-1] - found["v(b)"][-1] == pytest.approx(drop, rel=1e-2)


def test_leakage_between_junctions_at_high_potentials_is_found():
    """Junctions in series that block at a gigavolt carry the least of their saturation currents.

    Rounding of the potential, 1e-7 V, is a 2e-5th of the thermal voltage.
    """
    text = f"x\nV1 a 0 -1e9\nD1 a b schottky\nD2 b c dx\nD3 c 0 dx\n{MODELS}.op\n.end\n"
    found = nsspice.op(nsspice.read(text))
    assert found.certificate.passed
    assert found["i(d3)"][-1] == pytest.approx(-1e-14, rel=1e-3)


#: n5 has no way for what the source takes: D1 blocks, and the rest hangs there
SMALL = """A current of nanoamperes beside 71 V
I0 n5 n1 SIN(0 1.162e-08 1k)
D1 n5 0 ideal
{hanging}
V2 n4 n1 71.01
V6 n4 0 0.24
{models}
.tran 5u 1m
"""


@pytest.mark.parametrize("hanging", ["V4 n3 n5 SIN(0 0.01356 1k)", "Rx n3 n5 1", "Rx n3 n5 1m"])
def test_small_currents_beside_high_potentials_are_not_excused(hanging):
    circuit = nsspice.read(SMALL.format(hanging=hanging, models=MODELS))
    code = None
    try:
        run = nsspice.tran(circuit)
    except nsspice.NsspiceError as error:
        code = error.code
    assert code == "NS3001" or (code is None and not run.certificate.passed)


def test_energy_over_whole_periods_is_measured_by_what_was_stored_in_between():
    """A coil that a sine drives: at the end of each period what it stores is next to nothing."""
    text = """Coil and conductance, one period
I0 n1 0 SIN(0 9.477e-08 1k)
G1 0 n1 0 n1 1.107e-06
R2 0 n1 3.696e+08
L3 n1 0 0.006185
.tran 5u 1m
"""
    run = nsspice.tran(nsspice.read(text), method="modewise")
    assert run.certificate.passed
    # nearly half of what it stores at a quarter of the period, 1/2 L i^2, is seen
    assert run.certificate.energy.turned > 0.4 * 0.5 * 0.006185 * 9.477e-08**2
