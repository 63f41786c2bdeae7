"""Tables for other programs are read back by the libraries that keep their formats."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from nsspice.analyses.solution.solution import Solution
from nsspice.errors import OutputError, UsageError
from nsspice.output.ownership import written_by_nsspice


@pytest.fixture
def solution() -> Solution:
    t = np.linspace(0.0, 1e-3, 101)
    signals = {"v(x1/a)": np.sin(1e4 * t), "i(r1)": t / 3.0}
    return Solution("tran", "A title: Übung", "time", t, signals, parameters={"r": 1e3})


def _npz(path):
    with np.load(path) as archive:
        return dict(archive)


def _parquet(path):
    table = pytest.importorskip("pyarrow.parquet").read_table(path)
    assert table.schema.field("i(r1)").metadata == {b"unit": b"A"}
    assert table.schema.metadata[b"title"].decode() == "A title: Übung"
    return {name: table[name].to_numpy() for name in table.column_names}


def _hdf5(path):
    with pytest.importorskip("h5py").File(path) as file:
        assert file["v(x1/a)"].attrs["unit"] == "V"
        assert file.attrs["r"] == 1e3
        return {name: file[name][:] for name in ("time", "v(x1/a)", "i(r1)")}


@pytest.mark.parametrize(
    ("ending", "read", "package"),
    [(".npz", _npz, "numpy"), (".parquet", _parquet, "pyarrow"), (".h5", _hdf5, "h5py")],
)
def test_every_number_is_read_back_bit_for_bit(solution, tmp_path, ending, read, package):
    pytest.importorskip(package)
    path = tmp_path / f"a{ending}"
    solution.save(path)
    found = read(path)
    assert list(found) == ["time", "v(x1/a)", "i(r1)"]
    assert np.array_equal(found["time"], solution.time)
    for name in solution.columns:
        assert np.array_equal(found[name], solution[name])
    assert written_by_nsspice(path)


def test_chosen_columns_of_csv_and_raw(solution, tmp_path):
    solution.save(tmp_path / "a.csv", ["i(r1)"])
    solution.save(tmp_path / "a.raw", ["i(r1)"])
    assert (tmp_path / "a.csv").read_text().startswith("time,i(r1)\n")
    assert b"Title: A title: \xc3\x9cbung, r = 1000\n" in (tmp_path / "a.raw").read_bytes()


def test_an_xarray_dataset_has_axis_and_units(solution):
    pytest.importorskip("xarray")
    data = solution.to_xarray()
    assert data["i(r1)"].dims == ("time",)
    assert data["i(r1)"].attrs == {"units": "A"}
    assert data.attrs["r"] == 1e3
    assert np.array_equal(data["i(r1)"].sel(time=1e-3), solution["i(r1)"][-1])


@pytest.mark.parametrize(
    ("name", "package"), [("a.parquet", "pyarrow"), ("a.h5", "h5py"), (None, "xarray")]
)
def test_a_missing_package_is_named(solution, tmp_path, monkeypatch, name, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(UsageError, match=f"NS4010.*\n.*pip install {package}"):
        solution.save(tmp_path / name) if name else solution.to_xarray()
    assert not list(tmp_path.iterdir())


def test_unknown_endings_and_missing_folders(solution, tmp_path):
    with pytest.raises(UsageError, match="NS4008"):
        solution.save(tmp_path / "a.xlsx")
    with pytest.raises(OutputError, match="NS4001"):
        solution.save(tmp_path / "no" / "a.npz")
