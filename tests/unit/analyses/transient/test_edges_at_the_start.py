"""An ideal edge of a source at t = 0: the operating point is before it, the run begins with it."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

METHODS = ["modewise", "sdirk", "moreau"]
STEP = "V1 a 0 {wave}\nR1 a b 1k\nC1 b 0 1u\n.op\n.tran 10u 2m\n"
EDGES = ["PULSE(2 10 0 0 0 1 2)", "PWL(0 2 0 10)", "PWL(-1 2 0 2 0 10 1 10)"]


@pytest.mark.parametrize("wave", EDGES)
@pytest.mark.parametrize("method", METHODS)
def test_a_step_response_starts_from_rest(method: str, wave: str) -> None:
    circuit = nsspice.read("step response\n" + STEP.format(wave=wave))
    assert nsspice.op(circuit)["v(b)"][0] == 2.0
    # implicit Euler errs by about h / (2 R C) of its decay, the others by their tolerance
    step, allowed = (1e-7, 4e-4) if method == "moreau" else (None, 1e-6)
    run = nsspice.tran(circuit, method=method, step=step)
    assert run["v(a)"][0] == pytest.approx(10.0, rel=1e-12)
    exact = 10.0 - 8.0 * np.exp(-run.time / 1e-3)
    assert np.abs(run["v(b)"] - exact).max() <= allowed * 8.0
    assert not run.impulses


@pytest.mark.parametrize("method", METHODS)
def test_an_edge_across_a_capacitor_is_an_impulse(method: str) -> None:
    """2 V to 10 V on 1 uF: a charge of 8 uC at 10 V, of which the capacitor keeps 48 uJ."""
    circuit = nsspice.read("jump\nV1 a 0 PULSE(2 10 0 0 0 1 2)\nC1 a 0 1u\n.tran 10u 1m\n")
    run = nsspice.tran(circuit, method=method)
    (jump,) = run.jumps
    assert jump.time == 0.0
    charges = {impulse.element: impulse.value for impulse in jump.impulses}
    assert charges["v1"] == pytest.approx(-8e-6, rel=1e-9)
    assert jump.before == pytest.approx(2e-6, rel=1e-9)
    assert jump.after == pytest.approx(50e-6, rel=1e-9)
    assert jump.delivered == pytest.approx(80e-6, rel=1e-9)
    assert run.certificate.passed


@pytest.mark.parametrize("method", METHODS)
def test_a_switch_with_hysteresis_remembers_the_operating_point(method: str) -> None:
    """The control falls from 5 V to 3 V at 0, between the thresholds: what was closed stays so."""
    text = """memory
    V1 c 0 PULSE({start} 3 0 0 0 1 2)
    V2 a 0 1
    S1 a b c 0 SW
    R1 b 0 1k
    C1 b 0 1u
    .model SW SW(VT=3 VH=1 RON=0)
    .tran 10u 1m
    """
    high = nsspice.tran(nsspice.read(text.format(start=5)), method=method)
    low = nsspice.tran(nsspice.read(text.format(start=0)), method=method)
    assert np.abs(high["v(b)"] - 1.0).max() <= 1e-9
    assert np.abs(low["v(b)"]).max() <= 1e-9


def test_a_circuit_without_memory_follows_the_edge() -> None:
    circuit = nsspice.read(
        "clamp\nV1 a 0 PULSE(-1 1 0 0 0 2 4)\nR1 a b 1k\nD1 b 0\n.op\n.tran 0.1 1\n"
    )
    assert nsspice.op(circuit)["v(b)"][0] == -1.0
    run = nsspice.tran(circuit)
    assert np.abs(run["v(b)"]).max() == 0.0


@pytest.mark.parametrize("phase", [0, 180, -180, 360, 540])
def test_a_sine_of_half_a_turn_starts_at_zero(phase: int) -> None:
    """sin(pi) is 1.2e-16 in doubles, which ideal diodes across the source would not bear."""
    sign = -1.0 if phase % 360 else 1.0
    deck = f"phase\nV1 a 0 SIN(0 {-sign} 1k 0 0 {phase})\nD1 a 0\nR1 a 0 1\n.tran 1u 0.4m uic\n"
    run = nsspice.tran(nsspice.read(deck))
    assert run["v(a)"][0] == 0.0
    assert run["v(a)"] == pytest.approx(-np.sin(2e3 * np.pi * run.time), abs=1e-12)
