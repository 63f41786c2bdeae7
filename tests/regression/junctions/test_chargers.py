"""Converters that charge capacitors alone, in discontinuous mode, beside a smooth law.

Nothing but capacitors ties the output to ground.  Where switch and diode block, the current of the
coil is zero by the law of the node at its end, which holds nothing else.  The sum of the laws of
all nodes that the coil and resistors tie together took the place of that law, and brought the
rounding of all charges into it: microamperes over a picosecond, in which diodes turned again and
again.  The sum takes the place of a law now in which that rounding is anyway.  The reference is the
exact engine with the same deck without the smooth law, which observes and acts on nothing.
"""

import re

import numpy as np
import pytest

import nsspice

BUCK = """a buck converter
Vin in 0 24
S1 in sw g 0 swi
D1 0 sw
L1 sw o 47u
{output}
Vg g 0 PULSE(1 0 2u 10n 10n 7.98u 10u)
.model swi SW(VT=0.5)
.tran 1u 0.2m uic
"""

BOOST = """a boost converter
Vin in 0 12
L1 in sw 47u
S1 sw 0 g 0 swi
D1 sw o
{output}
Vg g 0 PULSE(0 1 0 10n 10n 2u 10u)
.model swi SW(VT=0.5)
.tran 1u 0.2m uic
"""

OUTPUTS = {
    "two capacitors": "Co o 0 47u IC={v}\nRb o b 10m\nCb b 0 1m IC={v}",
    "a battery": "Co o 0 47u IC={v}\nRb o b 50m\nCb b 0 5 IC={v}",
    "one with a resistance": "Rb o b 10m\nCb b 0 1m IC={v}",
    "a leakage of 1 MOhm": "Co o 0 47u IC={v}\nRb o b 10m\nCb b 0 1m IC={v}\nRl o 0 1meg",
}

#: a law without consequences
OBSERVER = "Bx x 0 V=v(o)*v(o)\n"
#: a charge that curves by 5e-8 of a capacitance at 24 V, less than the tolerance
CURVED = re.compile(r"^(C\w+ \w+ 0) (\w+)", re.MULTILINE)

RELTOL = 1e-6


@pytest.mark.parametrize("curved", [False, True], ids=["linear", "curved"])
@pytest.mark.parametrize("output", OUTPUTS.values(), ids=OUTPUTS)
@pytest.mark.parametrize(("deck", "volts"), [(BUCK, 12), (BOOST, 24)], ids=["buck", "boost"])
def test_coils_carry_nothing_where_all_blocks(
    deck: str, volts: int, output: str, curved: bool
) -> None:
    text = deck.format(output=output.format(v=volts))
    exact = nsspice.tran(nsspice.read(text), method="modewise")
    observed = text.replace(".model", OBSERVER + ".model")
    if curved:
        observed = CURVED.sub(r"\1 Q={\2*x*(1 + 1e-9*x)}", observed)
    solution = nsspice.tran(nsspice.read(observed), method="sdirk", reltol=RELTOL)
    assert solution.certificate is not None
    assert solution.certificate.passed
    assert not solution.impulses
    found, expected = (
        [(e.element, e.change) for e in run.events if e.element in ("s1", "d1")]
        for run in (solution, exact)
    )
    assert found == expected
    largest = np.abs(exact["i(l1)"]).max()
    # twenty periods, with three events each that may add up
    assert np.abs(solution["i(l1)"] - exact["i(l1)"]).max() <= 60.0 * RELTOL * largest
    assert np.abs(solution["v(o)"] - exact["v(o)"]).max() <= RELTOL * volts


JUNCTIONS = {
    "a plain one": "D(IS=1e-12)",
    "a sharp one": "D(IS=1e-12 N=0.01)",
    "one with a capacitance": "D(IS=1e-12 N=0.01 CJO=1n)",
    "one with a resistance": "D(IS=1e-9 RS=10m)",
}


@pytest.mark.parametrize("model", JUNCTIONS.values(), ids=JUNCTIONS)
@pytest.mark.parametrize("output", OUTPUTS.values(), ids=OUTPUTS)
@pytest.mark.parametrize(("deck", "volts"), [(BUCK, 12), (BOOST, 24)], ids=["buck", "boost"])
def test_diodes_may_be_junctions(deck: str, volts: int, output: str, model: str) -> None:
    ideal = deck.format(output=output.format(v=volts))
    text = re.sub(r"^(D1 \w+ \w+)$", r"\1 dj", ideal, flags=re.MULTILINE)
    text = text.replace(".model swi", f".model dj {model}\n.model swi")
    coarse, fine = (
        nsspice.tran(nsspice.read(text), method="sdirk", reltol=tol)
        for tol in (RELTOL, 0.01 * RELTOL)
    )
    for run in (coarse, fine):
        assert run.certificate is not None
        assert run.certificate.passed
    largest = np.abs(fine["i(l1)"]).max()
    assert np.abs(coarse["i(l1)"] - fine["i(l1)"]).max() <= 60.0 * RELTOL * largest
    if "N=0.01" in model and "CJO" not in model:
        # conducting, the junction takes 7 mV of the 12 V and more that make the coil's current
        exact = nsspice.tran(nsspice.read(ideal), method="modewise")
        assert np.abs(fine["i(l1)"] - exact["i(l1)"]).max() <= 8e-3 / 12 * largest
