"""The closed forms derived in the oracle agree with the recorded reference waveforms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from oracle import closed_forms, thesis_decks

DATA = Path(__file__).parents[2] / "netlists" / "thesis" / "data"

CASES = [
    ("ex411_coulomb", thesis_decks.FRICTION_FREE, {"v": "v_case1"}),
    ("ex411_coulomb", thesis_decks.FRICTION_LOADED[0], {"v": "v_case2_m1"}),
    ("ex411_coulomb", thesis_decks.FRICTION_LOADED[1], {"v": "v_case2_m2"}),
    ("ex231_corrected", thesis_decks.SGN[0], {"x": "x_xa-1", "v": "v_xa-1"}),
    ("ex231_corrected", thesis_decks.SGN[1], {"x": "x_xa-3", "v": "v_xa-3"}),
    ("ex412_fig43", thesis_decks.SPRING, {"x": "x1", "v": "x2"}),
    ("ex423_zener_rlc", thesis_decks.ZENER, {"x": "q_C", "v": "i_A"}),
    ("ex414_rigid_e0", thesis_decks.RIGID, {"x": "x1_m", "v": "x2_m_s", "n": "n_regular_N"}),
    ("ex424_bridge_thesis", thesis_decks.BRIDGE, {"v": "vC_V", "i": "iL_A", "iR": "iR_A"}),
]


def table(name: str) -> dict[str, np.ndarray]:
    with (DATA / f"{name}.csv").open() as file:
        names = file.readline().strip().split(",")
        rows = np.loadtxt(file, delimiter=",")
    return dict(zip(names, rows.T, strict=True))


@pytest.mark.parametrize(
    ("file", "example", "columns"), CASES, ids=lambda c: getattr(c, "name", "")
)
def test_closed_form_matches_recorded_waveform(file, example, columns):
    data = table(file)
    exact = example.exact.at(next(iter(data.values())))
    for ours, theirs in columns.items():
        scale = np.abs(data[theirs]).max()
        assert np.abs(exact[ours] - data[theirs]).max() <= 1e-14 * max(scale, 1.0), theirs


def test_multipliers_match_recorded_waveforms():
    data = table("ex411_coulomb")
    for m, example in (
        (1.0, thesis_decks.FRICTION_LOADED[0]),
        (2.0, thesis_decks.FRICTION_LOADED[1]),
    ):
        force = example.exact.at(data["t_s"])["f"]
        assert np.allclose(1 - force / (9.81 * m), data[f"w_case2_m{m:g}"], rtol=0, atol=1e-14)
    data = table("ex412_fig43")
    force = thesis_decks.SPRING.exact.at(data["t_s"])["F"]
    assert np.allclose(-force, 1 - data["u"], rtol=0, atol=1e-14)
    data = table("ex423_zener_rlc")
    force = thesis_decks.ZENER.exact.at(data["t_s"])["F"]
    assert np.allclose(force, 2 * data["lambda"], rtol=0, atol=1e-14)


def test_compliant_bounce_matches_over_six_seconds():
    data = table("ex414_compliant")
    exact = closed_forms.compliant_bounce(1.0, 1e4, 6.0, 1.0, 6.0).at(data["t_s"])
    assert np.abs(exact["x"] - data["x1_m"]).max() <= 1e-13
    assert np.abs(exact["v"] - data["x2_m_s"]).max() <= 1e-12
    assert np.abs(exact["n"] - data["n_N"]).max() <= 1e-9


def test_static_characteristics_match():
    data = table("ch1_static_R_diode")
    for name, forward, reverse in (("ideal", 0.0, np.inf), ("zener", 0.7, 5.1)):
        i, v = closed_forms.static_limits(data["E_V"], 100.0, forward, reverse)
        assert np.abs(i - data[f"i_{name}_A"]).max() <= 1e-15
        assert np.abs(v - data[f"v_{name}_V"]).max() <= 2e-15
