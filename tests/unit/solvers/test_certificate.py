"""Proofs of infeasibility: the named conflict, scaling, switches, and agreement with the driver."""

from __future__ import annotations

import numpy as np
import pytest

from nsspice.problems.csc import Csc
from nsspice.solvers import solve_mlcp
from nsspice.solvers.certificate import CLOSED, OPEN, Certificate, infeasibility


class Net:
    """A static network: rows are node currents, then branch voltages; node 0 is ground."""

    def __init__(self, nodes: int) -> None:
        self.nodes = nodes
        self.k: list[tuple[int, int, float]] = []
        self.a: list[tuple[int, int, float]] = []
        self.b = [0.0] * nodes
        self.q: list[float] = []
        self.d: list[float] = []
        self.roles: list[int] = []

    def ends(self, a: int, c: int) -> list[tuple[int, float]]:
        return [(node - 1, s) for node, s in ((a, 1.0), (c, -1.0)) if node]

    def resistor(self, a: int, c: int, ohms: float) -> Net:
        ends = self.ends(a, c)
        self.k += [(i, j, s * t / ohms) for i, s in ends for j, t in ends]
        return self

    def voltage(self, a: int, c: int, volts: float) -> Net:
        row = len(self.b)
        for node, s in self.ends(a, c):
            self.k += [(node, row, s), (row, node, -s)]
        self.b.append(-volts)
        return self

    def current(self, a: int, c: int, amps: float) -> Net:
        for node, s in self.ends(a, c):
            self.b[node] -= s * amps
        return self

    def pair(self, a: int, c: int, drop: float = 0.0, ohms: float = 0.0, role: int = 0) -> Net:
        self.a += [(node, len(self.q), s) for node, s in self.ends(a, c)]
        self.q.append(drop)
        self.d.append(ohms)
        self.roles.append(role)
        return self

    def arrays(self) -> tuple[Csc, Csc, Csc, Csc, np.ndarray, np.ndarray]:
        n, m = len(self.b), len(self.q)
        k = Csc.from_triplets((n, n), *zip(*self.k, strict=True)) if self.k else Csc.zeros((n, n))
        rows, cols, values = zip(*self.a, strict=True) if self.a else ([], [], [])
        a = Csc.from_triplets((n, m), rows, cols, values)
        b = Csc.from_triplets((m, n), cols, rows, values)
        d = Csc.from_dense(np.diag(np.array(self.d)))
        return k, a, b, d, np.array(self.b), np.array(self.q)

    def proof(self) -> Certificate | None:
        return infeasibility(*self.arrays(), self.roles)


def verify(net: Net, proof: Certificate) -> None:
    """Check the definition of the proof, term by term."""
    K, A, B, D, b, q = (x.dense() if isinstance(x, Csc) else x for x in net.arrays())
    roles = np.array(net.roles)
    size = np.abs(K.T) @ np.abs(proof.y) + np.abs(B.T) @ np.abs(proof.p)
    assert (np.abs(K.T @ proof.y + B.T @ proof.p) <= 1e-7 * size + 1e-300).all()
    slope = A.T @ proof.y - D.T @ proof.p
    size = np.abs(A.T) @ np.abs(proof.y) + np.abs(D.T) @ np.abs(proof.p)
    assert (slope[roles == 0] >= -1e-7 * size[roles == 0]).all()
    assert (np.abs(slope[roles == CLOSED]) <= 1e-7 * size[roles == CLOSED] + 1e-300).all()
    assert (proof.p[roles == 0] >= 0.0).all()
    assert (proof.p[roles == OPEN] == 0.0).all()
    assert b @ proof.y + q @ proof.p == pytest.approx(-1.0, rel=1e-6)


@pytest.mark.parametrize("count", [1, 2, 3])
@pytest.mark.parametrize("volts", [1e-9, 5.0, 1e7])
def test_source_across_forward_diodes(count, volts):
    net = Net(count).voltage(1, 0, volts)
    for k in range(1, count + 1):
        net.pair(k, 0 if k == count else k + 1)
    proof = net.proof()
    assert proof is not None
    assert proof.rows.tolist() == [count]
    assert proof.pairs.tolist() == list(range(count))
    verify(net, proof)


def test_forward_drop_carries_the_source_or_not():
    assert Net(1).voltage(1, 0, 0.6).pair(1, 0, drop=0.7).proof() is None
    assert Net(1).voltage(1, 0, 0.8).pair(1, 0, drop=0.7).proof() is not None
    assert Net(1).voltage(1, 0, 0.8).pair(1, 0, drop=0.7, ohms=1e-12).proof() is None


def test_unequal_parallel_sources():
    net = Net(1).voltage(1, 0, 5.0).voltage(1, 0, 4.0).resistor(1, 0, 1.0)
    proof = net.proof()
    assert proof is not None
    assert proof.rows.tolist() == [1, 2]
    assert proof.pairs.size == 0
    verify(net, proof)
    assert Net(1).voltage(1, 0, 5.0).voltage(1, 0, 5.0).proof() is None


def test_current_against_a_diode_names_the_node():
    net = Net(3).voltage(1, 0, 5.0).resistor(1, 2, 10.0).resistor(2, 0, 10.0)
    net.current(3, 0, 1e-3).pair(3, 2)
    proof = net.proof()
    assert proof is not None
    assert proof.rows.tolist() == [2]
    assert proof.pairs.size == 0
    verify(net, proof)
    names = proof.names(["v(1)", "v(2)", "v(3)", "i(v1)"], ["d1"])
    assert names == (["v(3)"], [])


def test_roles_of_switches():
    def net(role: int) -> Net:
        return Net(2).voltage(1, 0, 5.0).voltage(2, 0, 4.0).pair(1, 2, role=role)

    assert net(OPEN).proof() is None
    closed = net(CLOSED)
    proof = closed.proof()
    assert proof is not None
    assert proof.pairs.tolist() == [0]
    verify(closed, proof)
    backwards = Net(2).voltage(1, 0, 4.0).voltage(2, 0, 5.0).pair(1, 2, role=CLOSED)
    proof = backwards.proof()
    assert proof is not None
    assert proof.p[0] < 0.0  # a closed switch resists in both directions
    assert Net(1).current(0, 1, 1.0).pair(1, 0, role=OPEN).proof() is not None


@pytest.mark.parametrize("ohms", [1e-12, 1.0, 1e12])
def test_values_of_any_size_elsewhere_do_not_hide_the_conflict(ohms):
    net = Net(4).voltage(1, 0, 5.0).pair(1, 2).pair(2, 0)
    net.resistor(1, 3, ohms).resistor(3, 4, 1.0 / ohms).resistor(4, 0, 1.0).current(0, 4, 1e6)
    proof = net.proof()
    assert proof is not None
    assert proof.rows.tolist() == [4]
    assert proof.pairs.tolist() == [0, 1]
    verify(net, proof)


def test_nothing_to_prove():
    assert Net(2).resistor(1, 2, 1.0).pair(1, 2).proof() is None  # all data zero
    assert Net(1).voltage(1, 0, float("nan")).pair(1, 0).proof() is None


def test_rounding_is_no_contradiction():
    fifth = 0.1 + 0.2 - 0.3 + 5.0
    assert Net(1).voltage(1, 0, 5.0).voltage(1, 0, fifth).proof() is None


def test_a_large_solution_is_no_contradiction():
    """A second derivative over a step of 5e-13 s: -6.6e6 V at the second node, exactly."""
    rate = 2097152.0
    K = np.array(
        [
            [rate, 0.0, 1.0, 0.0],
            [0.0, 0.0, -0.5, 1.0],
            [-1.0, 0.0, 0.0, 0.0],
            [0.0, -1.0, 0.0, 1e3 * rate],
        ]
    )
    none = Csc.zeros
    b = [0.0, 0.0, -3e-9, 0.0]
    assert infeasibility(Csc.from_dense(K), none((4, 0)), none((0, 4)), none((0, 0)), b, []) is None


def test_every_problem_has_either_a_solution_or_a_proof():
    solved = proved = 0
    for seed in range(200):
        rng = np.random.default_rng([5, seed])
        nodes = int(rng.integers(2, 6))
        net = Net(nodes)
        for _ in range(int(rng.integers(1, 4))):
            a, c = (int(x) for x in rng.choice(nodes + 1, 2, replace=False))
            net.voltage(a, c, float(rng.integers(-2, 3)))
        for _ in range(int(rng.integers(0, 4))):
            a, c = (int(x) for x in rng.choice(nodes + 1, 2, replace=False))
            net.resistor(a, c, 10.0 ** rng.uniform(-2, 2))
        for _ in range(int(rng.integers(1, 7))):
            a, c = (int(x) for x in rng.choice(nodes + 1, 2, replace=False))
            net.pair(
                a, c, drop=float(rng.choice([0.0, 0.5])), role=int(rng.choice([0, 0, 0, 1, 2]))
            )
        proof = net.proof()
        kinds = np.arange(len(net.b)) >= nodes
        roles = np.array(net.roles, dtype=np.uint8)
        answer = solve_mlcp(*net.arrays(), roles=roles, row_kind=kinds.astype(np.uint8))
        assert answer.solved == (proof is None), f"seed {seed}"
        if proof is not None:
            verify(net, proof)
        solved += proof is None
        proved += proof is not None
    assert solved >= 40
    assert proved >= 40
