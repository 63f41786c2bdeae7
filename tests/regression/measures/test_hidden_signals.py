"""A measure of a signal that is not saved: its column counts among no magnitudes of the others."""

from __future__ import annotations

import pytest

import nsspice


@pytest.mark.parametrize("load", ["R2 b 0 1k", "D1 b 0"])
def test_a_measure_of_an_unsaved_signal(load: str):
    text = f"""t
V1 a 0 SIN(0 5 1k)
R1 a b 1k
C1 b 0 1u
{load}
.save v(b)
.measure tran m MAX v(a,b)
.tran 10u 2m
"""
    (solution,) = nsspice.read(text).run()
    assert list(solution.columns) == ["v(b)"]
    assert solution.measures["m"] > 1.0
