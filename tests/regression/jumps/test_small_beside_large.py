"""A switch that closes across a capacitor of picofarads beside others of microfarads."""

from __future__ import annotations

import pytest

import nsspice

#: random converter 30010: 15 pF across a switch, 13 uF from its node to another one
PUMP = """charge pump
V1 in 0 400
V6 n5 0 PULSE(0 5 0 7.50078e-08 7.50078e-08 3.52537e-06 7.50078e-06)
V8 n7 0 PULSE(0 5 3.75039e-06 7.50078e-08 7.50078e-08 3.52537e-06 7.50078e-06)
D9 in n3 d
R11 in n10 2.025
C12 n10 n3 5.92e-09
S13 n2 0 n5 0 sw
C14 n2 0 1.483e-11
S15 in n2 n7 0 sw
C16 n3 n2 1.313e-05
D17 n3 n4 d
C18 n4 0 4.413e-06
R19 n4 0 7.418
.model d D(IS=1e-12 N=1.3 RS=20m CJO=200p TT=5n)
.model sw SW(VT=2.5 VH=1)
.tran 3.7504e-07 7.5008e-06
"""

#: random converter 30252: nothing flows before the switch closes
AT_REST = """inverting converter
V1 in 0 12
V5 n4 0 PULSE(0 5 0 7.1758e-08 7.1758e-08 1.87546e-06 7.1758e-06)
S6 in n2 n4 0 sw
C7 in n2 1.729e-11
R9 in n8 79.62
C10 n8 n2 2.516e-10
L11 n2 0 9.373e-06
D12 n3 n2 d
R14 n13 0 0.01793
C15 n3 n13 3.881e-05
L17 n3 n16 3.908e-05
R18 n16 0 2.129
.model d D(IS=1e-12 N=1.3 RS=20m CJO=200p TT=5n)
.model sw SW(VT=2.5 VH=1)
.tran 3.5879e-07 2.1527e-06
"""


def test_a_closed_switch_has_no_voltage() -> None:
    """C14 kept 33 uV across the switch after the jump: its charge is 1e-13 of that of C16."""
    run = nsspice.tran(nsspice.read(PUMP), all_points=True)
    assert run.certificate.passed
    conducts = abs(run["i(s13)"]) > 0.0
    assert conducts.sum() > 40
    # the closed switch is a law of its own: its voltage is a difference of 400 V and what is left
    assert abs(run["v(n2)"][conducts]).max() <= 1e-9 * 400.0


def test_a_step_from_rest_is_taken() -> None:
    """No first step was accepted: 1e-15 A could not be told from the rounding of 12 V.

    The switch closes at 3 V of the ramp (VT + VH / 2), L11 takes up 12 V from there.
    """
    run = nsspice.tran(nsspice.read(AT_REST))
    assert run.certificate.passed
    closed = 7.1758e-08 * 3.5 / 5.0
    expected = 12.0 / 9.373e-06 * (run.axis[3] - closed)
    assert run["i(l11)"][3] == pytest.approx(expected, rel=1e-3)
