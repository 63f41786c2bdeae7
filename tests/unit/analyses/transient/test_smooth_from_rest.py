"""Circuits with smooth laws from given charges or from rest, and sources whose values jump."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.errors import StepError

METHODS = ["sdirk", "moreau"]


@pytest.mark.parametrize("method", METHODS)
def test_a_riccati_charge_from_rest(method: str) -> None:
    """R C v' = 5 - v - v**2 from 0, between its two equilibria."""
    deck = "rest\nB1 q 0 V={5-v(c)*v(c)}\nR1 q c 10k\nC1 c 0 10n\n.tran 1u 200u uic\n"
    run = nsspice.tran(nsspice.read(deck), method=method, step=1e-8 if method == "moreau" else None)
    root = np.sqrt(21.0)
    high, low = (-1.0 + root) / 2.0, (-1.0 - root) / 2.0
    decay = high / -low * np.exp(-root * run.time / 1e-4)
    exact = (high + low * decay) / (1.0 + decay)
    # implicit Euler: h/2 times the integral of |v''| <= |v'(0)| = 5 V / RC
    allowed = 0.5 * 1e-8 * 5.0 / 1e-4 if method == "moreau" else 1e-4
    assert np.abs(run["v(c)"] - exact).max() <= allowed
    assert not run.impulses


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "text",
    [
        "B1 0 c I={1m*(2-v(c)*v(c))}\nC2 c 0 1n",
        "B1 0 c I={1m*(2-v(d)*v(d))}\nR0 c 0 1k",
        "G1 0 c VALUE={1m*cos(v(d))}\nR0 c 0 1k",
        "B1 q 0 V={if(v(d)>9, 0, 5)}\nR0 q c 1k",
    ],
)
def test_functions_that_drive_a_circuit_at_rest(text: str, method: str) -> None:
    """The functions alone say how large everything is; nothing jumps at the start."""
    circuit = nsspice.read(f"rest\n{text}\nR1 c d 10k\nC1 d 0 10n\n.tran 1u 20u uic\n")
    run = nsspice.tran(circuit, method=method)
    assert run.certificate.passed
    assert abs(run["v(d)"][0]) <= 1e-15 * run["v(d)"][-1]
    assert run["v(d)"][-1] > 0.05
    assert not run.impulses


@pytest.mark.parametrize("method", METHODS)
def test_a_threshold_is_passed_and_sliding_refused(method: str) -> None:
    """The source falls at 1 V, where the voltage still rises, and at 2 V, where it cannot stay.

    Beyond 2 V another law holds, which is no linear one, so that the condition is no comparator.
    """
    deck = (
        "threshold\nB1 q 0 V={if(v(c)>2, 0.1*v(c)^2-0.4, if(v(c)<1, 5, 2.5))}\n"
        "R1 q c 10k\nC1 c 0 10n\n.tran 1u 1m uic\n"
    )
    circuit = nsspice.read(deck)
    with pytest.raises(StepError) as caught:
        nsspice.tran(circuit, method=method, step=1e-7 if method == "moreau" else None)
    stop = 1e-4 * (np.log(5.0 / 4.0) + np.log(1.5 / 0.5))
    step = 1e-7 if method == "moreau" else 1e-9
    assert caught.value.time == pytest.approx(stop, abs=2.0 * step)
    assert "b1 may jump back and forth" in str(caught.value)


def test_the_gain_with_limits_that_the_message_names_slides() -> None:
    deck = "slides\nB1 0 c I={1m*limit(-1e6*v(c),-1,1)}\nC1 c 0 1u IC=1\n.tran 10u 3m uic\n"
    run = nsspice.tran(nsspice.read(deck))
    exact = np.maximum(1.0 - 1e3 * run.time, 0.0)
    assert np.abs(run["v(c)"] - exact).max() <= 1e-5


@pytest.mark.parametrize("method", METHODS)
def test_a_floating_charge_starts_within_the_laws(method: str) -> None:
    """A junction with charge beside a capacitor: their voltage is stored, not their potential."""
    deck = (
        "floats\nV1 a 0 SIN(1 1 1k)\nR1 a b 600\nR2 b c 1k\nR3 d a 180\nD1 d c DM\n"
        "C1 d c 1u IC=0.3\nR4 c 0 1k\n.model DM D(IS=1e-14 N=1.5 RS=1 CJO=10p TT=5n)\n"
        ".tran 10u 1m uic\n"
    )
    run = nsspice.tran(nsspice.read(deck), method=method)
    assert run.certificate.passed
    a, b, c, d = (run[f"v({node})"][0] for node in "abcd")
    assert d - c == pytest.approx(0.3, rel=1e-9)
    # no charge in b: what comes from a goes to c
    assert (a - b) / 600.0 == pytest.approx((b - c) / 1e3, rel=1e-9)


def test_picofarads_of_a_transistor_are_charged_and_do_not_jump():
    """10 Ohm charge 3 pF in 30 ps; the step of the run is millions of times as long."""
    circuit = nsspice.read("""a source of 1 V at once, nothing charged
V1 n0 0 SIN(1 5 193.9)
Rs n0 n1 9.82
R2 n2 n1 248
Ry n2 0 139
D1 n1 0 DM
Q2 n1 0 n2 QN
C4 0 n2 22.6u IC=0
.model DM D(IS=1e-12)
.model QN NPN(IS=1e-14 BF=100 VAF=80 CJE=5p CJC=3p TF=1n)
.tran 51.58u 5.158m uic
""")
    run = nsspice.tran(circuit, method="sdirk", signals=["v(n1)", "v(n2)"])
    assert run.certificate.passed
    assert run.stats["jumps"] == 0
    # what a millionth of the time constant leaves of 1 V
    assert abs(run["v(n1)"][0]) < 1e-5
