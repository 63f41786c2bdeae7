"""``nsspice fmu``: a deck in a co-simulation of another tool gives what it gives by itself."""

from __future__ import annotations

import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import Result

import nsspice

Call = Callable[..., Result]

BUCK = """synchronous ramp against a reference
.param rload=5 vin={vout/0.4} vout=4.8
V1 in 0 {vin}
S1 in sw g 0 fast
D1 0 sw
L1 sw out 100u
C1 out 0 10u
R1 out 0 {rload}
Vramp ramp 0 PULSE(0 1 0 5u 5u 0 10u)
Vref ref 0 0.4
B1 g 0 V={v(ref)-v(ramp)}
.include fast.inc
.tran 1u 200u uic
"""


@pytest.fixture
def fmu(call: Call) -> Any:
    """Return the function that simulates the exported deck, its master being fmpy."""
    fmpy = pytest.importorskip("fmpy")
    pytest.importorskip("pythonfmu3")
    Path("fast.inc").write_text(".model fast SW(VT=0)\n", "utf-8")
    Path("buck.net").write_text(BUCK, "utf-8")
    told = call("fmu", "buck.net", "--input", "Vref", "--signals", "v(out) i(l1)")
    assert told.exit_code == 0, told.stderr
    Path("fast.inc").rename("away.inc")

    def simulate(step: float, **more: Any) -> Any:
        found = fmpy.simulate_fmu(
            "buck.fmu", stop_time=200e-6, step_size=step, output_interval=step, **more
        )
        Path("away.inc").rename("fast.inc")
        return found

    return simulate


def test_a_deck_runs_in_another_tool(fmu: Any) -> None:
    found = fmu(1e-6)
    alone = nsspice.tran(nsspice.read(Path("buck.net")))
    for name, own in (("v.out", "v(out)"), ("i.l1", "i(l1)")):
        expected = np.interp(found["time"], alone.axis, alone[own])
        assert found[name] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_parameters_and_inputs_are_set(fmu: Any) -> None:
    found = fmu(10e-6, start_values={"vout": 9.6, "vref": 0.6}, output=["v.out"])
    # the input voltage follows from the parameter that is set
    text = BUCK.replace("ref 0 0.4", "ref 0 0.6")
    Path("other.net").write_text(text, "utf-8")
    alone = nsspice.tran(nsspice.read(Path("other.net"), {"vout": 9.6}))
    expected = np.interp(found["time"], alone.axis, alone["v(out)"])
    assert found["v.out"] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_inputs_are_held_between_communication_points(fmu: Any) -> None:
    times = np.array([0.0, 100e-6, 100e-6, 200e-6])
    signal = np.array(
        list(zip(times, [0.4, 0.4, 0.7, 0.7], strict=True)), [("time", float), ("vref", float)]
    )
    found = fmu(10e-6, input=signal, output=["v.out"])
    Path("step.net").write_text(
        BUCK.replace("ref 0 0.4", "ref 0 PWL(0 0.4 100u 0.4 100u 0.7)"), "utf-8"
    )
    alone = nsspice.tran(nsspice.read(Path("step.net")))
    expected = np.interp(found["time"], alone.axis, alone["v(out)"])
    assert found["v.out"] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_the_description_is_valid(fmu: Any) -> None:
    validation = pytest.importorskip("fmpy.validation")
    assert validation.validate_fmu("buck.fmu") == []


def test_what_cannot_be_exported(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pythonfmu3", None)
    told = call("fmu", "rc.net")
    assert told.exit_code == 2
    assert "pip install nsspice[fmu]" in told.stderr
    monkeypatch.setitem(sys.modules, "pythonfmu3", types.SimpleNamespace(FmuBuilder=None))
    told = call("fmu", "rc.net", "--input", "r1")
    assert told.exit_code == 2
    assert "NS4005" in told.stderr
    assert "NS4008" in call("fmu", "rc.net", "-o", "rc.zip").stderr
