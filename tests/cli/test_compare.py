"""nsspice compare: distances from a reference, verdict, exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture
def reference(decks) -> Path:
    t = np.linspace(0.0, 1e-3, 201)
    rows = np.column_stack([t, 1.0 - np.exp(-t / 1e-3), np.ones(201)])
    path = Path("ref.csv")
    np.savetxt(path, rows, delimiter=",", header="time,V(OUT),other", comments="")
    return path


def test_within_the_tolerance(call, reference):
    result = call("compare", "rc.net", "ref.csv", "--tolerance", "0.01", "--step", "1u")
    assert result.exit_code == 0, result.stderr
    assert "v(out)" in result.stdout
    assert "all within max distance <= 0.01 of the range" in result.stdout


def test_beyond_the_tolerance(call, reference):
    result = call("compare", "rc.net", "ref.csv", "--tolerance", "1e-6")
    assert result.exit_code == 1
    assert "FAIL" in result.stdout


def test_first_order_shows_in_all_norms(call, reference):
    found = []
    for step in ("20u", "10u"):
        result = call("compare", "rc.net", "ref.csv", "--json", "--step", step, "--tolerance", "1")
        (row,) = json.loads(result.stdout)["signals"]
        found.append([row["max"], row["l1"], row["rms"]])
    # rows are 100 us apart: the interpolation error of 1.25e-3 stays
    assert np.all(np.array(found[1]) < np.array(found[0]))
    assert found[0][1] <= found[0][2] <= found[0][0]


def test_columns_of_another_name(call, reference):
    result = call(
        "compare", "rc.net", "ref.csv", "--map", "other=v(in)", "--signals", "v(in)", "--json"
    )
    assert result.exit_code == 0
    (row,) = json.loads(result.stdout)["signals"]
    assert row["signal"] == "v(in)"
    assert row["max"] == 0.0


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("ref.csv", "--map", "othr=v(in)"), "did you mean other?"),
        (("ref.csv", "--map", "other"), "--map COLUMN=SIGNAL"),
        (("ref.csv", "--signals", "i(r1)"), "no column for i(r1)"),
        (("ref.csv", "--time", "t"), "no column 't'"),
        (("ref.csv", "--from", "1"), "no common time"),
        (("none.csv",), "cannot read the reference none.csv"),
        (("rc.net",), "cannot read the reference rc.net"),
    ],
)
def test_wrong_requests(call, reference, args, words):
    result = call("compare", "rc.net", *args)
    assert result.exit_code == 2
    assert words in result.stderr


def test_without_a_reference_it_says_what_is_missing(call):
    result = call("compare", "rc.net")
    assert result.exit_code == 2
    assert "NS4013" in result.stderr
    assert "ngspice" in result.stderr
