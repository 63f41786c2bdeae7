"""The first state of a run against the charges of the deck, and charges that cannot have passed."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.analyses.certificate.charge_paths import unexplained
from nsspice.analyses.certificate.first_state import FirstState
from nsspice.circuit import MnaSystem

#: 1 uF at 5 V behind a diode that lets it discharge 3 uF, or not
SHARED = """two capacitors
C1 a 0 1u IC={first}
D1 a b
C2 b 0 3u IC=1
R1 b 0 1k
.tran 1u 10u uic
"""


def system(text: str) -> MnaSystem:
    """Return the equations of a circuit of one island."""
    return nsspice.read(text).islands[0].assemble()


def test_charges_pass_diodes_forward() -> None:
    found = system(SHARED.format(first=5)).system
    assert found.n == 2
    volts = np.full(2, 2.0)  # (1 uF 5 V + 3 uF 1 V) / 4 uF
    given = found.E.dot(np.array([5.0, 1.0]))
    assert unexplained(found, found.E.dot(volts) - given, volts) < 1e-12
    # the same the other way round, and a charge that is gone
    assert unexplained(found, given - found.E.dot(volts), volts) > 0.1
    assert unexplained(found, 0.5 * found.E.dot(volts) - given, volts) > 0.1


@pytest.mark.parametrize("first", [5.0, 0.5])
@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_sound_runs_begin_with_their_charges(first: float, method: str) -> None:
    circuit = nsspice.read(SHARED.format(first=first))
    assert nsspice.tran(circuit, method=method).certificate.passed


def test_a_charge_that_is_a_millionth_off_is_seen() -> None:
    found = system("one\nC1 a 0 1u IC=5\nR1 a 0 1k\n.tran 1u 1m uic\n").system
    state = np.array([5.0])
    given = found.E.dot(state)
    assert FirstState.of(found, given, state).error(1e-5) == 0.0
    error = FirstState.of(found, given, state * (1.0 + 1e-6)).error(1e-5)
    # of the 12.5 uJ, as a root, beside 10 uJ that the run moves
    assert error == pytest.approx(1e-6, rel=1e-3)


def test_rounding_of_what_a_gain_lifts_is_no_charge() -> None:
    """4e-9 V across a capacitor at rest are 4e-9 of the volt that the run moves there."""
    found = system("one\nC1 a 0 1u\nR1 a 0 1k\n.tran 1u 1m\n").system
    state = np.zeros(found.n)
    state[0] = 4e-9
    assert FirstState.of(found, np.zeros(found.n), state).error(0.5e-6) == pytest.approx(4e-9)
