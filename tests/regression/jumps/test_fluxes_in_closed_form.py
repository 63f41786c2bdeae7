"""Currents of inductors at t = 0 that have no way, or one through megohms: first output points."""

from __future__ import annotations

import pytest

import nsspice

METHODS = ["modewise", "moreau", "sdirk"]


@pytest.mark.parametrize("method", METHODS)
def test_a_current_against_two_diodes_back_to_back_ends_at_once(method: str) -> None:
    """The flux jumps to zero, and its energy, 1 mH (1 A)^2 / 2, is lost."""
    run = nsspice.tran(
        nsspice.read("""an inductor into two diodes back to back
V1 a 0 5
L1 a b 1m IC=1
D1 b c
D2 d c
R1 d 0 10
.tran 1u 10u uic
"""),
        method=method,
    )
    assert run.certificate.passed
    assert abs(run["i(l1)"]).max() == 0.0
    # nothing drives a current: the inductor has no voltage, and no current leaves the resistor
    assert run["v(b)"][0] == pytest.approx(5.0, rel=1e-14)
    assert run["v(d)"][0] == 0.0
    (jump,) = run.jumps
    assert jump.time == 0.0
    assert jump.lost == pytest.approx(0.5e-3, rel=1e-14)


@pytest.mark.parametrize("method", METHODS)
def test_a_current_through_megohms_begins_whole(method: str) -> None:
    """1 mA through 10 MOhm between nodes that capacitors hold: its time constant is 0.1 ns."""
    run = nsspice.tran(
        nsspice.read("""an inductor in series with 10 MOhm
C1 a b 1u IC=2
C0 b 0 1n IC=1
L1 a c 1m IC=1m
R1 c b 10meg
.tran 1u 10u uic
"""),
        method=method,
    )
    assert run.certificate.passed
    assert run["i(l1)"][0] == pytest.approx(1e-3, rel=1e-12)
    # v(b) and the drop of 10 kV
    assert run["v(c)"][0] == pytest.approx(10001.0, rel=1e-12)
    assert run["v(a,b)"][0] == pytest.approx(2.0, rel=1e-12)
