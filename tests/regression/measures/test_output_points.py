"""Output points that alias: a ripple of a converter with one output point in each period."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import nsspice
from nsspice.cli.app import app

FILE = Path(__file__).with_name("al.net")
DECK = FILE.read_text()


def hidden(solution: nsspice.Solution) -> list[str]:
    return [w.message for w in solution.warnings if w.code == "NS5004"]


def test_a_run_says_what_its_output_points_do_not_show() -> None:
    sol = nsspice.read(DECK).run()[0]
    late = sol.time >= 4e-3
    assert np.ptp(sol["v(sw)"][late]) == 0.0
    (message,) = hidden(sol)
    assert "v(sw) by 24 V" in message
    assert "i(l1) by" in message
    # the ripple of v(out) is 9 mV: nobody wants to hear of it
    assert "v(out)" not in message
    # what is exact does not depend on them
    assert sol.measures["ipp"] == pytest.approx(0.712706239566, rel=1e-10)
    assert sol.measures["vsw"] == pytest.approx(12.0, rel=1e-12)


@pytest.mark.parametrize("rows", ["2u", "1u", "0.1u"])
def test_enough_output_points_are_no_reason_for_a_warning(rows: str) -> None:
    assert not hidden(nsspice.read(DECK.replace("10u 5m", f"{rows} 5m")).run()[0])


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_ringing_without_any_event_is_seen(method: str) -> None:
    deck = "tank\nL1 a 0 1m IC=0\nC1 a 0 {1/(1m*(2*pi*10k)**2)} IC=2\n.tran {t} 5m uic\n"
    (message,) = hidden(nsspice.tran(nsspice.read(deck.replace("{t}", "0.2m")), method=method))
    assert "v(a) by" in message
    assert not hidden(nsspice.tran(nsspice.read(deck.replace("{t}", "20u")), method=method))


def test_the_command_says_so_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.net").write_text("\n".join(x for x in DECK.splitlines() if ".meas" not in x))
    done = CliRunner().invoke(app, ["run", "a.net"])
    assert done.exit_code == 0
    assert "NS5004" in done.output
    assert "v(sw) by 24 V" in done.output
    assert "NS5004" not in CliRunner().invoke(app, ["run", "a.net", "--all-points"]).output


def test_all_points_show_the_ripple() -> None:
    sol = nsspice.tran(nsspice.read(DECK), all_points=True)
    late = sol.time >= 4e-3
    assert np.ptp(sol["i(l1)"][late]) == pytest.approx(0.712706239566, rel=1e-10)


def test_statistics_over_the_run_not_over_the_grid() -> None:
    sol = nsspice.read(DECK).run()[0]
    window = {"start": 4e-3, "stop": 5e-3}
    assert sol.average("v(sw)", **window) == pytest.approx(12.0, rel=1e-12)
    # the switch conducts half of the time, with the current of the coil
    assert sol.average("i(s1)+i(d1)-i(l1)", **window) == pytest.approx(0.0, abs=1e-12)
    assert sol.maximum("i(l1)", **window) - sol.minimum("i(l1)", **window) == pytest.approx(
        sol.measures["ipp"], rel=1e-12
    )
    # charge of the coil is that of the load and of the capacitor
    charge = sol.integral("i(l1)", **window) - sol.integral("i(r1)", **window)
    trace = sol.motion(["v(out)"], *window.values())
    ends = [
        trace.signals(np.array([k]), np.array([part]))["v(out)"]
        for k, part in ((0, 0.0), (-1, 1.0))
    ]
    assert charge == pytest.approx(1e-4 * float(ends[1][0, 0] - ends[0][0, 0]), abs=1e-15)
    # at 4 ms it has risen already, at 5 ms the run ends
    assert sol.crossings("v(sw)", 12.0, "rise", **window) == pytest.approx(
        1e-5 * np.arange(401, 500), rel=1e-12
    )
