"""The bipolar decks: where their expected numbers come from, and sharp junctions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tomllib
from oracle import bipolar_decks

import nsspice

FOLDER = Path(__file__).parents[2] / "netlists" / "bipolar"
NAMES = ("inverter", "differential_pair", "schmitt_trigger", "astable", "rtl_chain", "adder_4bit")


def checks(name: str) -> list[dict[str, object]]:
    text = (FOLDER / f"{name}.expect.toml").read_text(encoding="utf-8")
    return [c for c in tomllib.loads(text)["check"] if "at" in c]


@pytest.mark.parametrize("name", ["inverter", "differential_pair"])
def test_expected_points_are_those_of_the_oracle(name: str):
    for check in checks(name):
        table = getattr(bipolar_decks, name)(np.array([check["at"]]))
        assert table[check["signal"]][0] == pytest.approx(check["value"], abs=1e-12)


def test_expected_states_of_the_trigger_are_those_of_the_oracle():
    for check in checks("schmitt_trigger"):
        t = check["at"]
        assert isinstance(t, float)
        vin = 5 * min(t, 2e-3 - t) / 1e-3
        triggered = 0.5e-3 < t < 1.8e-3
        table = bipolar_decks.schmitt_trigger(np.array([vin]), triggered)
        assert table[check["signal"]][0] == pytest.approx(check["value"], abs=1e-10)


def test_expected_start_of_the_chain_is_that_of_the_oracle():
    early = [c for c in checks("rtl_chain") if c["at"] <= 24e-9]
    times = np.array(sorted({c["at"] for c in early}))
    table = bipolar_decks.rtl_chain(times)
    for check in early:
        value = table[check["signal"]][np.searchsorted(times, check["at"])]
        assert value == pytest.approx(check["value"], abs=1e-7)


@pytest.mark.soak
def test_expected_period_is_that_of_the_oracle():
    times = np.linspace(0, 1.8e-3, 18001)
    v = bipolar_decks.astable(times)["v(c1)"]
    k = np.flatnonzero((v[:-1] < 2.5) & (v[1:] >= 2.5))
    rises = times[k] + (2.5 - v[k]) / (v[k + 1] - v[k]) * np.diff(times)[k]
    assert rises[2] - rises[1] == pytest.approx(0.0006843782830633712, abs=1e-10)


@pytest.mark.parametrize("n", [0.1, 0.01, 0.001])
@pytest.mark.parametrize("name", NAMES)
def test_sharp_junctions_converge(name: str, n: float):
    (solution,) = nsspice.read(FOLDER / f"{name}.net", params={"n": n}).run()
    assert solution.certificate.passed
    assert all(np.isfinite(values).all() for values in solution.signals.values())


def test_sharp_gates_add():
    """Ideal switches in the limit: the sums stand, with levels nearer to the supply."""
    (solution,) = nsspice.read(FOLDER / "adder_4bit.net", params={"n": 0.01}).run()
    rows = np.searchsorted(solution.time, (np.arange(6) * 100 + 95) * 1e-9 - 1e-12)
    bits = [solution[f"v({s})"][rows] > 2.5 for s in ("s0", "s1", "s2", "s3", "co")]
    sums = sum(bit.astype(int) << k for k, bit in enumerate(bits))
    assert list(sums) == [0, 4, 15, 16, 31, 16]
