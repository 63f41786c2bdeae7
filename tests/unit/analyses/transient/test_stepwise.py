"""Transients that are advanced by hand, against closed forms and against controllers."""

from __future__ import annotations

import math

import pytest

import nsspice
from nsspice import Controller
from nsspice.errors import NetlistError, UsageError

RC = """RC
Vin a 0 0.25
Vother c 0 SIN(0 1 100)
Rother c 0 1k
R1 a b 1k
C1 b 0 1u
"""


@pytest.mark.parametrize(("method", "error"), [("modewise", 1e-14), ("sdirk", 1e-5)])
def test_a_source_is_set_between(method: str, error: float) -> None:
    sim = nsspice.start(nsspice.read(RC), ["Vin"], method=method)
    assert sim["v(b)"] == pytest.approx(0.25, abs=error)
    value = 0.25
    for k, (source, duration) in enumerate(
        [(1.0, 1e-3), (-1.0, 0.3e-3), (-1.0, 2e-3), (0.5, 1e-4)]
    ):
        sim["vin"] = source
        sim.advance(duration)
        value = source + (value - source) * math.exp(-duration / 1e-3)
        assert sim["v(b)"] == pytest.approx(value, abs=error), k
        assert sim["vin"] == sim["v(a)"] == source
    assert sim["v(c)"] == pytest.approx(math.sin(200.0 * math.pi * sim.time), abs=1e-12)
    assert sim.time == pytest.approx(3.4e-3)
    assert sim.certificate is not None
    assert sim.certificate.passed


def test_it_is_what_a_controller_does() -> None:
    deck = """buck
Vin in 0 24
Vgate g 0 0
S1 in sw g 0 ideal
D1 0 sw
L1 sw out 100u IC=0
C1 out 0 100u IC=0
R1 out 0 5
.model ideal SW(VT=0.5)
.tran 10u 1m uic
"""

    def hysteresis(time, values):
        return 1.0 if values[0] < 3.0 else 0.0

    seen = []
    controller = Controller(
        10e-6, ["i(l1)"], ["vgate"], lambda t, v: seen.append(v[0]) or hysteresis(t, v)
    )
    nsspice.tran(nsspice.read(deck), controllers=[controller])
    sim = nsspice.start(nsspice.read(deck), ["vgate"], uic=True)
    for current in seen:
        assert sim["i(l1)"] == pytest.approx(current, abs=1e-12)
        sim["vgate"] = hysteresis(sim.time, [sim["i(l1)"]])
        sim.advance(10e-6)


def test_refused() -> None:
    circuit = nsspice.read(RC)
    for inputs, error in ((["r1"], UsageError), (["nobody"], NetlistError), ("vin", UsageError)):
        with pytest.raises(error):
            nsspice.start(circuit, inputs)
    sim = nsspice.start(circuit, ["vin"], stop=1e-3)
    for call in (
        lambda: sim.advance(0.0),
        lambda: sim.advance(math.nan),
        lambda: sim.advance(2e-3),
        lambda: sim.__setitem__("vother", 1.0),
        lambda: sim.__setitem__("vin", math.inf),
    ):
        with pytest.raises(UsageError):
            call()
    with pytest.raises(KeyError, match="no signal"):
        sim["v(nowhere)"]
    assert sim.advance(1e-3).time == 1e-3
