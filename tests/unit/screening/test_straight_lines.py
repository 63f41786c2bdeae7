"""A junction that conducts may become a forward drop and a resistance, fitted to its currents."""

from __future__ import annotations

import math

import pytest

import nsspice
from nsspice.devices.temperature import thermal_voltage
from nsspice.screening import effects
from nsspice.screening.line_fit import straight

BUCK = """buck with a Schottky diode, its card on two lines
Vin in 0 24
Vg g 0 PULSE(0 1 0 10n 10n 5u 10u)
S1 in sw g 0 mos
D1 0 sw DS
L1 sw out 100u IC=2.4
C1 out 0 47u IC=11.7
R1 out 0 5
.model mos SW(VT=0.5 Ron=10m)
.model DS D(IS=1u N=1.05 RS=20m
+ CJO=200p VJ=0.4)
.tran 1u 300u uic
.measure tran vavg AVG v(out) FROM=100u TO=300u
.end
"""


def test_the_line_meets_the_curve_at_the_largest_current_and_its_quarter() -> None:
    circuit = nsspice.read(BUCK)
    (edit,) = straight(circuit, {"d1": 4.0})
    line = {k: float(v) for k, v in (part.split("=") for part in edit.key.split())}
    for current in (4.0, 1.0):
        curve = 1.05 * thermal_voltage(300.15) * math.log1p(current / 1e-6) + 0.02 * current
        assert line["vfwd"] + line["ron"] * current == pytest.approx(curve, rel=2e-3)


def test_a_diode_that_never_conducts_has_no_line() -> None:
    assert not list(straight(nsspice.read(BUCK), {"d1": 1e-9}))


def test_a_line_is_recommended_and_the_deck_is_exact() -> None:
    report = effects(nsspice.read(BUCK), 2e-3, workers=1)
    verdicts = {row.edit.effect: row.verdict for row in report.rows}
    assert verdicts["curvature of the junction"] == "drop"
    assert (
        verdicts["exponential junction"] == "keep"
    )  # without any drop 0.2 V of 11.7 V are missing
    assert report.methods == (("sdirk",), ("modewise",))
    text = report.deck(BUCK, nsspice.read(BUCK).deck)
    assert "\n* + CJO=200p" in text
    (run,) = nsspice.read(text).run()
    assert run.measures["vavg"] == pytest.approx(report.values["vavg"], rel=1e-9)
    assert run.measures["vavg"] == pytest.approx(report.reference["vavg"], rel=2e-3)
