"""Access to the waveforms of a solution."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import numpy as np
import pytest

from nsspice.analyses.request.row_sinks import Store
from nsspice.analyses.signals.signal_names import canonical
from nsspice.analyses.solution.solution import Solution
from nsspice.errors import OutputError, UsageError


@pytest.fixture
def solution() -> Solution:
    return Solution(
        "tran",
        "t",
        "time",
        np.array([0.0, 1.0]),
        {"v(in)": np.array([1.0, 2.0]), "v(out)": np.array([0.5, 0.5]), "i(v1)": np.zeros(2)},
    )


@pytest.mark.parametrize("name", ["v(in)", " V( IN )", "v(in,0)", "v(in, GND)"])
def test_spellings(solution, name):
    assert solution[name].tolist() == [1.0, 2.0]


def test_differences_and_ground(solution):
    assert solution["v(in,out)"].tolist() == [0.5, 1.5]
    assert solution["v(0,in)"].tolist() == [-1.0, -2.0]
    assert solution["v1#branch"].tolist() == [0.0, 0.0]
    assert solution["time"].tolist() == [0.0, 1.0]


def test_unknown_names_get_a_suggestion(solution):
    with pytest.raises(KeyError, match=r"did you mean v\(out\)"):
        solution["v(oout)"]
    assert "v(x)" not in solution
    assert "v(in)" in solution


def test_table(solution):
    names, table = solution.table(["v(out)"])
    assert names == ["time", "v(out)"]
    assert table.tolist() == [[0.0, 0.5], [1.0, 0.5]]


def test_pandas_missing(solution, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(UsageError, match="pip install pandas"):
        solution.to_pandas()


def test_pandas_frame(solution, monkeypatch):
    """The calls that are made, recorded by a stand-in: pandas is no dependency of the tests."""
    frame = SimpleNamespace(index=None)
    pandas = SimpleNamespace(
        DataFrame=lambda data: frame.__dict__.update(data=data) or frame,
        Index=lambda values, name: (name, values.tolist()),
    )
    monkeypatch.setitem(sys.modules, "pandas", pandas)
    assert solution.to_pandas() is frame
    assert list(frame.data) == ["v(in)", "v(out)", "i(v1)"]
    assert frame.index == ("time", [0.0, 1.0])


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("V(A,B)", "v(a,b)"),
        ("i(X1.R2)", "i(x1.r2)"),
        ("@r1[i]", "i(r1)"),
        ("@d1[id]", "i(d1)"),
        ("time", "time"),
    ],
)
def test_canonical_names(written, name):
    assert canonical(written) == name


@pytest.mark.parametrize("limit", [10**9, 0])
def test_store_in_memory_and_in_a_file(limit):
    store = Store(10, 3, limit)
    store.write(np.full((4, 3), 1.0))
    store.write(np.full((2, 3), 2.0))
    assert store.table.shape == (6, 3)
    assert store.table[:, 0].tolist() == [1.0] * 4 + [2.0] * 2
    assert isinstance(store.table, np.memmap) == (limit == 0)


@pytest.mark.parametrize("rows", [10**17, 10**20])
def test_more_rows_than_can_be_kept_are_told(rows):
    with pytest.raises(OutputError, match=f"cannot store {rows} rows of 3 columns") as caught:
        Store(rows, 3)
    assert caught.value.code == "NS4001"
