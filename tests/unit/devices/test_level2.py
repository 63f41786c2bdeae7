"""SPICE's MOSFET of LEVEL=2: ngspice's characteristics over the plane, effect by effect."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.compare.ngspice import run as ngspice_run

CARDS = {
    "body and lambda": "KP=3e-5 GAMMA=0.5 PHI=0.7 LAMBDA=0.02",
    "without body": "TOX=40n UO=600 GAMMA=0 LAMBDA=0.01",
    "narrow without body": "TOX=40n KP=2e-5 GAMMA=0 DELTA=1.5",
    "shortening": "TOX=25n NSUB=2e16 UO=550",
    "punch-through": "TOX=50n NSUB=5e14 UO=550",
    "short channel": "TOX=25n NSUB=2e16 XJ=0.3u LD=0.1u UO=550",
    "narrow": "TOX=50n NSUB=1e16 UO=550 DELTA=2 LAMBDA=0.03",
    "mobility": "TOX=40n NSUB=2e16 UO=600 UCRIT=2e4 UEXP=0.2",
    "weak inversion": "TOX=40n NSUB=2e16 UO=600 NFS=2e11",
    "process": "TOX=25n NSUB=2e16 XJ=0.3u LD=0.1u UO=550 UEXP=0.15 DELTA=0.9 NFS=3e11 RSH=20 "
    "CJ=3e-4 CGSO=2e-10 CGDO=2e-10",
}


@pytest.mark.parametrize(
    ("card", "sign"),
    [*((card, 1) for card in CARDS.values()), (CARDS["process"], -1)],
    ids=[*CARDS, "process, pmos"],
)
def test_characteristics_are_those_of_ngspice(card: str, sign: int, monkeypatch):
    """Both directions of the channel, the body blocks; with ngspice 39's constants of 2014.

    One transistor: with m= ngspice divides the narrow-channel effect by m, too.
    """
    from nsspice.devices import temperature
    from nsspice.devices.mosfets import level1_thermal, level2

    monkeypatch.setattr(temperature, "BOLTZMANN", 1.38064852e-23)
    for module in (temperature, level1_thermal, level2):
        monkeypatch.setattr(module, "CHARGE", 1.6021766208e-19)
    text = f"""t
M1 d g 0 b MX W=8u L=1.2u NRD=2 NRS=1
Vd d 0 0
Vg g 0 0
Vb b 0 {-3 * sign}
.model MX {"NMOS" if sign > 0 else "PMOS"}(LEVEL=2 VTO={0.8 * sign} {card})
.temp 60
.dc Vd {-2.9 * sign} {5.1 * sign} {0.5 * sign} Vg {-sign} {5 * sign} {0.4 * sign}
"""
    circuit = nsspice.read(text)
    mine = np.ravel(circuit.run()[0]["i(vd)"])
    theirs = np.ravel(ngspice_run(circuit, signals=["i(vd)"])["i(vd)"])
    assert np.abs(mine).max() > 1e-4
    assert np.abs(mine - theirs).max() <= 1e-6 * np.abs(theirs).max()


def test_a_body_that_conducts_is_that_of_ngspice():
    """0.3 V forward, the junction's own current off: values of ngspice 39, to its digits.

    Its constants of nature differ by 1e-6, which the threshold amplifies.
    """
    deck = "t\nM1 d g 0 b MX W=5u L=2u\nVd d 0 {}\nVg g 0 {}\nVb b 0 0.3\n"
    deck += ".model MX NMOS(LEVEL=2 TOX=40n NSUB=2e16 UO=600 XJ=0.3u VTO=0.7 IS=1e-30)\n.op\n"
    for (vd, vg), current in FORWARD.items():
        (point,) = nsspice.read(deck.format(vd, vg)).run()
        assert -point["i(vd)"][0] == pytest.approx(current, rel=2e-5)


#: drain current [A] by voltages of drain and gate
FORWARD = {
    (0.1, 1.0): 9.728878973e-06,
    (1.0, 1.0): 2.039649658e-05,
    (0.2, 2.0): 4.548548435e-05,
    (4.0, 2.0): 1.360186144e-04,
}


def test_an_inverter_switches_and_is_certified():
    """Of short transistors with all effects."""
    process = CARDS["process"]
    (run,) = nsspice.read(f"""inverter
VDD vdd 0 3
VIN a 0 PULSE(0 3 1n 0.2n 0.2n 5n 10n)
MP y a vdd vdd P W=16u L=1.2u
MN y a 0 0 N W=8u L=1.2u
CL y 0 50f
.model N NMOS(LEVEL=2 VTO=0.7 {process})
.model P PMOS(LEVEL=2 VTO=-0.8 {process})
.tran 0.1n 20n
.measure tran high FIND v(y) AT=0.5n
.measure tran low FIND v(y) AT=5n
""").run()
    assert run.certificate.passed
    assert run.measures["high"] == pytest.approx(3.0, abs=1e-3)
    assert run.measures["low"] == pytest.approx(0.0, abs=1e-3)


def test_velocity_saturation_is_refused():
    """Baum's polynomial of fourth degree is not simulated; a VMAX of zero is none."""
    deck = "t\nV1 d 0 1\nM1 d d 0 0 X\n.model X NMOS(LEVEL=2 GAMMA=0.1 VMAX={})\n.op\n"
    with pytest.raises(nsspice.NetlistError, match="velocity saturation of LEVEL=2"):
        nsspice.read(deck.format("5e4"))
    nsspice.read(deck.format(0))
