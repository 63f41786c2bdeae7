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


def test_the_exact_engine_follows_a_branch_until_it_ends() -> None:
    run = nsspice.tran(nsspice.read(RELAXATION), method="modewise", all_points=True)
    t, out = run.time, run["v(out)"]
    rising = t[1:][(out[1:] > 0) & (out[:-1] <= 0)]
    assert rising.size == 9
    # instants are known to their rounding
    assert np.diff(rising) == pytest.approx(period(), rel=1e-13)


@pytest.mark.parametrize(("start", "level"), [(0.1, -1.0), (-0.1, 1.0), (0.0, 1.0), (8.0, -1.0)])
@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_it_begins_where_a_circuit_would_rest(start: float, level: float, method: str) -> None:
    """A third solution lies between both limits; any lag of the amplifier leaves it."""
    deck = RELAXATION.replace("IC=0.1", f"IC={start}").replace("20m", "20u")
    run = nsspice.tran(nsspice.read(deck), method=method)
    total = 1 / 100 + 1 / 20e3 + 1 / 10e3  # as in `period`
    expected = (level * 12 / 100 + start / 10e3) / total
    assert run["v(out)"][0] == pytest.approx(expected, rel=1e-9)


def test_steps_jump_over_a_fold_where_they_are_not_tiny():
    """A magnitude in a loop: near its kink no solution goes on, shorter steps have none either."""
    circuit = nsspice.read("""a current follows the magnitude of a voltage that it makes
V1 n0 0 SIN(0 12 5944)
Rs n0 n1 45.9
R2 n2 n1 7.41k
R3 n3 n2 1.27k
R4 n4 0 350
B0 n2 n4 I={1m*abs(v(n3))}
B1 n3 n1 I={1m*tanh(v(n1))}
C2 n1 n4 40.1n
B3 y3 0 V={atan(v(n3))}
Ry3 y3 n3 605
B4 n1 n4 I={2m*sin(6.28*5944*time)}
.tran 1.682u 0.5047m
""")
    names = ["v(n1)", "v(n2)", "v(n3)", "v(n4)"]
    run = nsspice.tran(circuit, method="sdirk", signals=names)
    # picosecond steps have large terms with E / h, whose rounding hides what the laws say
    assert run.certificate.passed
    assert run.stats["steps"] < 400
    step = run.time[1]
    coarse, fine = (
        nsspice.tran(circuit, method="moreau", step=step / n, signals=names) for n in (10, 20)
    )
    for name in names:
        # first order: the difference of two steps is the error of the finer
        apart = np.abs(coarse[name] - fine[name]).max()
        assert np.abs(run[name] - fine[name]).max() <= 2 * apart, name
