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
        (("ref.csv", "--from", "1"), "no time in common"),
        (("none.csv",), "cannot read the reference none.csv"),
        (("rc.net",), "cannot read the reference rc.net"),
    ],
)
def test_wrong_requests(call, reference, args, words):
    result = call("compare", "rc.net", *args)
    assert result.exit_code == 2
    assert words in result.stderr


def test_without_a_reference_ngspice_is_the_other_side(call):
    result = call("compare", "rc.net", "--step", "0.2u", "--tolerance", "1e-3")
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("ngspice ")
    assert "reltol=1e-06" in result.stdout
    assert "all within max distance <= 0.001 of the range, against ngspice" in result.stdout


def test_a_coarse_step_is_found_out(call):
    # theta = 1 with h = 100 us on a time constant of 1 ms: h/2 e^-1 = 1.8e-2 off
    result = call("compare", "rc.net", "--step", "100u", "--json")
    assert result.exit_code == 1
    found = json.loads(result.stdout)
    assert not found["passed"]
    row = next(r for r in found["signals"] if r["signal"] == "v(out)")
    assert row["max_share"] == pytest.approx(0.019 / (1.0 - np.exp(-1.0)), rel=0.2)
    assert not row["passed"]
    assert found["ngspice"]["options"]["max_step"] == pytest.approx(1e-7)
    assert found["ngspice"]["substitutes"] == []


def test_what_stands_for_an_ideal_diode_is_listed(call):
    result = call("compare", "rectifier.net", "--junction", "0.001", "--plot", "both.png")
    assert result.exit_code == 0, result.stderr
    assert "d1: ideal diode -> junction D(is=1e-12 n=0.001)" in result.stdout
    assert "instants may differ by" in result.stdout
    assert Path("both.png").read_bytes().startswith(b"\x89PNG")


def test_the_translated_deck_can_be_kept(call):
    result = call(
        "compare", "rectifier.net", "--deck", "n.cir", "--signals", "v(out)", "--ron", "1m"
    )
    assert result.exit_code == 0, result.stderr
    text = Path("n.cir").read_text()
    assert "sidiode(ron=0.001 roff=1000000000000.0)" in text
    assert ".tran 0.0001 0.02 0.0 2e-06" in text


def test_a_failure_of_ngspice_exits_with_1(call, tmp_path):
    (tmp_path / "equal.net").write_text(
        "equal sources\nV1 a 0 5\nV2 a 0 5\nR1 a 0 1\n.tran 1u 1m\n"
    )
    result = call("compare", "equal.net")
    assert result.exit_code == 1
    assert "NS5010" in result.stderr


def test_a_missing_ngspice_is_told_in_a_sentence(call, monkeypatch):
    monkeypatch.setenv("NGSPICE_LIBRARY_PATH", "/no/such/library.so")
    monkeypatch.setenv("PATH", "")
    result = call("compare", "rc.net")
    assert result.exit_code == 2
    assert "NS4013" in result.stderr
    assert "pip install 'nsspice[ngspice]'" in result.stderr


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("rc.net", "--plot", "a.xyz"), "picture format"),
        (("rc.net", "--junction", "soft"), "junction"),
        (("rc.net", "--from", "1"), "no row to compare"),
        (("rc.net", "ref.csv", "--ron", "1"), "--ron cannot be used with a reference"),
        (("divider.net", "--deck", "no/such/folder/a.cir"), "NS4001"),
    ],
)
def test_wrong_requests_to_ngspice(call, reference, args, words):
    result = call("compare", *args)
    assert result.exit_code == 2
    assert words in result.stderr
