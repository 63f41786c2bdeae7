"""Strong regularity and uniqueness against enumeration and closed forms."""

import itertools

import numpy as np
import pytest
from oracle.enumeration import solutions

import nsspice
from nsspice.circuit.regularity import dc_uniqueness
from nsspice.problems import Cone, GeneralizedEquation, Ramp, Sign, TapeBuilder
from nsspice.problems.enclosure import INF
from nsspice.problems.regularity import strong_regularity
from nsspice.problems.slopes import shapes
from nsspice.problems.uniqueness import uniqueness


def minors_positive(matrix):
    m = matrix.shape[0]
    return all(
        np.linalg.det(matrix[np.ix_(k, k)]) > 0
        for size in range(1, m + 1)
        for k in map(list, itertools.combinations(range(m), size))
    )


def linear(matrix) -> TapeBuilder:
    n = matrix.shape[0]
    tape = TapeBuilder()
    z = [tape.unknown(k) for k in range(n)]
    for row in matrix:
        total = tape.constant(0.0)
        for factor, unknown in zip(row, z, strict=True):
            total = tape.op("add", total, tape.op("mul", tape.constant(float(factor)), unknown))
        tape.output(total)
    return tape


def test_uniqueness_of_linear_problems_is_the_p_property():
    """0 in A z + Sgn(z) - p has one solution for all p exactly if A is a P-matrix."""
    rng = np.random.default_rng(6)
    seen = set()
    for _ in range(150):
        n = int(rng.integers(1, 5))
        matrix = rng.normal(size=(n, n)) + rng.uniform(0, 2) * np.eye(n)
        pieces = tuple((k, Sign(-1.0, 1.0)) for k in range(n))
        found = uniqueness(GeneralizedEquation(linear(matrix).finish(), pieces).system())
        assert found.unique is minors_positive(matrix), matrix
        seen.add(found.unique)
    assert seen == {True, False}


def test_book_transistor_is_unique_and_the_corrected_example_is_not():
    """Appendix B 4.2: the figure's parameters have one solution, those of the erratum three."""

    def problem(rb, rl, an, ai, alpha, beta, curve):
        mix = np.array([[rb, rb], [rb, rb + rl]]) @ np.array([[1.0, -ai], [-an, 1.0]])
        tape = TapeBuilder()
        z = [tape.unknown(0), tape.unknown(1)]
        for i, weight in enumerate((alpha, beta)):
            total = tape.op("mul", tape.constant(weight), tape.op(curve, z[i]))
            for j in range(2):
                total = tape.op("add", total, tape.op("mul", tape.constant(mix[i, j]), z[j]))
            tape.output(total)
        return mix, tape.finish()

    _, tape = problem(3e4, 3e3, 0.1, 0.7, -2 / np.pi, -2.0, "atan")
    pieces = ((0, Sign(-2.0, 2.0)), (1, Sign(-4.0, 4.0)))
    assert uniqueness(GeneralizedEquation(tape, pieces).system()).unique
    mix, tape = problem(3.0, 0.5, 0.1, 0.7, -0.5, -0.6, "atan")
    pieces = ((0, Sign(-0.2, 0.2)), (1, Sign(-0.4, 0.4)))
    found = uniqueness(GeneralizedEquation(tape, pieces).system())
    assert not found.unique
    assert found.functions == (0, 1)
    weights = np.array([-0.5, -0.6])
    many = solutions(
        lambda x: mix @ x + weights * np.arctan(x),
        lambda x: mix + np.diag(weights / (1.0 + x * x)),
        np.array([0.25146, -0.26421]),
        [(-0.2, 0.2), (-0.4, 0.4)],
        [np.array(s) for s in itertools.product((-0.5, 0.5), repeat=2)],
    )
    assert len(many) == 3


def test_strong_regularity_at_a_corner():
    """z + Sgn(z) at the end of its vertical piece: modulus 1; -z/2 + Sgn folds back there."""
    for slope, strong in ((1.0, True), (-0.5, False)):
        tape = linear(np.array([[slope]]))
        system = GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),)).system()
        jacobian = np.array([[slope, 0.0]])
        found = strong_regularity(system, jacobian, np.array([0.0, 1.0]), np.zeros(2))
        assert found.strong is strong
        assert found.between == (0,)
    # inside the vertical piece nothing moves, whatever the slope
    inside = strong_regularity(system, jacobian, np.array([0.0, 0.3]), np.zeros(2))
    assert inside.strong
    assert inside.modulus == pytest.approx(1.0)  # the force follows p


def test_modulus_is_the_inverse_slope():
    tape = TapeBuilder()
    tape.output(tape.op("asinh", tape.unknown(0)))
    system = GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),)).system()
    z = 3.0
    jacobian = np.array([[1.0 / np.hypot(1.0, z), 0.0]])
    found = strong_regularity(system, jacobian, np.array([z, 1.0]), np.array([z, 0.0]))
    assert found.modulus == pytest.approx(np.hypot(1.0, z))
    assert (found.unknown, found.row) == (0, 0)


def test_shapes_of_functions():
    tape = TapeBuilder()
    z = [tape.unknown(k) for k in range(3)]
    two = tape.constant(2.0)
    inner = tape.op("sub", tape.op("mul", two, z[0]), z[1])
    junction = tape.op("junction", inner, constants=(1e-14, 0.025))
    mixed = tape.op("add", tape.op("neg", junction), tape.op("div", z[2], two))
    composed = tape.op("tanh", tape.op("mul", tape.constant(-3.0), junction))
    product = tape.op("mul", z[0], z[1])
    for register in (mixed, composed, product, tape.op("max", z[0], two)):
        tape.output(register)
    (a, b, c, d), ridges = shapes(tape.finish())
    assert a.linear == {2: 0.5}
    ((number, factor),) = a.ridges.items()
    assert factor == -1.0
    assert ridges[number].direction == {0: 2.0, 1: -1.0}
    assert (ridges[number].low, ridges[number].high) == (0.0, INF)
    (number,) = b.ridges
    assert (ridges[number].low, ridges[number].high) == (-INF, 0.0)
    assert c is None
    (number,) = d.ridges
    assert ridges[number].closed


def test_kinks_may_be_flat_and_cones_tie_down():
    """(z)^+ alone leaves z free below 0; a cone or a ramp of its own side ties it down."""
    tape = TapeBuilder()
    tape.output(tape.op("uramp", tape.unknown(0)))
    flat = tape.finish()
    assert not uniqueness(GeneralizedEquation(flat).system()).unique
    assert not uniqueness(GeneralizedEquation(flat, ((0, Cone(0.0)),)).system()).unique
    tape = linear(np.array([[1.0]]))
    assert uniqueness(GeneralizedEquation(tape.finish(), ((0, Ramp(1.0, 2.0)),)).system()).unique


def system_of(deck: str):
    circuit = nsspice.read(deck)
    (island,) = circuit.islands
    return island.assemble(analysis="dc")


def test_verdicts_name_elements():
    unique = dc_uniqueness(system_of("a\nV1 a 0 1\nR1 a b 1k\nD1 b 0 dd\n.model dd D(is=1e-14)\n"))
    assert unique.unique
    latch = dc_uniqueness(
        system_of(
            "latch\nE1 a 0 b 0 -5\nR1 a c 1k\nD1 c 0 z\nE2 d 0 c 0 -5\nR2 d b 1k\nD2 b 0 z\n"
            ".model z D(Vfwd=1 Vrev=1)\n"
        )
    )
    assert not latch.unique
    assert {"e1", "e2"} <= set(latch.elements)


def test_many_passive_junctions_are_proved_by_monotonicity():
    lines = ["ladder", "V1 n0 0 5"]
    for k in range(20):
        lines += [f"R{k} n{k} n{k + 1} 1k", f"D{k} n{k + 1} 0 dd"]
    lines.append(".model dd D(is=1e-14)")
    found = dc_uniqueness(system_of("\n".join(lines) + "\n"))
    assert found.unique
    assert "monotone" in found.reason


def test_an_operating_point_reports_all_that_were_found():
    latch = """two inverting stages in a ring: three states
E1 a 0 b 0 -5
R1 a c 1k
D1 c 0 z
E2 d 0 c 0 -5
R2 d b 1k
D2 b 0 z
.model z D(Vfwd=1 Vrev=1)
.op
"""
    (solution,) = nsspice.read(latch).run()
    verdict = solution.islands[0].regularity
    assert verdict.kind == "several"
    values = sorted(round(s["v(b)"], 9) for s in verdict.solutions)
    assert values == [-1.0, 0.0, 1.0]
    (warning,) = [w for w in solution.warnings if w.code == "NS3005"]
    assert ".nodeset" in warning.hint
    assert "v(" in warning.message
    (held,) = nsspice.read(latch + ".nodeset v(b)=1 v(c)=-1 v(a)=-5 v(d)=5\n").run()
    assert held["v(b)"][0] == pytest.approx(1.0)


def test_leakage_beside_rounding_of_voltages_is_one_operating_point():
    """At rest the collector conducts 6 pA; a rounding of 15 V across 0.5 Ohm is 3 fA."""
    darlington = """a Darlington switch that is off
VCC vcc 0 15
RB 0 b 15k
Q1 c b e small
Q2 c e 0 large
RBE e 0 15k
LC vcc cx 4m
RC cx c 299
DF c vcc dm
.model small NPN(IS=1.1e-14 BF=197 VAF=55 RB=1.8 RC=0.54)
.model large NPN(IS=4.7e-12 BF=233 VAF=128 BR=6.3)
.model dm D(IS=1e-10 N=1.67 RS=9.7)
.op
"""
    (solution,) = nsspice.read(darlington).run()
    assert not [w for w in solution.warnings if w.code == "NS3005"]
    assert solution["v(c)"][0] == pytest.approx(15.0)


def test_a_track_is_judged_along_its_points():
    deck = """argsinh
V1 a 0 SIN(0 4 0.15915494309189535)
R1 a b V={asinh(i)}
D1 b 0 practical
.model practical D(Vfwd=1 Vrev=1)
.tran 0.01 10
"""
    solution = nsspice.tran(nsspice.read(deck))
    verdict = solution.islands[0].regularity
    assert verdict.kind == "unique"
    assert verdict.points > 50
    # the current moves most where the curve is flattest: di/dp = cosh(3) at the peak of 4 V
    assert verdict.modulus == pytest.approx(np.cosh(3.0), rel=1e-2)


def test_many_points_are_judged_by_the_worst():
    """asinh(z) + Sgn(z) at points of both branches and at the corner: the flattest one counts."""
    tape = TapeBuilder()
    tape.output(tape.op("asinh", tape.unknown(0)))
    system = GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),)).system()
    at = np.array([-7.0, 0.5, 3.0, 0.0])
    z = np.column_stack([at, np.sign(at)])
    z[3, 1] = 0.3  # inside the vertical piece
    lam = np.column_stack([np.maximum(at, 0.0), np.maximum(-at, 0.0)])
    slopes = np.zeros((4, 1, 2))
    slopes[:, 0, 0] = 1.0 / np.hypot(1.0, at)
    found = strong_regularity(system, slopes, z, lam)
    single = [strong_regularity(system, *point) for point in zip(slopes, z, lam, strict=True)]
    assert found == max(single, key=lambda one: one.modulus)
    assert found.modulus == pytest.approx(np.hypot(1.0, 7.0))
    slopes[2] = 0.0  # one flat point is enough
    assert strong_regularity(system, slopes, z, lam).strong is False
