"""Laws without memory that jump: a comparator with positive feedback folds, and when."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice

RELAXATION = """Oscillator: an amplifier that saturates, positive feedback by a divider
E1 raw 0 TABLE {V(p,n)} = (-1m,-12) (1m,12)
R0 raw out 100
R1 out p 10k
R2 p 0 10k
R3 out n 10k
C1 n 0 100n IC=0.1
.tran 10u 20m uic
"""


def period() -> float:
    """Return the exact period [s].

    While the amplifier is saturated, v(out) = a + b v(n) by the currents of that node, and the
    capacitor tends to a / (1 - b); the amplifier leaves saturation at v(p) - v(n) = 1 mV, and since
    the gain of its loop exceeds one it cannot stay in between.
    """
    total = 1 / 100 + 1 / 20e3 + 1 / 10e3
    a, b = 12 / 100 / total, 1 / 10e3 / total
    end, trip = a / (1 - b), (a / 2 - 1e-3) / (1 - b / 2)
    return 2 * 10e3 * 100e-9 / (1 - b) * math.log((end + trip) / (end - trip))


# an instant errs by what the voltage does, whose tolerance is relative to 12 V, over the slope
# that it has there; the steps of a period may add up to ten times the tolerance
@pytest.mark.parametrize("reltol", [1e-5, 1e-7])
def test_the_instant_of_a_fold_is_found_to_the_tolerance(reltol: float) -> None:
    run = nsspice.tran(nsspice.read(RELAXATION), reltol=reltol, all_points=True)
    t, out = run.time, run["v(out)"]
    rising = t[1:][(out[1:] > 0) & (out[:-1] <= 0)]
    assert rising.size == 9
    found = np.diff(rising)
    slope = 6.0 / 1e-3  # [V/s] of the capacitor at the threshold: (12 - 6) V / (R C)
    allowed = 10 * reltol * 12 / slope
    assert np.abs(found - period()).max() <= allowed
