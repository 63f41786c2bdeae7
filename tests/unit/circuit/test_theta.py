"""The theta step on the MNA system is the theta step on the DLCP form."""

import itertools

import numpy as np
import pytest

from nsspice.circuit import build
from nsspice.circuit.dlcp import dlcp_form
from nsspice.circuit.normal_form import network_inputs, reference
from nsspice.circuit.theta import theta_terms
from nsspice.errors import NsspiceError
from nsspice.netlist import parse_text
from nsspice.problems.descriptor import Waveform


def value(wave: Waveform, t: float) -> float:
    if wave.kind == "dc":
        return wave.values[0]
    return wave.values[0] + wave.values[1] * np.sin(2 * np.pi * wave.values[2] * t)


def solve_by_enumeration(J, A, B, D, b, q):
    """Return z and lam of the mode that violates the signs least, and by how much."""
    n, m = J.shape[0], A.shape[1]
    best = (np.inf, np.zeros(n), np.zeros(m))
    for mode in itertools.product([False, True], repeat=m):
        act = np.array(mode, dtype=bool)
        K = np.block(
            [[J, A], [np.where(act[:, None], -B, 0.0), np.where(act[:, None], D, np.eye(m))]]
        )
        right = np.concatenate([b, np.where(act, -q, 0.0)])
        x = np.linalg.lstsq(K, right, rcond=1e-13)[0]
        if np.abs(K @ x - right).max() > 1e-9 * (1 + np.abs(right).max()):
            continue
        z, lam = x[:n], x[n:]
        w = q - B @ z + D @ lam
        bad = max(-lam.min(initial=0.0), -w.min(initial=0.0))
        if bad < best[0]:
            best = (bad, z, lam)
    return best


def random_deck(seed: int) -> str:
    rng = np.random.default_rng(seed)
    nodes = ["0", *(f"n{k}" for k in range(rng.integers(2, 5)))]
    lines = ["random network", "R99 n0 0 1k"]
    inductors = []
    for k, kind in enumerate(rng.choice(list("rrrcccllddvi"), size=rng.integers(3, 9))):
        a, b = rng.choice(nodes, 2, replace=False)
        size = 10 ** rng.uniform(-1, 1)
        if kind in "rcl":
            lines.append(f"{kind}{k} {a} {b} {size}")
            inductors += [f"l{k}"] * (kind == "l")
        elif kind == "d":
            lines.append(f"d{k} {a} {b} {rng.choice(['m1', 'm2', 'm3'])}")
        else:
            lines.append(
                f"{kind}{k} {a} {b} SIN({rng.normal()} {rng.normal()} {rng.uniform(0.1, 1)})"
            )
    if len(inductors) > 1:
        lines.append(f"K1 {inductors[0]} {inductors[1]} {rng.choice([0.5, 1.0])}")
    lines += [".model m1 d(vfwd=.3 ron=.1 roff=100 vrev=2)", ".model m2 d(vfwd=0.5)"]
    return "\n".join([*lines, ".model m3 d(ideal)", ""])


@pytest.mark.parametrize("seed", range(120))
@pytest.mark.parametrize("theta", [0.5, 0.3])
def test_equals_the_step_on_the_dlcp_form(seed, theta):
    try:
        circuit = build(parse_text(random_deck(seed)))
    except NsspiceError:
        return  # contradicting sources: refused by name, nothing to step
    h, t = 0.05, 0.3
    for island in circuit.islands:
        mna = island.assemble()
        s = mna.system
        if s.static or s.m > 8:
            continue
        form, network = dlcp_form(mna), reference(mna)
        H, Hs = (term.dense() for term in theta_terms(mna, theta))
        E, G, A, B, D, S = (m.dense() for m in (s.E, s.G, s.A, s.B, s.D, s.S))
        u0 = np.array([value(w, t) for w in s.waveforms])
        u1 = np.array([value(w, t + h) for w in s.waveforms])
        x0 = np.random.default_rng(seed).normal(size=len(form.states))
        start = np.concatenate([x0, np.zeros(s.m), u0, [1.0]])
        z0 = (network.solver()(network_inputs(network)) @ start)[: s.n]
        right = (E / h + H) @ z0 + (S - Hs) @ u1 + Hs @ u0
        bad, z1, lam = solve_by_enumeration(E / h + G + H, A, B, D, right, s.q)
        if bad > 1e-9:
            continue  # no solution at this time: contradicting sources through ideal elements
        w = s.q - B @ z1 + D @ lam
        u = np.where(network.in_tree, w, lam)
        y = np.where(network.in_tree, lam, w)
        x1 = network.incidence().dense().T @ z1
        old = (1 - theta) * (form.A @ x0 + form.F @ u0)
        new = theta * (form.A @ x1 + form.F @ u1)
        step = x0 + h * (old + new + form.B @ u + form.a) + form.F1 @ (u1 - u0)
        size = 1.0 + np.abs(z1).max() + np.abs(lam).max(initial=0.0)
        assert np.abs(step - x1).max(initial=0.0) < 1e-8 * size
        outputs = form.C @ x1 + form.D @ u + form.G @ u1 + form.c
        assert np.abs(outputs - y).max(initial=0.0) < 1e-8 * size


def test_theta_one_has_no_terms():
    mna = build(parse_text("t\nV1 a 0 1\nR1 a b 1\nC1 b 0 1\n")).islands[0].assemble()
    H, Hs = theta_terms(mna, 1.0)
    assert (H.data.size, Hs.data.size) == (0, 0)
    assert (H.shape, Hs.shape) == ((3, 3), (3, 1))


def test_rc_by_hand():
    """C v' = (V - v) / R: only this rate is averaged."""
    mna = build(parse_text("t\nV1 a 0 SIN(0 1 1)\nR1 a b 4\nC1 b 0 1\n")).islands[0].assemble()
    H, Hs = theta_terms(mna, 0.25)
    expected = np.zeros((3, 3))
    expected[1, 1] = 0.75 * -0.25
    assert H.dense() == pytest.approx(expected)
    assert Hs.dense().ravel() == pytest.approx([0.0, 0.75 * 0.25, 0.0])


def test_sparse_path_agrees_with_the_dense_one():
    lines = ["t", "V1 n0 0 SIN(0 1 50)", ".model dm d(ron=0.1 roff=10)"]
    for k in range(80):
        lines += [f"D{k} n{k} n{k + 1} dm", f"C{k} n{k + 1} 0 {1 + 0.1 * k}"]
    mna = build(parse_text("\n".join(lines) + "\n")).islands[0].assemble()
    network = reference(mna)
    assert network.matrix.shape[0] > 240
    H, Hs = (term.dense() for term in theta_terms(mna, 0.5))
    P = network.incidence().dense()
    n, m, k = mna.system.n, mna.system.m, len(network.states)
    rates = np.linalg.solve(network.matrix.dense(), network_inputs(network))[n + m :]
    assert pytest.approx(0.5 * P @ rates[:, :k] @ P.T, abs=1e-12) == H
    assert pytest.approx(0.5 * P @ rates[:, k + m : -1], abs=1e-12) == Hs
