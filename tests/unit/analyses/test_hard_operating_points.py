"""Operating points of amplifiers and references that feed themselves back."""

from __future__ import annotations

import pytest
from regulator_deck import REGULATOR

import nsspice


@pytest.mark.parametrize("volts", [7.25, 8.5, 9.25, 9.5, 13.25, 13.5, 13.75, 20.0])
def test_a_regulator_at_any_supply(volts: float) -> None:
    """Which supplies had an operating point was chance: 74 of 81 between 0 V and 20 V."""
    point = nsspice.op(nsspice.read(REGULATOR), values={"vin": volts})
    assert point.certificate.passed
    assert point["v(out)"][0] == pytest.approx(5.00284, abs=1e-4)
