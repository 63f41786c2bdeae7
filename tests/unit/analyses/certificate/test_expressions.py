"""Expressions of the certificate: trees that were read against what engines compute with."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.analyses.certificate.expression_check import ExpressionCheck
from nsspice.analyses.request.cards import Tran
from nsspice.analyses.request.settings import Settings
from nsspice.analyses.transient.island_runner import IslandRunner
from nsspice.netlist.expressions.expression import Expression
from nsspice.solvers.moreau import Records

#: what is read, with the voltage of a driven node, its capacitor's current, the time
WRITTEN = [
    "v(a)*v(b)/10 + 0.1*sin(6283*time)",
    "exp(-1000*time)*2 + sqrt(1 + v(a)^2)",
    "time > 0.7m ? 1 : v(b)*v(b)",
    "atan(i(v1)*1e3) + pwl(v(a), -1, 0, 0, 1, 2, 3)",
    "limit(v(a,b), -0.3, 0.4)*tanh(v(b))",
    "log10(1 + v(a)^2) + min(v(a), v(b), 0.2)",
]
DECK = (
    "expressions\nV1 a 0 SIN(0 2 1k)\nRa a b 1k\nC1 b 0 100n IC=0\n"
    + "".join(f"B{k} c{k} 0 V={{{text}}}\nR{k} c{k} 0 1k\n" for k, text in enumerate(WRITTEN))
    + "B9 0 d I={1m*v(a)*v(a)}\nC9 d 0 1u IC=0\nR9 d 0 V={10*i + 1e4*i^3}\n"
)


def finished(method: str, wrong: int | None = None) -> IslandRunner:
    """Return the runner of a whole run; one expression is off by a millionth."""
    circuit = nsspice.read(DECK)
    analysis = Tran(stop=2e-3, row_step=2e-5, uic=True)
    settings = Settings(method, 1.0)
    runner = IslandRunner(circuit, 0, circuit.islands[0], [], analysis, settings, None, None)
    if wrong is not None:
        readings = runner.mna.layout.readings
        text = readings[wrong].expression.text
        other = Expression.parse(f"({text})*1.000001")
        readings[wrong] = readings[wrong]._replace(expression=other)
        runner.examiner._expressions = ExpressionCheck(runner.mna)
    runner.start()
    while runner.advance(1000).shape[0]:
        pass
    return runner


@pytest.mark.parametrize("method", ["moreau", "sdirk"])
def test_engines_compute_with_what_was_read(method):
    runner = finished(method)
    assert len(runner.mna.layout.readings) == len(WRITTEN) + 2
    assert runner.certificate().passed
    assert runner.examiner._expressions.error < 1e-12


@pytest.mark.parametrize("method", ["moreau", "sdirk"])
@pytest.mark.parametrize("wrong", range(len(WRITTEN) + 2))
def test_a_wrong_expression_is_named(method, wrong):
    runner = finished(method, wrong)
    text = runner.mna.layout.readings[wrong].expression.text
    found = runner.certificate()
    assert not found.passed
    assert found.laws > 1e-8
    assert found.worst.startswith("the expression {")
    assert text.replace(" ", "")[:20] in found.worst.replace(" ", "")


def test_beside_a_jump_both_of_its_sides_are_right():
    """sgn(t - 1) at 1 s is that of 1 s and the rounding of a few units, not that of 1.0001 s."""
    mna = (
        nsspice.read("jump\nB1 a 0 V={3*sgn(time - 1) + tanh(time)}\nR1 a 0 1\n")
        .islands[0]
        .assemble(27.0)
    )
    z, u = np.zeros((1, mna.system.n)), np.zeros((1, len(mna.system.waveforms)))
    for instant, right in (("1", True), ("1.000000000000001", True), ("1.0001", False)):
        other = Expression.parse(f"3*sgn(time - {instant}) + tanh(time)")
        mna.layout.readings[0] = mna.layout.readings[0]._replace(expression=other)
        check = ExpressionCheck(mna)
        time, lam = np.ones(1), np.zeros((1, mna.system.m))
        check.take_points(Records(time, np.inf * time, z, z, lam, u, u, None))
        assert (check.error == 0.0) == right


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_at_a_kink_rounding_may_be_on_either_side(sign):
    """+-1000 |v(a)| at v(a) = 0 V, after 1 V: v(a) is known to 64 units of its largest value.

    The pair that carries |v(a)| may be as much below zero as a voltage above it would lift it.
    """
    mna = (
        nsspice.read(f"kink\nV1 a 0 1\nB1 b 0 V={{{1000 * sign}*abs(v(a))}}\n")
        .islands[0]
        .assemble(27.0)
    )
    (stated,), known = mna.layout.stated, 64.0 * np.finfo(float).eps
    ((inner, slope),) = stated.value.z
    assert slope == 1000.0 * sign
    for off, right in ((0.9, True), (-0.9, True), (1.1, False), (-1.1, False)):
        z = np.zeros((2, mna.system.n))
        z[0, [mna.layout.nodes["a"], inner]] = 1.0
        z[1, inner] = off * known
        u, lam = np.zeros((2, len(mna.system.waveforms))), np.zeros((2, mna.system.m))
        check, time = ExpressionCheck(mna), np.array([1.0, 2.0])
        check.take_points(Records(time, np.inf * time, z, z, lam, u, u, None))
        assert (check.error == 0.0) == right
