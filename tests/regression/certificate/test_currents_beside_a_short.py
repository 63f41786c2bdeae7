"""Currents that a node of fixed potential separates are no measure of each other.

A junction across a source of 3 V carries 1e35 A. An ideal clamp on the same node was judged by
them: it carried 9 mA backward, certified.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

CLAMP = """\
junction without resistance across a source, an ideal clamp beside it
V1 in 0 SIN(0 3 1k)
DJ in 0 DM
C1 in a 1u
D1 0 a
R1 a 0 1k
.model DM D(IS=1e-15)
.tran 20u 3m
.end
"""


@pytest.mark.parametrize("method", ["sdirk", "moreau"])
def test_a_clamp_beside_a_junction(method: str) -> None:
    circuit = nsspice.read(CLAMP)
    solution = nsspice.tran(circuit, stop=3e-3, step=2e-6, method=method)
    alone = nsspice.read(CLAMP.replace("DJ in 0 DM\n", "").replace(".model DM D(IS=1e-15)\n", ""))
    exact = nsspice.tran(alone, stop=3e-3, step=2e-6, method="modewise")
    current, peak = solution["i(d1)"], 2 * np.pi * 1e3 * 3.0 * 1e-6
    assert solution.certificate.passed
    # the certificate grants 1e-8 of what meets there
    assert current.min() >= -1e-8 * peak
    if method == "sdirk":
        error = np.sort(np.abs(current - exact["i(d1)"]))[-8]  # points beside events left out
        assert error <= 1e-3 * peak
