"""What signals depend on, and that nothing else is simulated: the same values, and a word on it."""

from __future__ import annotations

import json

import numpy as np
import pytest

import nsspice
from nsspice.circuit.dependencies import needed

TWO = """two islands, of which one is asked for
V1 a 0 SIN(0 10 50)
D1 a b
C1 b 0 100u
R1 b 0 1k
V2 c 0 PULSE(0 10 0 0 0 0.5u 1u)
S2 c d c 0 sw
L2 d e 10u
C2 e 0 10u
R2 e 0 1
.model sw SW(VT=5)
.tran 10u 1m
"""
#: a bus that feeds two converters, a controller with a buffer, a measurement filter behind one
SHARED = """bus
Vbus in 0 24
Vs sense 0 0
Vg g 0 PULSE(0 1 0 0 0 3u 10u)
S1 in x g 0 sw
D1 0 x
L1 x out 100u IC=0
C1 out 0 10u IC=0
R1 out sense 5
S2 in y g 0 sw
D2 0 y
L2 y out2 100u IC=0
R2 out2 0 5
Emeas m 0 out 0 0.1
Rm m f 1k
Cm f 0 1n IC=0
Hi h 0 Vs 2
Bp p 0 V={v(out)*i(vs)}
K3 La Lb 0.9
La in w 1m
Ra w 0 10
Lb s 0 1m
Rb s 0 10
.model sw SW(VT=0.5)
.tran 1u 200u uic
"""


@pytest.mark.parametrize(
    ("signal", "kept"),
    [
        ("v(out)", "vbus vs vg s1 d1 l1 c1 r1"),
        ("v(out2)", "vbus vg s2 d2 l2 r2"),
        ("v(f)", "vbus vs vg s1 d1 l1 c1 r1 emeas rm cm"),
        ("v(m)", "vbus vs vg s1 d1 l1 c1 r1 emeas"),
        ("i(emeas)", "vbus vs vg s1 d1 l1 c1 r1 emeas rm cm"),
        ("v(h)", "vbus vs vg s1 d1 l1 c1 r1 hi"),
        ("v(p)", "vbus vs vg s1 d1 l1 c1 r1 bp"),
        ("v(s)", "vbus k3 la ra lb rb"),  # coupled inductors belong together
        ("v(in)", "vbus"),
        ("p(r2)", "vbus vg s2 d2 l2 r2"),
        ("v(out,out2)", "vbus vs vg s1 d1 l1 c1 r1 s2 d2 l2 r2"),
    ],
)
def test_what_a_signal_depends_on(signal: str, kept: str) -> None:
    circuit = nsspice.read(SHARED)
    part, skipped = needed(circuit, [signal])
    assert [device.name for device in part.devices] == kept.split()
    assert set(skipped.elements) == {d.name for d in circuit.devices} - set(kept.split())
    # what is left out does not matter: but for rounding, in another order of elimination
    if signal != "v(p)":  # without it the exact engine simulates all of it
        circuit = nsspice.read(SHARED.replace("Bp p 0", "*"))
        skipped = needed(circuit, [signal])[1]
    few = nsspice.tran(circuit, signals=[signal])
    all_of_it = nsspice.tran(circuit, signals=[signal], everything=True)
    scale = max(1.0, float(np.abs(all_of_it[signal]).max()))
    # steps of 1e-5 follow a smooth law
    tolerance = 1e-3 if signal == "v(p)" else 1e-10
    assert np.abs(few[signal] - all_of_it[signal]).max() <= tolerance * scale
    assert few.certificate.skipped == skipped
    assert not all_of_it.certificate.skipped


def test_the_current_of_a_bus_is_that_of_all_it_feeds() -> None:
    circuit = nsspice.read(SHARED)
    part, _ = needed(circuit, ["i(vbus)"])
    assert {"s1", "s2", "la", "lb", "k3"} <= {device.name for device in part.devices}
    assert "emeas" not in {device.name for device in part.devices}


def test_the_exact_engine_is_kept_where_what_is_smooth_is_not_asked_for() -> None:
    """A product of two signals that drives nothing does not take the converter off closed forms."""
    circuit = nsspice.read(SHARED)
    assert [i.method for i in nsspice.tran(circuit, signals=["v(out)"]).islands] == ["modewise"]
    methods = [i.method for i in nsspice.tran(circuit, signals=["v(out)", "v(p)"]).islands]
    # where it is asked for, a block of its own
    assert methods == ["modewise", "point by point"]


def test_measures_count_and_all_points_too() -> None:
    text = TWO + ".save v(b)\n.meas tran x MAX v(e)\n"
    (sol,) = nsspice.read(text).run()
    assert not sol.certificate.skipped
    (sol,) = nsspice.read(TWO + ".save v(b)\n.meas tran x MAX v(b)\n").run(all_points=True)
    assert sol.certificate.skipped.elements == ("v2", "s2", "l2", "c2", "r2")
    assert "not simulated: v2, s2, l2, c2, r2" in sol.summary()
    assert json.loads(json.dumps(sol.to_dict()))["certificate"]["skipped"][0] == "v2"
    # what was left out is simulated when somebody asks for it
    (sol,) = nsspice.read(TWO + ".save v(b)\n").run()
    whole = nsspice.tran(nsspice.read(TWO))
    assert sol.average("v(e)") == pytest.approx(whole.average("v(e)"), rel=1e-9)


def test_without_a_choice_everything_is_simulated() -> None:
    assert len(nsspice.tran(nsspice.read(TWO)).islands) == 2


def test_an_island_that_nobody_asks_for_costs_nothing() -> None:
    """5000 periods of the second island take 10000 times the work of the whole first one."""
    circuit = nsspice.read(TWO)
    alone, both = (
        nsspice.tran(circuit, signals=["v(b)"], everything=everything).stats["work"]
        for everything in (False, True)
    )
    assert 0 < alone < 1e-3 * both
