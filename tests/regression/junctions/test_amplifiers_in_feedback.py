"""Amplifiers of high gain in a loop of feedback without storage: each linearisation outside the few
microvolts in which they amplify is blind to these.

Newton's method went round in circles, and the ways with an artificial time oscillated: precision
rectifiers at gains of real operational amplifiers had no solution (NS3004).  Columns that were
scaled while a junction conducted 1e150 S looked open ever after.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice.circuit import Circuit

LIMIT = 12.0
SATURATION = {
    "tanh": "VALUE={{12*tanh({gain}/12*({u}))}}",
    "limit": "VALUE={{limit({gain}*({u}),-12,12)}}",
    "table": "TABLE {{{u}}} = ({low},-12) ({high},12)",
}
CARD = ".model d D(IS=1e-14 RS=1)\n.model qn NPN(IS=1e-14 BF=100)\n.tran 10u 2m\n"


def deck(kind: str, gain: float, u: str, text: str) -> Circuit:
    law = SATURATION[kind].format(gain=gain, u=u, low=-LIMIT / gain, high=LIMIT / gain)
    return nsspice.read(f"feedback\nE1 o 0 {law}\n{text}{CARD}")


def input_at_most(gain: float) -> float:
    """What the amplifier needs between its inputs for 3 V at its output [V]."""
    return 12.0 * math.atanh(3.0 / LIMIT) / gain


@pytest.mark.parametrize("method", ["sdirk", "moreau"])
@pytest.mark.parametrize("gain", [1e3, 1e5, 1e7])
@pytest.mark.parametrize("kind", list(SATURATION))
def test_a_precision_rectifier(kind: str, gain: float, method: str) -> None:
    text = "V1 s 0 SIN(0 2 1k)\nD1 o q d\nR1 q 0 10k\n"
    run = nsspice.tran(deck(kind, gain, "v(s)-v(q)", text), method=method)
    assert run.certificate.passed
    leakage = 1e4 * 1.01e-14
    error = np.abs(run["v(q)"] - np.maximum(run["v(s)"], 0.0)).max()
    assert error <= input_at_most(gain) + leakage


@pytest.mark.parametrize("gain", [1e3, 1e5, 1e7])
@pytest.mark.parametrize("kind", ["tanh", "limit"])
def test_an_amplifier_drives_a_transistor(kind: str, gain: float) -> None:
    """A current source: the emitter follows the input from the first point on."""
    text = "V1 s 0 1\nQ1 c o e qn\nRe e 0 100\nVc cc 0 10\nRc cc c 200\n"
    point = nsspice.op(deck(kind, gain, "v(s)-v(e)", text))
    assert abs(point["v(e)"][0] - 1.0) <= input_at_most(gain)


@pytest.mark.parametrize("gain", [1e3, 1e4, 1e5, 1e6, 1e8])
def test_a_peak_detector_from_rest(gain: float) -> None:
    """The capacitor behind a resistance holds no node; the first step begins at 0 V everywhere."""
    text = "V1 s 0 SIN(0 2 1k)\nD1 o q d\nC1 q x 100n\nR3 x 0 1\nR2 q 0 100k\n"
    for method in ("sdirk", "moreau"):
        run = nsspice.tran(deck("tanh", gain, "v(s)-v(q)", text), method=method)
        assert run.certificate.passed
        assert abs(run["v(q)"].max() - 2.0) <= input_at_most(gain) + 1e-3
