"""Roots of what is exactly zero: the value is there, only a tangent is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice

ROOTS = {
    "sqrt(v(x))": lambda x: np.sqrt(x),
    "sqrt(abs(v(x)))": lambda x: np.sqrt(np.abs(x)),
    "sqrt(v(x)**2+v(y)**2)": lambda x: np.sqrt(2.0) * np.abs(x),
    "1+sqrt(2*v(x))*3": lambda x: 1.0 + 3.0 * np.sqrt(2.0 * x),
}


@pytest.mark.parametrize("expression", ROOTS)
def test_roots_of_sources_that_begin_at_zero(expression: str):
    deck = f"""root
V1 x 0 PWL(0 0 1m 1)
V2 y 0 PWL(0 0 1m 1)
B1 a 0 V={expression}
R1 a 0 1k
.op
.tran 10u 1m
"""
    point, run = nsspice.read(deck).run()
    assert point["v(a)"][0] == pytest.approx(ROOTS[expression](0.0), abs=1e-12)
    expected = ROOTS[expression](1e3 * run.time)
    assert run["v(a)"] == pytest.approx(expected, abs=1e-12 * expected.max())
    assert run.certificate.passed


@pytest.mark.parametrize("given", ["", ".nodeset v(a)=0", ".nodeset v(a)=9"])
def test_a_root_of_the_unknown_itself(given: str):
    """The search begins at zero: ``v = 1 + sqrt(v)``."""
    deck = f"fixed point\nB1 a 0 V=1+sqrt(v(a))\nR1 a 0 1\n{given}\n.op\n"
    assert nsspice.read(deck).run()[0]["v(a)"][0] == pytest.approx((3.0 + math.sqrt(5.0)) / 2.0)


def test_a_magnitude_that_passes_through_zero_behind_a_filter():
    """``|2 sin|`` into 1 ms: the steady ripple has the mean of its magnitude."""
    deck = """magnitude of two phases
V1 x 0 SIN(0 1 50)
B1 m 0 V=sqrt(v(x)*v(x)+v(x)*v(x)+2*v(x)**2)
R1 m f 1k
C1 f 0 1u IC=0
.tran 10u 100m uic
.measure tran mean avg v(f) from=20m to=100m
"""
    run = nsspice.read(deck).run()[0]
    assert run.measures["mean"] == pytest.approx(4.0 / math.pi, rel=1e-4)
    assert run.certificate.passed
