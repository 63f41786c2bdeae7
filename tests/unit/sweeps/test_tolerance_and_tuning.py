"""Tolerances and tuning against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import nsspice
from nsspice.cli.app import app
from nsspice.sweeps.tolerance import tolerance
from nsspice.sweeps.tune import tune

DIVIDER = """divider
.param ra=1k rb=3k
V1 a 0 8
R1 a b {ra}
R2 b 0 {rb}
.op
.measure op out find v(b) at=0
"""
BUCK = """buck
.param don=0.4
Vin in 0 24
S1 in sw g 0 SH
D1 0 sw
L1 sw out 100u
C1 out 0 10u
R1 out 0 5
Vg g 0 PULSE(-1 1 0 0 0 {don*10u} 10u)
.model SH SW(VT=0)
.pss
.measure pss v_avg AVG v(out)
"""


def test_corners_and_random_values() -> None:
    (out,) = tolerance(nsspice.read(DIVIDER), {"ra": 0.1, "RB": 0.2}, runs=400, seed=3)
    assert out.nominal == 6.0
    assert out.low == pytest.approx(8 * 2.4 / (2.4 + 1.1), rel=1e-14)
    assert out.high == pytest.approx(8 * 3.6 / (3.6 + 0.9), rel=1e-14)
    # to first order: 8 (0.1875 (rb share - ra share)) with uniform shares of deviation t/sqrt 3
    deviation = 8 * 0.1875 * np.hypot(0.1, 0.2) / np.sqrt(3)
    assert out.deviation == pytest.approx(deviation, rel=0.1)  # 1/sqrt(800), three times as much
    values = [v for _, v in out.quantiles]
    assert values == sorted(values)
    assert out == tolerance(nsspice.read(DIVIDER), {"ra": 0.1, "rb": 0.2}, runs=400, seed=3)[0]


def test_the_duty_for_a_voltage() -> None:
    found = tune(nsspice.read(BUCK), {"don": (0.1, 0.9)}, {"v_avg": 15.0})
    assert found.reached
    # ideal elements in continuous conduction: the mean is the duty times the input
    assert found.parameters["don"] == pytest.approx(15.0 / 24.0, rel=1e-9)


@pytest.mark.parametrize(
    "arguments",
    [
        ["tune", "a.net", "--param", "don=0.1:0.9", "--goal", "v=1"],
        ["tune", "a.net", "--param", "duty=0.1:0.9", "--goal", "v_avg=1"],
        ["tune", "a.net", "--param", "don=0.1", "--goal", "v_avg=1"],
        ["tolerance", "a.net", "--param", "duty=5%"],
        ["tolerance", "a.net", "--param", "don=x%"],
    ],
)
def test_errors(arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.net").write_text(BUCK)
    assert CliRunner().invoke(app, arguments).exit_code == 2


def test_a_goal_out_of_reach(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.net").write_text(BUCK)
    arguments = ["tune", "a.net", "--param", "don=0.1:0.5", "--goal", "v_avg=15", "--json"]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 1
    assert '"reached": false' in result.output
