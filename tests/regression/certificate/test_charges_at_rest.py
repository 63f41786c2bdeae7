"""Charges of junctions at rest beside supplies: rounding of 5 V is no charge that was lost."""

from __future__ import annotations

from pathlib import Path

import nsspice

NETLISTS = Path(__file__).parents[3] / "netlists"


def test_gates_at_rest_are_certified_by_steps_with_error_control() -> None:
    """Before the inputs rise most nodes are at 0 V: sums of 5 V and -5 V along the tree.

    A junction of 1 pF stores 1e-27 C at their rounding, 1e-15 V, far more than its own charge.
    """
    text = (NETLISTS / "bipolar/adder_4bit.net").read_text("utf-8")
    shorter = text.replace(".tran 1n {6*t} 0 1n uic", ".tran 1n 1n 0 1n uic")
    assert shorter != text
    (sol,) = nsspice.read(shorter).run(method="sdirk")
    assert sol.certificate.laws < 1e-8
