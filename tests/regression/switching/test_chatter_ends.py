"""What is chatter, when it is over, and what it costs: no window follows the length of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from decks.chattering import CHATTER, late_but_sound
from decks.output_points import told

import nsspice
from nsspice.cli.app import app

DRIVE = Path(__file__).with_name("drive.net")


def test_short_pulses_of_a_drive_are_no_chatter() -> None:
    """Impulsive steps moved a fast current, and with it controls back across their thresholds.

    The switches turned twice at one instant, again at the next pulse 2 us later, and were sampled
    for the rest of 100 ms: 0.046 A of 17 A wrong, 70 times as much work.
    """
    run = nsspice.read(DRIVE).run()[0]
    assert run.certificate.passed
    assert not [w for w in run.warnings if w.code != "NS5004"]
    # a hysteresis of 1 mV delays each edge by 25 ns of 100 us: 600 V for that in 5 mH are 3e-3 A,
    # and 1.4e-4 A are found; sampling was off by 0.046 A
    assert run["i(la)"][-1] == pytest.approx(-0.8502, abs=1e-3)
    # six edges in each of 1000 periods, each located once, and diodes that commutate with them
    assert 6000 <= run.stats["switchings"] <= 12100
    assert run.stats["steps"] < 15_000
    assert run.stats["forced"] < 10


#: v' = d + 1 below 0, d - 1 above: slides while |d| < 1, leaves with d = 3, returns with d = -3
EXCURSION = """slides, leaves its threshold for 0.23 ms, and comes back through it
Vp p 0 1
Vn n 0 -1
C1 x 0 1 IC=0.5
I1 0 x PWL(0 0 1 0 1 3 1.00023 3 1.00023 -3 2 -3)
S1 p s 0 x SW
S2 n s x 0 SW
R1 s 0 1
G1 0 x s 0 1
.model SW SW(VT=0)
.tran 0.1m 2 uic
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_a_switch_that_has_left_its_threshold_is_followed_exactly(method: str) -> None:
    """It was sampled for 16 looks more: 0.64 ms of the 2 s in which sdirk has 50,000 looks."""
    circuit = nsspice.read(EXCURSION)
    run = nsspice.tran(circuit, method=method)
    assert told(run, lambda: nsspice.tran(circuit, method=method, all_points=True)) == ["NS3052"]
    # up with 3 - 1 V/s, but for one interval between two looks (of 40 us) at most with 3 + 1
    risen = run["v(x)"][np.searchsorted(run.time, 1.00009)]
    assert 2e-4 - 1e-9 <= risen <= 2e-4 + 2.0 * 4e-5 + 1e-9
    # down with 3 + 1
    back = 1.00023 + (risen + 2.0 * 0.13e-3) / 4.0
    late = [e.time for e in run.events if e.time > 1.00023 + 1e-9]
    assert late[0] == pytest.approx(back, abs=1e-9)


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_a_tolerance_that_is_given_up_is_no_success(method: str, tmp_path: Path) -> None:
    """Up to 9 kV/s, and 50,000 looks or more in 2 ms: up to 0.4 mV of 1 V beyond the threshold."""
    deck = tmp_path / "chatter.net"
    deck.write_text(CHATTER)
    args = ["run", str(deck), "-o", str(tmp_path / "out.csv"), "--method", method]
    result = CliRunner().invoke(app, args)
    assert result.exit_code == 3, result.output
    assert "NS3052" in result.output
    assert "times the tolerance" in result.output
    assert (tmp_path / "out.csv").exists()
    result = CliRunner().invoke(app, [*args, "--reltol", "1e-3"])
    assert result.exit_code == 0, result.output


def test_the_part_that_is_given_up_is_known() -> None:
    """11 V by R1 into 1 uF less 1 V by R2 are 9 V/ms: in 5e-6 of 2 ms 90 uV of v(ref) + v(c)."""
    run = nsspice.tran(nsspice.read(CHATTER), method="modewise")
    assert late_but_sound(run.certificate)
    assert run.certificate.late == pytest.approx(9e-5 / 2.0 / 1e-5, rel=0.01)
