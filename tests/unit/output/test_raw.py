"""Raw files are read back by an independent reader."""

from __future__ import annotations

import numpy as np
import pytest

from nsspice.analyses.solution.solution import Solution
from nsspice.errors import OutputError
from nsspice.output.raw import write_raw


def test_spicelib_reads_it(tmp_path):
    spicelib = pytest.importorskip("spicelib")  # licensed under the GPL: where somebody has it
    t = np.linspace(0.0, 1e-3, 101)
    solution = Solution("tran", "two\nlines", "time", t, {"v(a)": np.sin(1e4 * t), "i(r1)": t / 3})
    write_raw(solution, tmp_path / "a.raw")
    raw = spicelib.RawRead(str(tmp_path / "a.raw"))
    assert raw.get_trace_names() == ["time", "v(a)", "i(r1)"]
    assert np.array_equal(raw.get_trace("time").get_wave(), t)
    assert np.array_equal(raw.get_trace("v(a)").get_wave(), np.sin(1e4 * t))
    assert np.array_equal(raw.get_trace("i(r1)").get_wave(), t / 3)


def test_two_runs_give_identical_bytes(tmp_path):
    solution = Solution("tran", "t", "time", np.arange(3.0), {"v(a)": np.arange(3.0)})
    write_raw(solution, tmp_path / "a.raw")
    write_raw(solution, tmp_path / "b.raw")
    assert (tmp_path / "a.raw").read_bytes() == (tmp_path / "b.raw").read_bytes()


def test_a_missing_folder_is_an_output_error(tmp_path):
    solution = Solution("tran", "t", "time", np.arange(3.0), {"v(a)": np.arange(3.0)})
    with pytest.raises(OutputError):
        write_raw(solution, tmp_path / "no" / "a.raw")
