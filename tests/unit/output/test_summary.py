"""Summary text and JSON."""

from __future__ import annotations

import json

import numpy as np
import pytest

from nsspice.analyses.certificate.certificate import Certificate
from nsspice.analyses.results.jumps import Impulse, JumpReport, Moved
from nsspice.analyses.solution.solution import IslandRun, Solution
from nsspice.output.si import number, prefix


@pytest.fixture
def solution() -> Solution:
    impulse = Impulse(5e-4, "d1", 2.5e-6, "A s")
    return Solution(
        "tran",
        "t",
        "time",
        np.linspace(0.0, 1e-3, 11),
        {"v(a)": np.ones(11)},
        impulses=[impulse],
        jumps=[
            JumpReport(5e-4, 1e-6, 4e-6, 5e-6, [Moved("c1", 0.0, 2.5e-6, "A s")], [impulse]),
        ],
        islands=[
            IslandRun(1, "DLCP", "why", "moreau", 4, 2, 1.0, 1e-6, {"steps": 1000, "events": 1})
        ],
        certificate=Certificate(1e-14, 2e-15, 7),
        measures={"vmax": 1.0, "missing": float("nan")},
        wall_time=0.0123,
    )


def test_text(solution):
    text = solution.summary()
    for words in (
        "time 0 s to 1 ms, 11 rows of 1 signal in 12.3 ms",
        "island 1: DLCP (4 unknowns, 2 pairs); moreau, theta = 1, h = 1 µs: 1000 steps, 1 event",
        "certificate holds: laws 1.0e-14",
        "jump at 500 µs: energy 1 µJ + 5 µJ from sources -> 4 µJ, lost 2 µJ",
        "c1 0 A s -> 2.5 µA s",
        "impulse of d1 2.5 µA s",
        "vmax    = 1\n",
        "missing = not found",
    ):
        assert words in text


def test_a_failed_certificate_is_loud(solution):
    solution.certificate = Certificate(float("nan"), 0.0, 1)
    assert "certificate FAILS" in solution.summary()


def test_json_has_no_nan(solution):
    data = json.loads(json.dumps(solution.to_dict(), allow_nan=False))
    assert data["measures"] == {"vmax": 1.0, "missing": None}
    assert data["islands"][0]["stats"]["steps"] == 1000
    assert data["certificate"]["passed"] is True
    assert data["to"] == 1e-3
    assert data["jumps"][0]["lost"] == pytest.approx(2e-6)


def test_operating_point_values_are_listed():
    op = Solution("op", "t", "", np.zeros(1), {"v(a)": np.array([1500.0])})
    assert "v(a) = 1.5 kV" in op.summary()
    assert op.to_dict()["values"] == {"v(a)": 1500.0}


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1e-3, "1 ms"),
        (999.9999999e-6, "1 ms"),
        (1e-18, "1 as"),
        (5e15, "5000 Ts"),
        (-4.7e-8, "-47 ns"),
        (float("nan"), "nan s"),
        (float("inf"), "inf s"),
    ],
)
def test_numbers(value, text):
    assert number(value, "s") == text


def test_prefix_of_powers_of_ten_is_exact():
    for power in range(-18, 15):
        factor, _ = prefix(float(f"1e{power}"))
        assert 1.0 <= float(f"1e{power}") / factor * (1 + 1e-12) <= 1000.0


def test_steps_without_a_unique_solution_are_told(solution):
    assert "not unique" not in solution.summary()
    solution.certificate = Certificate(0.0, 0.0, 3, undetermined=4)
    assert "not unique in 4 steps" in solution.summary()
    assert solution.to_dict()["certificate"]["undetermined"] == 4
