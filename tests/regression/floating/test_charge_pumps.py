"""Charge pumps: many capacitors side by side, two or three of whose states move.

In a mode of a long pump the state matrix has rank two or three. Reflections of such a matrix leave
rounding of what the last one has left, down to numbers whose squares are zero; the modes then had
no eigenvectors, and implicit steps in their place were off by 1e-4 of the voltages.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice


def pump(stages: int) -> str:
    """Return Dickson's charge pump with ideal diodes between two clocks of 1 Ohm."""
    lines = ["Dickson's charge pump", "V1 in0 0 5", "RI in0 in 1", "D0 in n0 did"]
    for k in range(stages):
        clock = "pa" if k % 2 == 0 else "pb"
        lines += [f"C{k} n{k} {clock} 1u IC=0", f"D{k + 1} n{k} n{k + 1} did"]
    return "\n".join(
        [
            *lines,
            f"CO n{stages} 0 1u IC=0",
            f"RO n{stages} 0 1meg",
            "VA pa0 0 PULSE(0 5 0 10n 10n 5u 10u)",
            "VB pb0 0 PULSE(5 0 0 10n 10n 5u 10u)",
            "RPA pa0 pa 1",
            "RPB pb0 pb 1",
            ".model did D(ideal)",
            ".tran 1u 400u uic",
        ]
    )


@pytest.mark.parametrize("stages", [8, 16, pytest.param(30, marks=pytest.mark.soak)])
def test_long_charge_pumps_go_mode_by_mode(stages):
    circuit = nsspice.read(pump(stages))
    exact = nsspice.tran(circuit, method="modewise")
    assert exact.certificate.passed
    assert exact.stats["fixed_steps"] == 0
    # at each clock edge many diodes change one right behind another: error control of each step
    # leaves some 1e-5 V in transients; the implicit steps were off by 4e-4 V from then on
    stepped = nsspice.tran(circuit, method="sdirk", reltol=1e-9)
    for name in exact.columns:
        if name.startswith("v("):
            assert np.abs(exact[name] - stepped[name]).max() <= 5e-5, name


def test_the_output_of_a_charge_pump_is_that_of_its_stages():
    # at rest each stage lifts the output by the swing of the clock; a load of 1 MOhm takes little
    circuit = nsspice.read(pump(2).replace(".tran 1u 400u uic", ".tran 1u 40m uic"))
    found = nsspice.tran(circuit)
    assert found.certificate.passed
    # each cycle of 10.02 us moves the charge that the load takes: V/R T through two capacitors
    output = found["v(n2)"][-2000:]
    lost = 2 * (15.0 / 1e6) * 10.02e-6 / 1e-6
    assert 15.0 - 2.0 * lost <= output.min() <= output.max() <= 15.0
