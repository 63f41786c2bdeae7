"""SPICE's JFET: ngspice's characteristics and edges, its cards."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.circuit import build
from nsspice.compare.ngspice import run as ngspice_run
from nsspice.errors import NetlistError
from nsspice.netlist import parse_text

CARDS = {
    "channel": "VTO=-2 BETA=1m",
    "resistances": "VTO=-3 BETA=1m LAMBDA=0.02 RD=10 RS=5 IS=1p",
    "temperature": "VTO=-2 BETA=1m LAMBDA=0.01 TCV=2m BEX=-1.5",
    "other coefficients": "VTO=-2 BETA=1m VTOTC=-2m BETATCE=-0.5 XTI=3 EG=1.0",
}


@pytest.mark.parametrize("sign", [1, -1], ids=["njf", "pjf"])
@pytest.mark.parametrize("card", CARDS.values(), ids=CARDS)
def test_characteristics_are_those_of_ngspice(card: str, sign: int):
    kind = "NJF" if sign > 0 else "PJF"
    text = f"""t
J1 d g 0 MX 2 m=3
Vd d 0 0
Vg g 0 0
.model MX {kind}({card})
.temp 60
.dc Vd {-2 * sign} {8 * sign} {0.5 * sign} Vg {-4 * sign} {-1.75 * sign} {0.25 * sign}
"""
    circuit = nsspice.read(text)
    (solution,) = circuit.run()
    other = ngspice_run(circuit, signals=["i(vd)"])
    mine, theirs = np.ravel(solution["i(vd)"]), np.ravel(other["i(vd)"])
    conducts = np.abs(theirs).max()
    assert conducts > 1e-4
    assert np.abs(mine - theirs).max() <= 1e-6 * conducts


def test_edges_are_those_of_ngspice():
    text = """t
Vdd vdd 0 10
R1 vdd d 1k
Vg g1 0 PULSE(-4 0 10n 5n 5n 100n 200n)
Rg g1 g 100
J1 d g 0 MX
.model MX NJF(VTO=-2 BETA=5m LAMBDA=0.01 RD=5 RS=5 CGS=5p CGD=3p PB=0.8 IS=1e-13)
.tran 1n 180n
"""
    circuit = nsspice.read(text)
    (solution,) = circuit.run()
    other = ngspice_run(circuit, signals=["v(d)", "v(g)"], max_step=5e-11)
    for name in ("v(d)", "v(g)"):
        theirs = np.interp(solution.time, other.time, other[name])
        assert np.abs(solution[name] - theirs).max() <= 1e-3 * 10.0


def test_gate_currents_and_initial_voltages():
    text = """t
J1 d g 0 MX ic=3,-1
Rg g 0 1k
Rd d 0 1meg
.model MX NJF(VTO=-2 BETA=1m CGS=5p CGD=3p)
.save v(g) v(d) i(j1) i(j1.g) i(j1.s)
.tran 1p 10p uic
"""
    (solution,) = nsspice.read(text).run()
    assert solution["v(g)"][0] == pytest.approx(-1.0, abs=1e-9)
    assert solution["v(d)"][0] == pytest.approx(3.0, abs=1e-9)
    total = solution["i(j1)"] + solution["i(j1.g)"] + solution["i(j1.s)"]
    assert np.abs(total).max() <= 1e-12


@pytest.mark.parametrize(
    ("card", "code"),
    [
        ("NJF(BETA=0)", "NS2005"),
        ("NJF(CGS=-1p)", "NS2005"),
        ("NJF(B=0.5)", "NS2008"),
        ("NJF(LEVEL=2)", "NS2008"),
        ("NJF(KP=1)", "NS2003"),
        ("NPN", "NS2002"),
    ],
)
def test_wrong_cards(card: str, code: str):
    with pytest.raises(NetlistError) as caught:
        build(parse_text(f"t\nVd d 0 1\nVg g 0 1\nJ1 d g 0 X\n.model X {card}\n"))
    assert code in [d.code for d in caught.value.diagnostics]
