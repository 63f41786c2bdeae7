"""Measures of outputs that no polynomial follows: the halving of steps comes to an end."""

from __future__ import annotations

from pathlib import Path

import nsspice

DECK = Path(__file__).parents[3] / "netlists" / "rectifiers" / "full_bridge_capacitor.net"


def test_outputs_of_rounding_are_no_reason_to_halve_steps_for_ever() -> None:
    """At reltol 1e-8 currents of diodes that block are rounding of what conducts elsewhere.

    The values are the closed form in ``full_bridge_capacitor.expect.toml``.  The run took no end.
    """
    run = nsspice.read(DECK).run(method="sdirk", reltol=1e-8)[0]
    assert run.certificate is not None
    assert run.certificate.passed
    # each of 663 steps errs by 1e-8 of 325 V at most
    assert abs(run.measures["v_avg"] - 313.06157161405764) < 663 * 3.25e-6
    assert abs(run.measures["v_low"] - 300.2739720421427) < 663 * 3.25e-6
