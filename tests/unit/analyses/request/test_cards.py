"""Times of a transient: rows, steps, what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nsspice.analyses.request.cards import Dc, Tran
from nsspice.errors import Span, UsageError
from nsspice.netlist.deck import Sweep


@pytest.mark.parametrize(
    ("fields", "step", "expected"),
    [
        ({"row_step": 1e-5}, None, 1e-5),  # tstep rules
        ({"row_step": 1e-4}, None, 2e-5),  # a fiftieth of the time rules
        ({"row_step": 1e-5, "max_step": 1e-6}, None, 1e-6),  # tmax rules
        ({"row_step": 1e-5, "max_step": 1e-3}, None, 1e-5),  # but not beyond the rows
        ({"row_step": 1e-5, "max_step": 1e-6}, 2e-6, 2e-6),  # the request rules over all
        ({"row_step": 1e-5}, 3e-6, 2.5e-6),  # cut so that it divides the row distance
        ({}, None, 1e-6),  # LTspice's form: a thousandth
    ],
)
def test_solver_step(fields, step, expected):
    assert Tran(stop=1e-3, **fields).solver_step(step) == pytest.approx(expected, rel=1e-12)


@given(st.floats(1e-12, 1e3), st.floats(1e-3, 1.0), st.floats(1e-4, 10.0))
def test_the_step_divides_the_row_distance_and_is_not_larger(stop, share, wanted):
    analysis = Tran(stop=stop, row_step=share * stop)
    step = analysis.solver_step(wanted * stop)
    count = analysis.row_distance / step
    assert count == pytest.approx(round(count), rel=1e-12)
    assert step <= min(wanted * stop, analysis.row_distance) * (1 + 1e-11)


@given(st.floats(1e-9, 1e3), st.floats(2e-3, 1.0), st.floats(0.0, 0.9))
def test_rows(stop, share, begin):
    analysis = Tran(stop=stop, row_step=share * stop, start=begin * stop)
    rows = analysis.rows()
    assert rows.size == analysis.row_count
    assert rows[0] == analysis.start
    assert rows[-1] == pytest.approx(stop, rel=1e-9)
    assert np.all(np.diff(rows) > 0.0)
    parts = [analysis.rows(k, k + 7) for k in range(0, rows.size, 7)]
    assert np.concatenate(parts).tolist() == rows.tolist()


@pytest.mark.parametrize(
    "fields",
    [
        {"stop": 0.0},
        {"stop": -1.0},
        {"stop": float("nan")},
        {"stop": float("inf")},
        {"stop": 1.0, "start": 1.0},
        {"stop": 1.0, "start": -0.1},
        {"stop": 1.0, "row_step": -0.1},
    ],
)
def test_impossible_times_are_refused(fields):
    with pytest.raises(UsageError) as caught:
        Tran(**fields)
    assert caught.value.code == "NS4005"


def test_the_first_sweep_runs_fastest():
    sweeps = [
        Sweep(n, "element", v, Span("", 0, 0)) for n, v in (("v1", (1.0, 2.0)), ("r1", (5.0, 6.0)))
    ]
    fast, slow = Dc(tuple(sweeps)).grid
    assert fast.tolist() == [1.0, 2.0, 1.0, 2.0]
    assert slow.tolist() == [5.0, 5.0, 6.0, 6.0]
