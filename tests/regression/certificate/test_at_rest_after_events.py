"""Right after an event of a network nearly at rest: what flows are currents of open switches."""

from __future__ import annotations

import pytest
from decks.random_converters import converter

import nsspice


@pytest.mark.parametrize("seed", [10302, 510172, 510181])
def test_currents_of_open_switches_are_what_rounding_is_measured_by(seed: int) -> None:
    """Inductors in series that carry 1e-21 A where 5 V lie across 1 MOhm: the rounding of 5 uA."""
    run = nsspice.tran(nsspice.read(converter(seed)), method="sdirk", reltol=1e-6)
    assert run.certificate.passed
    exact = nsspice.tran(nsspice.read(converter(seed)), method="modewise")
    assert exact.certificate.passed
