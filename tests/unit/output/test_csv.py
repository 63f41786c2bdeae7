"""CSV files: format, bit-exact numbers, streaming, and files that cannot be written."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nsspice.analyses.solution.solution import Solution
from nsspice.errors import OutputError
from nsspice.output.csv import CsvSink


def solution(columns: list[str] | None = None) -> Solution:
    signals = {"v(a)": np.array([0.1, 1.0 / 3.0]), "v(a,b)": np.array([1e-9, -2.0])}
    return Solution("tran", "t", "time", np.array([0.0, 1e-6]), signals, columns or [])


def test_layout(tmp_path):
    solution().to_csv(tmp_path / "a.csv")
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[0] == 'time,v(a),"v(a,b)"'
    assert next(csv.reader(lines)) == ["time", "v(a)", "v(a,b)"]
    assert len(lines) == 3


def test_only_the_columns(tmp_path):
    solution(["v(a,b)"]).to_csv(tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text().splitlines()[0] == 'time,"v(a,b)"'
    solution().to_csv(tmp_path / "a.csv", ["v(a)"])
    assert (tmp_path / "a.csv").read_text().splitlines()[0] == "time,v(a)"


def test_an_operating_point_has_no_axis(tmp_path):
    Solution("op", "t", "", np.zeros(1), {"v(a)": np.array([5.0])}).to_csv(tmp_path / "a.csv")
    assert (tmp_path / "a.csv").read_text() == "v(a)\n5\n"


@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=50))
def test_doubles_read_back_bit_for_bit(values):
    stream = io.BytesIO()
    sink = CsvSink(stream)
    sink.open(["x"])
    sink.write(np.array(values)[:, None])
    sink.close()
    lines = stream.getvalue().decode().splitlines()[1:]
    assert [float(line) for line in lines] == values
    assert np.signbit([float(line) for line in lines]).tolist() == np.signbit(values).tolist()


def test_blocks_make_the_same_file_as_one_table(tmp_path):
    table = np.random.default_rng(1).normal(size=(5000, 40))
    names = [f"v({k})" for k in range(30)]
    for name, size in (("one.csv", 5000), ("many.csv", 37)):
        sink = CsvSink(tmp_path / name)
        sink.open(names)
        for k in range(0, 5000, size):
            sink.write(table[k : k + size])  # ten columns more than names: not shown
        sink.close()
        assert sink.rows == 5000
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "many.csv").read_bytes()
    back = np.loadtxt(tmp_path / "one.csv", delimiter=",", skiprows=1)
    assert np.array_equal(back, table[:, :30])


def test_rows_are_on_disk_after_each_block(tmp_path):
    sink = CsvSink(tmp_path / "a.csv")
    sink.open(["x"])
    sink.write(np.ones((3, 1)))
    assert (tmp_path / "a.csv.part").read_text() == "x\n1\n1\n1\n"
    sink.close()
    assert (tmp_path / "a.csv").read_text() == "x\n1\n1\n1\n"
    assert not (tmp_path / "a.csv.part").exists()


def test_an_old_file_stays_until_rows_come(tmp_path):
    (tmp_path / "a.csv").write_text("old")
    sink = CsvSink(tmp_path / "a.csv")
    sink.open(["x"])
    assert (tmp_path / "a.csv").read_text() == "old"


def test_a_missing_folder_is_an_output_error(tmp_path):
    with pytest.raises(OutputError) as caught:
        solution().to_csv(tmp_path / "no" / "a.csv")
    assert caught.value.code == "NS4001"
    assert "a.csv" in str(caught.value)


class _Fills:
    """A file that takes so many bytes and then fails, half a line written."""

    def __init__(self, path: Path, room: int) -> None:
        self.file, self.room = path.open("wb", buffering=0), room

    def write(self, data: bytes) -> int:
        self.file.write(data[: self.room])
        if len(data) > self.room:
            raise OSError(28, "No space left on device")
        self.room -= len(data)
        return len(data)

    def flush(self) -> None:
        pass

    def tell(self) -> int:
        return self.file.tell()

    def close(self) -> None:
        self.file.close()


def test_a_failed_file_is_cut_back_to_complete_rows(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    sink = CsvSink(path)
    monkeypatch.setattr(sink, "_file", _Fills(path, 40))
    sink.open(["x"])
    sink.write(np.full((5, 1), 0.125))
    with pytest.raises(OutputError, match="after 5 rows") as caught:
        sink.write(np.full((5, 1), 0.125))
    assert "free some space" in caught.value.diagnostics[0].hint
    assert path.read_text() == "x\n" + 5 * "0.125\n"
