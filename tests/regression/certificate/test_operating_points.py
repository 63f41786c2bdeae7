"""The exact engine begins with an operating point, which has to solve the static laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nsspice
from nsspice.solvers.moreau import MoreauStepper, Records

CHAIN = """a capacitor behind a resistor, and a diode
V1 a 0 DC 4
R1 a b 1k
C1 b 0 1u
D1 b c
R2 c 0 3k
.tran 10u 100u
"""


def test_a_start_at_rest_is_certified() -> None:
    found = nsspice.tran(nsspice.read(CHAIN), method="modewise")
    assert found.certificate is not None
    assert found.certificate.passed
    assert found["v(b)"] == pytest.approx(np.full(11, 3.0), rel=1e-12)


@pytest.mark.parametrize("part", [0.0, 0.5, 1.0 + 1e-6])
def test_a_start_that_is_not_at_rest_is_refused(
    part: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken = MoreauStepper.take_records

    def damaged(self: MoreauStepper) -> Records:
        records = Records.of(taken(self))
        assert records.z.size, "the static solution is recorded"
        return replace(records, z=part * records.z)

    monkeypatch.setattr(MoreauStepper, "take_records", damaged)
    found = nsspice.tran(nsspice.read(CHAIN), method="modewise", on_failure="ignore")
    assert found.certificate is not None
    assert not found.certificate.passed
