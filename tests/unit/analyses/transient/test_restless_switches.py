"""Switches whose law holds in neither state: refused by name, not left in one of both."""

from __future__ import annotations

import pytest
from decks.chattering import late_but_sound

import nsspice
from nsspice.analyses.request.settings import Settings
from nsspice.errors import StepError

pytestmark = pytest.mark.usefixtures("runs_return")

RELAY = "relay\nV1 x 0 0.3\n{switch}\nR1 a p 10k\nR2 p 0 10k\n{more}\n{card}\n"
SWITCH = "V5 s 0 5\nS1 s a x p SW\nRa a 0 1k\n.model SW SW(VT=0)"
SOURCE = "B1 a 0 V=if(v(p) > v(x), 0, 5)"


@pytest.mark.parametrize("card", [".op", ".dc V1 0.1 0.5 0.1", ".tran 1u 10u"])
@pytest.mark.parametrize(("switch", "name"), [(SWITCH, "s1"), (SOURCE, "b1")])
def test_a_relay_around_resistors_is_refused(switch: str, name: str, card: str) -> None:
    """Closed, it takes its own control below the threshold; open, above."""
    circuit = nsspice.read(RELAY.format(switch=switch, more="", card=card))
    with pytest.raises(StepError, match=f"{name} has no consistent state") as caught:
        circuit.run()
    assert caught.value.diagnostics[0].code == "NS3007"


@pytest.mark.parametrize("method", ["auto", "sdirk", "moreau"])
@pytest.mark.parametrize(("switch", "name"), [(SWITCH, "s1"), (SOURCE, "b1")])
def test_what_is_stored_elsewhere_does_not_help(switch: str, name: str, method: str) -> None:
    """The divider takes the control across the threshold at once, whatever the capacitor holds."""
    more = "R3 p c 10k\nC1 c 0 1u IC=0"
    circuit = nsspice.read(RELAY.format(switch=switch, more=more, card=".tran 1u 1m uic"))
    with pytest.raises(StepError, match=f"{name} has no consistent state"):
        nsspice.tran(circuit, method=method)


@pytest.mark.parametrize("switch", [SWITCH, SOURCE])
def test_what_is_stored_lets_it_slide(switch: str) -> None:
    """The voltage of a capacitor stays at the threshold, up to what one step moves."""
    text = RELAY.format(switch=switch, more="C1 p 0 1n", card=".tran 0.1u 100u")
    run = nsspice.read(text).run()[0]
    # it slides, and is sampled 200,000 times: 5 V over 10 kOhm and 1 nF move it by 0.25 mV between
    moved = 5.0 / (10e3 * 1e-9) * 100e-6 / 200_000
    assert abs(run["v(p)"][run.time > 50e-6] - 0.3).max() <= moved
    # more than the tolerance allows: the certificate says by how much of the control's terms
    terms = (abs(run["v(p)"]) + abs(run["v(x)"])).max()
    assert late_but_sound(run.certificate)
    assert run.certificate.late * Settings().reltol * terms <= moved


@pytest.mark.parametrize(("method", "looks"), [("modewise", 200_000), ("sdirk", 50_000)])
@pytest.mark.parametrize("start", [0.0, 0.29, 1.0])
def test_a_comparison_slides_along_its_equality(method: str, looks: int, start: float) -> None:
    """It is sampled as a switch is: from either side, and from right before it."""
    text = RELAY.format(switch=SOURCE, more=f"C1 p 0 1n IC={start}", card=".tran 0.1u 100u uic")
    run = nsspice.tran(nsspice.read(text), method=method)
    assert "NS3052" in [w.code for w in run.warnings]
    # as above: what 5 V over 10 kOhm move 1 nF by between two looks
    moved = 5.0 / (10e3 * 1e-9) * 100e-6 / looks
    assert abs(run["v(p)"][run.time > 50e-6] - 0.3).max() <= moved
    assert late_but_sound(run.certificate)


def test_positive_feedback_keeps_a_state() -> None:
    text = "latch\nV1 x 0 0.3\nB1 a 0 V=if(v(p) > v(x), 5, 0)\nR1 a p 10k\nR2 p 0 10k\n.op\n"
    assert nsspice.read(text).run()[0]["v(a)"][0] == 0.0


#: closed, the switch takes its control to -v(a); open, the capacitor holds it above: in the second
#: half of the period it has no state, and the diode's resistances leave no mode to prove that in
BESIDE_A_DIODE = """switch around a diode
V1 a 0 SIN(0 325 7839)
C1 c x 0.745u
R1 x 0 0.3726
D1 a c lossy
S1 0 c c a held
.model held SW(VT=0 VH=3)
.model lossy D(Ron=0.0048 Roff=4.8Meg)
.tran 0.638u 191u uic
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk"])
def test_implicit_steps_do_not_pass_over_a_switch_without_a_state(method: str) -> None:
    with pytest.raises(StepError, match="s1 has no consistent state") as caught:
        nsspice.tran(nsspice.read(BESIDE_A_DIODE), method=method)
    # v(c) is positive after the first quarter, v(a) is not from the half of the period on
    assert caught.value.partial.time[-1] > 0.5 / 7839 * 0.5


def test_a_refusal_right_at_a_switching_keeps_what_was_computed() -> None:
    """The modes that were tried at that instant belong to no segment."""
    text = """comparator that undoes itself once the other switch closes
V1 a 0 325
L1 d m 4.745m
R1 m b 0.48
C1 b x 12.1n
R2 x 0 2.078
S1 d 0 q 0 fast
B1 q 0 V={(v(d)>2 && v(saw)>0.198) ? 1 : 0}
V2 saw 0 PULSE(0 1 0 1.647u 1.647u 0 3.295u)
S2 b a g 0 fast
V3 g 0 PULSE(0 1 2.8553u 0 0 2.4945u 3.29477u)
.model fast SW(VT=0.5)
.tran 0.3295u 98.8u
"""
    state = r"b1 has no consistent state at t = 2\.8553e-06 s"
    with pytest.raises(StepError, match=state) as caught:
        nsspice.tran(nsspice.read(text))
    partial = caught.value.partial
    assert partial.certificate.passed
    assert partial.time[-1] == pytest.approx(2.636e-6)
