"""Converters fed by one another: picofarads beside millifarads, floating rails, many rates."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

#: submodules of a modular converter with snubbers and output capacitances of its switches
SUBMODULES = """submodules
C27 bus mid 0.002 IC=2.5
R1 bus 0 1k
Vg34 g34 0 PULSE(0 5 2.55e-05 0 0 2.425e-05 5e-05)
S38 bus n30 g34 0 sw
R41 bus n40 6.758
C42 n40 n30 7.44e-09 IC=0
L46 bus n43 5.789e-09 IC=0
C47 n43 n30 0.0007423 IC=1.667
R2 n30 0 10k
Vg52 g52 0 PULSE(0 5 4.31667e-05 0 0 2.275e-05 5e-05)
S56 n30 n48 g52 0 sw
L78 mid n75 0.0002203 IC=0
Vg81 g81 0 PULSE(0 5 2.6e-05 0 0 2.4e-05 5e-05)
Vg83 g83 0 PULSE(0 5 1e-06 0 0 2.35e-05 5e-05)
S85 n80 n75 g81 0 sw
S87 n75 n79 g83 0 sw
C89 n75 n79 7.906e-10 IC=0
C92 n90 n79 0.002299 IC=1.667
R92 n80 n90 0.04
Vg95 g95 0 PULSE(0 5 4.21667e-05 0 0 2.45e-05 5e-05)
Vg97 g97 0 PULSE(0 5 1.71667e-05 0 0 2.425e-05 5e-05)
S99 n94 n79 g95 0 sw
S101 n79 n93 g97 0 sw
D102 n93 n79 d
C103 n94 n93 0.0005359 IC=1.667
Vg106 g106 0 PULSE(0 5 9.33333e-06 0 0 2.4e-05 5e-05)
S110 n105 n93 g106 0 sw
C112 n105 n93 8.659e-11 IC=0
R120 n105 n93 1k
R121 n93 0 10k
.model d D(Vfwd=0.8 Ron=5m Roff=1meg)
.model sw SW(VT=2.5 Ron=5m)
.tran 2.5u 250u uic
.end
"""


def test_rates_from_a_second_to_a_picosecond():
    # a decomposition of the whole mode is off by a third in its slow vectors
    run = nsspice.tran(nsspice.read(SUBMODULES))
    assert run.certificate.passed
    assert run.certificate.energy.drift < 1e-10


#: a converter whose negative rail hangs on one resistance, in which no current can flow
RAIL = """floating rail
C17 n53 rail 0.3749u IC=0
R18 rail 0 {tie}
L23 n53 n19 462.3u IC=0
D27 n19 n34 d
R37 n34 rail 100
Vg g 0 PULSE(0 5 3.68167u 0 0 3.48583u 5u)
S42 n53 n48 g 0 sw
D43 rail n48 d
L50 n48 n47 5.034n IC=0
C51 n47 rail 0.3483u IC=106.7
R52 n48 rail 19.9
L58 n53 n54 346.6u IC=0
R60 n54 n59 11.82m
C61 n59 rail 2.468u IC=0
C92 n90 rail 1.702u IC=0
.model d D(Ron=10m)
.model sw SW(VT=2.5 VH=0.5 Ron=10m Roff=1meg)
.tran 0.4u 40u uic
.end
"""


def test_a_floating_rail_is_tied_by_any_resistance():
    across = ("n53", "n34", "n48", "n47", "n59")
    expected = None
    for tie in (1.0, 1e4, 1e6, 1e8, 1e10):
        run = nsspice.tran(nsspice.read(RAIL, params={"tie": tie}))
        assert run.certificate.passed
        assert run.stats["fixed_steps"] == 0
        voltages = np.array([run[f"v({n})"] - run["v(rail)"] for n in across])
        currents = np.array([run[f"i({n})"] for n in ("L23", "L50", "L58", "D43")])
        if expected is None:
            expected = voltages, currents
        for found, known in zip((voltages, currents), expected, strict=True):
            # what an ampere's rounding is worth in 10 GOhm is 2e-6 V, of 100 V
            assert np.max(np.abs(found - known)) < 2e-8 * np.max(np.abs(known)), tie


@pytest.mark.parametrize("tie", [1e3, 1e6])
def test_a_control_between_floating_nodes(tie):
    # a source of 5 V on the rail closes a switch on it: what it is tied to ground by plays no part
    deck = RAIL.replace("Vg g 0 PULSE", "Vg g rail PULSE").replace("n48 g 0 sw", "n48 g rail sw")
    apart = nsspice.tran(nsspice.read(deck, params={"tie": tie}))
    near = nsspice.tran(nsspice.read(RAIL, params={"tie": 1.0}))
    assert apart.certificate.passed
    assert len(apart.events) == len(near.events)
    for one, other in zip(apart.events, near.events, strict=True):
        assert (one.element, one.change) == (other.element, other.change)
        assert one.time == pytest.approx(other.time, rel=1e-9)
