"""Capacitors in parallel that begin with unequal voltages share their charges: the loss is told."""

from __future__ import annotations

import pytest

import nsspice

SHARED = """capacitors in parallel
C1 a 0 1u IC=1
C2 a 0 3u
R1 a 0 1k
{more}
.ic v(a)=3
.tran 1u 20u uic
.model d D(IS=1e-14)
"""


@pytest.mark.parametrize("more", ["", "V1 b 0 1\nD1 b a d"])
@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_unequal_voltages_in_parallel_cost_energy(method: str, more: str) -> None:
    """The charge of 10 uC stays: 2.5 V; of 14 uJ 12.5 uJ are left.  No loss was told."""
    if more and method == "modewise":
        method = "sdirk"
    run = nsspice.tran(nsspice.read(SHARED.format(more=more)), method=method)
    (jump,) = run.jumps
    assert jump.time == 0.0
    assert jump.lost == pytest.approx(1.5e-6, rel=1e-12)
    moved = {m.element: (m.before, m.after) for m in jump.stores}
    assert moved["c1"] == pytest.approx((1e-6, 2.5e-6))
    assert moved["c2"] == pytest.approx((9e-6, 7.5e-6))
    energy = run.certificate.energy
    assert energy is not None
    assert energy.lost == pytest.approx(1.5e-6, rel=1e-12)
    gone = energy.delivered - energy.dissipated - energy.lost - energy.scheme
    assert energy.stored == pytest.approx(gone, rel=1e-9)


def test_equal_voltages_in_parallel_are_no_jump() -> None:
    deck = "alike\nC1 a 0 1u IC=3\nC2 a 0 3u\nR1 a 0 1k\n.ic v(a)=3\n.tran 1u 20u uic\n"
    assert not nsspice.tran(nsspice.read(deck)).jumps


def test_a_jump_begins_with_the_voltage_that_the_deck_gives_a_node() -> None:
    """It was told to begin with 0 V where ``.ic`` and no ``IC=`` gives the voltage."""
    deck = "conflict\nV1 a 0 1\nC1 a 0 1u\nR1 a 0 1k\n.ic v(a)=5\n.tran 1u 20u uic\n"
    (jump,) = nsspice.tran(nsspice.read(deck)).jumps
    (moved,) = jump.stores
    assert (moved.before, moved.after) == pytest.approx((5e-6, 1e-6))
