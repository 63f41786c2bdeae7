"""Which circuits are watched for several solutions: those with gain in a loop, no others."""

from __future__ import annotations

import pytest
from decks.chattering import CONTROLLED

import nsspice

BRIDGE = """A leg with diodes whose gates are made by controlled sources
Vp p 0 100
Vr r 0 SIN(0 1 50)
Vcar car 0 PULSE(-1 1 0 50u 50u 0 100u)
S1 p a ref car sw
S2 a 0 car ref sw
D1 a p
D2 0 a
L1 a b 1m
R1 b 0 10
.model sw SW(VT=0)
.tran 10u 1m uic
"""
FROM_SOURCES = "E1 ref 0 r 0 -0.9\n"
# current control: the reference less what the load carries
FROM_THE_LOAD = "Vs b s 0\nR2 s 0 10\nH1 il 0 Vs 0.1\nE1 ref il r 0 1\n"
# a gain of 3 from the load back into it
FEEDBACK = "E1 ref 0 r 0 1\nE2 f 0 b 0 3\nR3 f a 5\n"


def passive(control: str) -> bool:
    islands = nsspice.read(BRIDGE + control).islands
    systems = [i.assemble().system for i in islands]
    (system,) = [s for s in systems if s.m]
    return system.passive


@pytest.mark.parametrize("control", [FROM_SOURCES, FROM_THE_LOAD])
def test_what_only_observes_is_no_gain(control: str) -> None:
    assert passive(control)


def test_gain_in_a_loop_is_seen() -> None:
    assert not passive(FEEDBACK)


def test_an_inverter_is_not_warned_about() -> None:
    run = nsspice.tran(nsspice.read(BRIDGE + FROM_SOURCES))
    assert not [w for w in run.warnings if w.code == "NS3050"]
    assert run.certificate.several == ()


def test_sources_of_floating_gates_are_no_gain() -> None:
    (island,) = nsspice.read(CONTROLLED).islands
    assert island.assemble().system.passive
    # a source that carries a current of the network acts upon it
    loaded = CONTROLLED.replace("B1 g1 p V", "R2 g1 n 100\nB1 g1 p V")
    (island,) = nsspice.read(loaded).islands
    assert not island.assemble().system.passive


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_a_controlled_bridge_is_told_of_without_noise(method: str) -> None:
    """Steps count once, however many stages; what mends errors of steps is no jump."""
    run = nsspice.tran(nsspice.read(CONTROLLED), method=method)
    assert run.warnings == []
    assert run.certificate is not None
    assert run.certificate.passed
    assert run.certificate.several == ()
    assert run.jumps == []
    (island,) = run.islands
    assert island.stats["jumps"] == 0
    if method == "sdirk":
        # commutation takes arccos(1/2 - 2 w L i / V) - pi/3 of 2 pi at most, once in 10 ms
        assert 0 < run.certificate.undetermined < 0.2 * island.stats["steps"]
