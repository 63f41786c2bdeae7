"""Modes of index three by steps with error control: currents were off by 5595 A, certified."""

from __future__ import annotations

import pytest
from decks.index_three import INDEX_THREE

import nsspice


@pytest.mark.parametrize("reltol", [1e-3, 1e-5, 1e-7])
def test_a_mode_of_index_three_is_refused_by_name(reltol: float) -> None:
    circuit = nsspice.read(INDEX_THREE)
    with pytest.raises(nsspice.StepError, match=r"d1 blocks .* index above 2") as failed:
        nsspice.tran(circuit, method="sdirk", reltol=reltol)
    assert failed.value.code == "NS3011"


#: the diode the other way round; the capacitor begins with the voltage of the source
REVERSED = """The step over the end of the mode shows no error
V1 a 0 SIN(0 {volts} 1 0 0 {phase})
C1 a 0 0.1 IC={begin}
F1 0 b V1 -1
L1 b 0 0.01 IC=0
{diode}
R1 c 0 0.1
.tran 10m 2 uic
"""


@pytest.mark.parametrize(("phase", "begin", "diode"), [(0, 0, "D1 c b"), (-90, -5, "D1 b c")])
def test_a_small_error_estimate_is_no_excuse(phase: float, begin: float, diode: str) -> None:
    """Runs that no step had trouble with were off by 900 times the range, certified."""
    deck = REVERSED.format(volts=5, phase=phase, begin=begin, diode=diode)
    with pytest.raises(nsspice.StepError, match="index above 2"):
        nsspice.tran(nsspice.read(deck), method="sdirk", reltol=1e-4)


@pytest.mark.parametrize("gain", [0.5, -3.0])
def test_what_only_observes_may_have_a_high_index(gain: float) -> None:
    """Nothing acts back on the source: such a network passed for passive, and ended in NS3001."""
    deck = f"""no diode
V1 a 0 SIN(0 1 1k)
C1 a 0 1u
F1 0 b V1 {gain}
L1 b 0 1m
.tran 1u 20u uic
"""
    with pytest.raises(nsspice.StepError, match="index above 2"):
        nsspice.read(deck).run(method="sdirk")


def test_the_hint_helps() -> None:
    """A resistor beside the coil takes what its current does not: the index is 2."""
    bounded = INDEX_THREE.replace("D1 b c", "D1 b c\nRp b 0 100")
    run = nsspice.tran(nsspice.read(bounded), method="sdirk", reltol=1e-6)
    exact = nsspice.tran(nsspice.read(bounded), method="modewise")
    assert run.certificate.passed
    assert abs(run["i(l1)"] - exact["i(l1)"]).max() < 1e-3 * abs(exact["i(l1)"]).max()
