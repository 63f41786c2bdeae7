"""A measured power is a column that is not shown: the sizes of all columns are looked at."""

import pytest

import nsspice


def test_a_power_is_measured_beside_the_shown_signals() -> None:
    text = """power
V1 a 0 2
R1 a b 1k
R2 b 0 1k
C1 b 0 1n
.tran 1u 10u
.measure tran p AVG p(R1)
"""
    (solution,) = nsspice.read(text).run()
    # from the operating point on: 1 V, 1 mA
    assert solution.measures["p"] == pytest.approx(1e-3, rel=1e-12)
