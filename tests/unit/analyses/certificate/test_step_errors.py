"""Errors of steps with error control, as the certificate finds them by a quadrature of its own."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sqrt

import numpy as np
import pytest

import nsspice
from nsspice.analyses.certificate.certificate import MISSED, Certificate

#: an undamped circuit of 1 V and sqrt(L/C) = 100 Ohm, ten periods of 10 us
RINGING = """ringing
L1 a 0 {100 * 1e-5 / (2 * pi)}
C1 a 0 {1e-5 / (200 * pi)} IC=1
.tran 1u 100u uic
"""


@pytest.mark.parametrize("reltol", [1e-3, 1e-5, 1e-7])
def test_steps_err_as_asked_and_so_does_the_run(reltol: float) -> None:
    run = nsspice.tran(nsspice.read(RINGING), method="sdirk", reltol=reltol)
    assert run.certificate is not None
    assert 1e-4 < run.certificate.missed < 1.0
    # the errors of N steps add up to N times one at most
    steps = run.islands[0].stats["steps"]
    error = np.abs(run["v(a)"] - [cos(2.0 * pi * 1e5 * t) for t in run.time]).max()
    assert error < 2.0 * steps * reltol * run.certificate.missed * sqrt(2.0)


def test_steps_that_miss_what_was_asked_fail() -> None:
    right = Certificate(1e-14, 0.0, 3, missed=0.9 * MISSED)
    wrong = replace(right, missed=1.1 * MISSED)
    assert right.passed
    assert not wrong.passed
    assert not replace(right, missed=float("nan")).passed
    assert Certificate.total([right, wrong, right]).missed == wrong.missed
    assert wrong.to_dict()["missed"] == wrong.missed


def test_steps_of_a_given_length_have_no_tolerance() -> None:
    circuit = nsspice.read(RINGING)
    run = nsspice.tran(circuit, method="moreau", step=1e-8, on_failure="ignore")
    assert run.certificate is not None
    assert run.certificate.missed == 0.0
