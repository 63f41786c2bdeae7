"""A three-phase drive whose current controllers saturate: exact, and as fast as without limits."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.devices.expressions import behavioural

DECK = """three-phase inverter with saturating current controllers
.param f=50 fs=10k ip=30
Vp dp 0 300
Vn 0 dn 300
Vtri tri 0 PULSE(-1 1 0 {0.5/fs} {0.5/fs} 0 {1/fs})
.subckt leg dp dn a ref tri
S1 dp a ref tri SM
D1 a dp DM
S2 a dn tri ref SM
D2 dn a DM
.ends
.subckt pi ir im m
Ge 0 x ir im 0.02
Ci x 0 100u IC=0
Rx x 0 1meg
Ep y 0 ir im 0.08
Em m 0 VALUE={LAW}
.ends
X1 dp dn a ma tri leg
X2 dp dn b mb tri leg
X3 dp dn c mc tri leg
Ra a a1 0.5
La a1 a2 5m IC=0
Va a2 n SIN(0 150 {f} 0 0 0)
Rb b b1 0.5
Lb b1 b2 5m IC=0
Vb b2 n SIN(0 150 {f} 0 0 -120)
Rc c c1 0.5
Lc c1 c2 5m IC=0
Vc c2 n SIN(0 150 {f} 0 0 120)
Rn n 0 1meg
Hia ia 0 Va 1
Hib ib 0 Vb 1
Hic ic 0 Vc 1
Vra ra 0 SIN(0 {ip} {f} 0 0 0)
Vrb rb 0 SIN(0 {ip} {f} 0 0 -120)
Vrc rc 0 SIN(0 {ip} {f} 0 0 120)
XA ra ia ma pi
XB rb ib mb pi
XC rc ic mc pi
.model SM SW(Ron=1m Roff=1meg VT=0)
.model DM D(ideal)
.tran 20u 10m uic
"""
SATURATED = DECK.replace("LAW", "limit(v(x)+v(y), -0.9, 0.9)")
FREE = DECK.replace("LAW", "v(x)+v(y)")


def test_the_drive_is_exact_and_its_controllers_saturate(monkeypatch: pytest.MonkeyPatch) -> None:
    """Against steps with error control on a tape; 200 commutations, each off by 1e-10 of 20 A."""
    exact = nsspice.tran(nsspice.read(SATURATED))
    assert {island.method for island in exact.islands} == {"modewise"}
    largest = max(abs(exact.minimum(f"v(m{p})")) for p in "abc")
    assert largest == pytest.approx(0.9, rel=1e-13)
    monkeypatch.setattr(behavioural, "piecewise", lambda node, name: None)
    steps = nsspice.tran(nsspice.read(SATURATED), method="sdirk", reltol=1e-10)
    for name in ("i(va)", "i(vb)", "i(vc)"):
        assert np.abs(exact[name] - steps[name]).max() < 1e-6


def test_a_limiter_costs_no_more_than_its_events() -> None:
    """Work is counted in intervals with a closed form of their own, not in seconds."""
    counts = []
    for text in (FREE, SATURATED):
        (drive,) = [
            r for r in nsspice.tran(nsspice.read(text)).islands if r.stats.get("segments", 0) > 9
        ]
        counts.append(drive.stats["segments"])
    assert counts[1] <= 2 * counts[0]
