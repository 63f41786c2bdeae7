"""Several coupled windings, and sources controlled by currents, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice


def run(text: str, stop: float, rows: int = 200):
    """Run mode by mode from given initial values; every step has to be exact."""
    sol = nsspice.tran(
        nsspice.read(text), stop=stop, row_step=stop / rows, uic=True, method="modewise"
    )
    assert sol.certificate.passed
    assert sol.stats["fixed_steps"] == 0
    return sol


@pytest.mark.parametrize("count", [3, 4])
def test_loosely_coupled_windings(count):
    """M i' = -R i + u with 10 V, 1 kHz: eigenvectors and the driven part."""
    self_inductance = np.array([1.0, 4.0, 2.0, 0.5])[:count] * 1e-3
    loads = np.array([1.0, 8.0, 5.0, 3.0])[:count]
    factor = {(1, 2): 0.9, (1, 3): 0.8, (2, 3): 0.85, (1, 4): 0.7, (2, 4): 0.75, (3, 4): 0.6}
    lines = ["windings", "V1 a 0 SIN(0 10 1k)", "R1 a w1 1"]
    matrix = np.diag(self_inductance)
    for k in range(count):
        lines.append(f"L{k + 1} w{k + 1} 0 {float(self_inductance[k])!r} IC=0")
        if k:
            lines.append(f"R{k + 1} w{k + 1} 0 {float(loads[k])!r}")
    for (i, k), c in factor.items():
        if k <= count:
            lines.append(f"K{i}{k} L{i} L{k} {c}")
            mutual = c * np.sqrt(self_inductance[i - 1] * self_inductance[k - 1])
            matrix[i - 1, k - 1] = matrix[k - 1, i - 1] = mutual
    sol = run("\n".join(lines) + "\n", 2e-3)
    rates = -np.linalg.solve(matrix, np.diag(loads))
    drive = np.linalg.solve(matrix, np.eye(count)[0])
    w = 2e3 * np.pi
    driven = 10.0 * np.linalg.solve(1j * w * np.eye(count) - rates, drive.astype(complex))
    own, vectors = np.linalg.eig(rates)
    share = np.linalg.solve(vectors, -driven.imag)
    t = sol.time
    exact = np.imag(driven[:, None] * np.exp(1j * w * t))
    exact += np.real(vectors @ (share[:, None] * np.exp(np.outer(own, t))))
    for k in range(count):
        assert np.abs(sol[f"i(l{k + 1})"] - exact[k]).max() < 1e-13 * np.abs(exact).max()


def test_four_perfectly_coupled_windings():
    """One flux in all: the loads act on the first winding as g = sum (turns ratio)^2 / R."""
    lines = ["perfect", "V1 a 0 SIN(0 10 1k)", "R1 a w1 1"]
    turns, loads = [1.0, 2.0, 3.0, 0.5], [0.0, 8.0, 18.0, 1.0]
    for k in range(4):
        lines.append(f"L{k + 1} w{k + 1} 0 {turns[k] ** 2 * 1e-3!r} IC=0")
        lines += [f"K{i + 1}{k + 1} L{i + 1} L{k + 1} 1" for i in range(k)]
        if k:
            lines.append(f"R{k + 1} w{k + 1} 0 {loads[k]!r}")
    sol = run("\n".join(lines) + "\n", 2e-3)
    # v = 10 sin - i_m - (g - 1) v with g - 1 = 0.5 + 0.5 + 0.25, and 1 mH i_m' = v
    g, w, t = 2.25, 2e3 * np.pi, sol.time
    flux = 10.0 / (1.0 + 1j * w * 1e-3 * g)
    v = np.imag(1j * w * 1e-3 * flux * np.exp(1j * w * t))
    v += flux.imag / g * np.exp(-t / (1e-3 * g))
    for k in range(4):
        assert np.abs(sol[f"v(w{k + 1})"] - turns[k] * v).max() < 1e-13


def test_a_perfect_transformer_of_three_windings_resets_through_a_diode():
    """Flux built up by one winding comes out of another: a forward converter's core.

    10 V for 1 ms on 10 mH: 1 A, through a switch.  The third winding, of the same turns, gives it
    back to the source through a diode at once, at the same voltage: zero after another millisecond.
    The second, with half the turns, shows +-5 V.
    """
    text = (
        "reset\nVg g 0 PWL(0 1 1m 1 1m 0)\nV1 a 0 10\nS1 a p g 0 SW\nL1 p 0 10m IC=0\n"
        "L2 s 0 2.5m IC=0\nR2 s 0 1meg\nL3 0 r 10m IC=0\nD1 r a DI\n"
        "K12 L1 L2 1\nK13 L1 L3 1\nK23 L2 L3 1\n.model SW SW(VT=0.5)\n.model DI D(ideal)\n"
    )
    sol = run(text, 3e-3, 300)
    t = sol.time
    before, reset = t < 1e-3 - 1e-9, (t > 1e-3 + 1e-9) & (t < 2e-3 - 1e-6)
    load = 2.5e-6  # of the megohm, seen from the first winding
    assert np.abs(sol["v(s)"][before] - 5.0).max() < 1e-13
    assert np.abs(sol["v(s)"][reset] + 5.0).max() < 1e-13
    assert np.abs(sol["i(l1)"][before] - 1e3 * t[before] - load).max() < 1e-13
    assert np.abs(sol["i(d1)"][reset] - (2.0 - 1e3 * t[reset] - load)).max() < 1e-13
    assert np.abs(sol["v(s)"][t > 2e-3 + 1e-6]).max() < 1e-13


def test_a_mirror_of_the_current_of_a_diode():
    """F takes three times the current of a rectifier into a capacitor: charge in closed form."""
    text = (
        "mirror\nV1 a 0 SIN(0 2 1k)\nR1 a b 4\nD1 b c DI\nVs c 0 0\nF1 0 x Vs 3\nC1 x 0 1m IC=0\n"
        "H1 h 0 Vs 7\nRh h 0 1\n.model DI D(ideal)\n"
    )
    sol = run(text, 3e-3, 300)
    t, w = sol.time, 2e3 * np.pi
    turns, phase = np.floor(t * 1e3 + 1e-9), np.minimum(w * t % (2 * np.pi), np.pi)
    phase = np.where(np.abs(w * t - 2 * np.pi * turns) < 1e-9, 0.0, phase)
    charge = 0.5 / w * (2.0 * turns + 1.0 - np.cos(phase))
    assert np.abs(sol["v(x)"] - 3.0 * charge / 1e-3).max() < 1e-13
    current = np.maximum(0.0, 0.5 * np.sin(w * t))
    assert np.abs(sol["v(h)"] - 7.0 * current).max() < 1e-13


def test_a_gyrator_of_two_sources_makes_an_inductor_of_a_capacitor():
    """H with 50 Ohm both ways: 1 uF looks like 2.5 mH, and swings once through a diode."""
    text = (
        "gyrator\nC1 a 0 1u IC=10\nD1 a b DI\nVi b p 0\nH1 p 0 Vo 50\nH2 q 0 Vi 50\nVo q r 0\n"
        "C2 r 0 1u IC=0\n.model DI D(ideal)\n"
    )
    sol = run(text, 4e-4, 200)
    w = 1.0 / np.sqrt(1e-6 * 50.0**2 * 1e-6)
    half = np.minimum(w * sol.time, np.pi)
    assert np.abs(sol["v(a)"] - 10.0 * np.cos(half)).max() < 1e-12
    assert np.abs(sol["i(d1)"] - 10.0 * 1e-6 * w * np.sin(half)).max() < 1e-14
    (on,) = {event.time for event in sol.events if event.change == "off"}
    assert on == pytest.approx(np.pi / w, rel=1e-13)
