"""Switches whose law holds in neither state: refused by name, not left in one of both."""

from __future__ import annotations

import pytest

import nsspice
from nsspice.errors import StepError

RELAY = "relay\nV1 x 0 0.3\n{switch}\nR1 a p 10k\nR2 p 0 10k\n{more}\n{card}\n"
SWITCH = "V5 s 0 5\nS1 s a x p SW\nRa a 0 1k\n.model SW SW(VT=0)"
SOURCE = "B1 a 0 V=if(v(p) > v(x), 0, 5)"


@pytest.mark.parametrize("card", [".op", ".dc V1 0.1 0.5 0.1", ".tran 1u 10u"])
@pytest.mark.parametrize(("switch", "name"), [(SWITCH, "s1"), (SOURCE, "b1")])
def test_a_relay_around_resistors_is_refused(switch: str, name: str, card: str) -> None:
    """Closed, it takes its own control below the threshold; open, above."""
    circuit = nsspice.read(RELAY.format(switch=switch, more="", card=card))
    with pytest.raises(StepError, match=f"{name} has no state") as caught:
        circuit.run()
    assert caught.value.diagnostics[0].code == "NS3007"


@pytest.mark.parametrize("method", ["auto", "sdirk", "moreau"])
@pytest.mark.parametrize(("switch", "name"), [(SWITCH, "s1"), (SOURCE, "b1")])
def test_what_is_stored_elsewhere_does_not_help(switch: str, name: str, method: str) -> None:
    """The divider takes the control across the threshold at once, whatever the capacitor holds."""
    more = "R3 p c 10k\nC1 c 0 1u IC=0"
    circuit = nsspice.read(RELAY.format(switch=switch, more=more, card=".tran 1u 1m uic"))
    with pytest.raises(StepError, match=f"{name} has no state"):
        nsspice.tran(circuit, method=method)


@pytest.mark.parametrize("switch", [SWITCH, SOURCE])
def test_what_is_stored_lets_it_slide(switch: str) -> None:
    """The voltage of a capacitor stays at the threshold, up to what one step moves."""
    text = RELAY.format(switch=switch, more="C1 p 0 1n", card=".tran 0.1u 100u")
    run = nsspice.read(text).run()[0]
    assert run.certificate.passed
    late = run.time > 50e-6
    # 5 V over 10 kOhm and 1 nF: 0.05 V in 0.1 us at most
    assert abs(run["v(p)"][late] - 0.3).max() <= 0.05


def test_positive_feedback_keeps_a_state() -> None:
    text = "latch\nV1 x 0 0.3\nB1 a 0 V=if(v(p) > v(x), 5, 0)\nR1 a p 10k\nR2 p 0 10k\n.op\n"
    assert nsspice.read(text).run()[0]["v(a)"][0] == 0.0
