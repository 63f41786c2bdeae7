"""A source that reads the current of a charged capacitor changed the voltages after ``uic``.

The charge that such a source sees at its own node was left out of the initial charges.
"""

from __future__ import annotations

import numpy as np

import nsspice

DECK = "reads\nL1 a 0 1m ic=-0.2\nRb b 0 1\nC1 b a 6u ic=1\n{}.tran 1u 1m uic\n"


def test_reading_a_current_changes_nothing():
    alone = nsspice.tran(nsspice.read(DECK.format("")), signals=["v(a)"])
    for reader in ("F1 0 g C1 2\nRg g 0 1\n", "H1 g 0 C1 2\nRg g 0 1\n"):
        read = nsspice.read(DECK.format(reader))
        for method in ("modewise", "sdirk"):
            run = nsspice.tran(read, signals=["v(a)"], method=method, reltol=1e-9)
            # the exact engine solves combined equations, each with the rounding of 1/C
            assert np.abs(run["v(a)"] - alone["v(a)"]).max() < 1e-7
