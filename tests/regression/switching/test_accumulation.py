"""Events that pile up and motions that stop, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from decks.chattering import late_but_sound
from decks.output_points import told

import nsspice


def run(text: str, stop: float, rows: int = 200, *, all_points: bool = False):
    """Run mode by mode from given initial values."""
    sol = nsspice.tran(
        nsspice.read(text),
        stop=stop,
        row_step=stop / rows,
        uic=True,
        method="modewise",
        all_points=all_points,
    )
    assert sol.certificate.passed or late_but_sound(sol.certificate)
    return sol


@pytest.mark.parametrize("gain", [2, 39, 199])
def test_a_spiral_of_infinitely_many_switchings(gain):
    """x' = -sgn x + k sgn y, y' = -k sgn x - sgn y from (1, 0).

    Every quarter turn shrinks by (k - 1)/(k + 1), so 0 is reached after 1/2 s and infinitely many
    switchings, while |x| + |y| falls with slope -2.  They are followed one by one until voltages
    of k |x| are less than what rounding leaves of the 1 A that was there, OF_SOLUTION k = 1e-13 k;
    what is left then vanishes, and no implicit step is needed.
    """
    text = (
        f"spiral\nL1 0 a 1 IC=1\nD1 a b SIGN\nE1 b 0 y2 c -{gain}\nL2 0 y2 1 IC=0\n"
        f"D2 y2 c SIGN\nE2 c 0 a b {gain}\n.model SIGN D(Vfwd=1 Vrev=1)\n"
    )
    sol = run(text, 2.0)
    t, x, y = sol.time, sol["i(l1)"], sol["i(l2)"]
    rounding = 2e-14 * gain
    assert np.abs(np.abs(x) + np.abs(y) - np.maximum(0.0, 1.0 - 2.0 * t)).max() < rounding
    assert np.abs(x[t > 0.51]).max() == np.abs(y[t > 0.51]).max() == 0.0
    assert sol.stats["fixed_steps"] == 0
    times = sorted({event.time for event in sol.events})
    assert len(times) > 25
    assert 2.0 * (0.5 - times[-1]) < 2e-13 * gain
    shrink = ((gain - 1) / (gain + 1)) ** np.arange(1, 26)
    assert np.abs(np.array(times[:25]) - (1.0 - shrink) / 2.0).max() < rounding


def sliding(u: float) -> str:
    """Return 1 F fed by 1 A or -1 A as it lies below or above 0, and drained by the current u."""
    return (
        f"slide\nVp p 0 1\nVn n 0 -1\nC1 x 0 1 IC=0.5\nI1 x 0 {u!r}\n"
        "S1 p s 0 x SW\nS2 n s x 0 SW\nR1 s 0 1\nG1 0 x s 0 1\n.model SW SW(VT=0)\n"
    )


@pytest.mark.parametrize("u", [0.0, 0.3, -0.6])
def test_a_relay_reaches_its_surface_and_slides(u):
    """x falls at the rate 1 + u until 0, exactly; then it stays within what one step moves it.

    No side of the threshold holds it: the switches are sampled, 200 000 times in the run, and both
    at once, so that the sources are never joined.
    """
    sol = run(sliding(u), 2.0)
    t, x = sol.time, sol["v(x)"]
    reached = 0.5 / (1.0 + u)
    moving = t < reached - 1e-9
    assert np.abs(x[moving] - (0.5 - (1.0 + u) * t[moving])).max() < 1e-14
    assert sol.stats["fixed_steps"] == 0
    assert np.abs(x[t > reached + 1e-9]).max() <= (1.0 + abs(u)) * 2.0 * 5e-6
    assert sol.certificate.energy.scheme == 0.0
    assert told(sol, lambda: run(sliding(u), 2.0, all_points=True)) == ["NS3052"]


def test_dry_friction_stops_a_mass_and_holds_it():
    """i' = u - 1 from 2 A: at rest after 2 s, held under 0.9 V, off again under 1.5 V.

    Sticking is a mode of its own, entered where two guards vanish together: no step is needed.
    """
    text = (
        "friction\nV1 a 0 PWL(0 0 3 0 3 0.9 4 0.9 4 1.5)\nL1 a b 1 IC=2\nD1 b 0 COULOMB\n"
        ".model COULOMB D(Vfwd=1 Vrev=1)\n"
    )
    sol = run(text, 5.0)
    t, i = sol.time, sol["i(l1)"]
    exact = np.where(t < 4.0, np.maximum(0.0, 2.0 - t), 0.5 * (t - 4.0))
    assert np.abs(i - exact).max() < 1e-14
    assert np.abs(sol["v(b)"] - 0.9)[(t > 3.0 + 1e-9) & (t < 4.0 - 1e-9)].max() < 1e-14
    assert sol.stats["fixed_steps"] == 0
