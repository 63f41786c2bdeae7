"""Points far out, where residuals relative to the point itself fade away, are no solutions."""

from __future__ import annotations

import numpy as np
import pytest

from nsspice.problems import Csc
from nsspice.solvers.mlcp import solve_mlcp


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_an_active_problem_without_a_solution_has_none(size: float) -> None:
    """w1 = 2 (x1 - x2) >= 0 and w2 = w1 - 2 >= 0 ask for w1 >= 2, so that x1 = 0, w1 = -2 x2 <= 0.

    x1 = x2 = 4e12 was one, with w2 = -2 beside terms of 8e12.
    """
    matrix = Csc.from_dense(np.array([[2.0, -2.0], [2.0, -2.0]]))
    none = np.zeros(0)
    found = solve_mlcp(
        Csc.zeros((0, 0)),
        Csc.zeros((0, 2)),
        Csc.zeros((2, 0)),
        matrix,
        none,
        size * np.array([0.0, -2.0]),
    )
    assert not found.solved
