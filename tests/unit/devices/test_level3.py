"""SPICE's MOSFET of LEVEL=3: ngspice's characteristics over the plane, effect by effect."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.compare.ngspice import run as ngspice_run

BASE = "KP=60u GAMMA=0.5 PHI=0.7 TOX=25n"
CARDS = {
    "body factor alone": BASE,
    "mobility": f"{BASE} THETA=0.08",
    "static feedback": f"{BASE} ETA=0.05",
    "narrow": f"{BASE} DELTA=1.2",
    "velocity": f"{BASE} VMAX=1.5e5 UO=500",
    "short channel": "TOX=25n NSUB=2e16 XJ=0.3u LD=0.1u UO=550 KAPPA=0",
    "shortening": "TOX=25n NSUB=2e16 UO=550 KAPPA=0.4",
    "shortening with velocity": "TOX=25n NSUB=2e16 UO=550 KAPPA=0.4 VMAX=1.5e5",
    "weak inversion": f"{BASE} NFS=4e11",
    "process": "TOX=25n NSUB=2e16 XJ=0.3u LD=0.1u UO=550 VMAX=1.6e5 THETA=0.06 ETA=0.04 DELTA=0.9"
    " KAPPA=0.3 NFS=3e11 RSH=20 CJ=3e-4 CGSO=2e-10 CGDO=2e-10",
}


@pytest.mark.parametrize(
    ("card", "sign"),
    [*((card, 1) for card in CARDS.values()), (CARDS["process"], -1)],
    ids=[*CARDS, "process, pmos"],
)
def test_characteristics_are_those_of_ngspice(card: str, sign: int, monkeypatch):
    """Both directions of the channel, the body blocks; with ngspice 39's constants of 2014."""
    from nsspice.devices import temperature
    from nsspice.devices.mosfets import level1_thermal, level3

    monkeypatch.setattr(temperature, "BOLTZMANN", 1.38064852e-23)
    for module in (temperature, level1_thermal, level3):
        monkeypatch.setattr(module, "CHARGE", 1.6021766208e-19)
    text = f"""t
M1 d g 0 b MX W=8u L=1.2u NRD=2 NRS=1 m=2
Vd d 0 0
Vg g 0 0
Vb b 0 {-3 * sign}
.model MX {"NMOS" if sign > 0 else "PMOS"}(LEVEL=3 VTO={0.8 * sign} {card})
.temp 60
.dc Vd {-2.9 * sign} {5.1 * sign} {0.5 * sign} Vg {-sign} {5 * sign} {0.4 * sign}
"""
    circuit = nsspice.read(text)
    mine = np.ravel(circuit.run()[0]["i(vd)"])
    theirs = np.ravel(ngspice_run(circuit, signals=["i(vd)"])["i(vd)"])
    assert np.abs(mine).max() > 1e-4
    assert np.abs(mine - theirs).max() <= 1e-6 * np.abs(theirs).max()


def test_an_inverter_switches_and_is_certified(runs_return):
    """Of short transistors with all effects."""
    process = CARDS["process"]
    (run,) = nsspice.read(f"""inverter
VDD vdd 0 3
VIN a 0 PULSE(0 3 1n 0.2n 0.2n 5n 10n)
MP y a vdd vdd P W=16u L=1.2u
MN y a 0 0 N W=8u L=1.2u
CL y 0 50f
.model N NMOS(LEVEL=3 VTO=0.7 {process})
.model P PMOS(LEVEL=3 VTO=-0.8 {process})
.tran 0.1n 20n
.measure tran high FIND v(y) AT=0.5n
.measure tran low FIND v(y) AT=5n
""").run()
    assert run.certificate.passed
    assert run.measures["high"] == pytest.approx(3.0, abs=1e-3)
    assert run.measures["low"] == pytest.approx(0.0, abs=1e-3)


def test_what_the_square_law_has_alone_is_inert():
    circuit = nsspice.read("t\nV1 d 0 1\nM1 d d 0 0 X\n.model X NMOS(LEVEL=3 LAMBDA=0.1)\n.op\n")
    assert any("lambda" in w.message for w in circuit.warnings)
