"""Nodes that junctions tie to each other and windings alone to the rest: a rectifier's secondary.

Currents of windings that meet there sum to zero at every instant, and so do their derivatives.  Of
these the voltages of all windings tell which potential the nodes have: no state of the circuit
remembers it, and in a very short step it is a difference of fluxes by next to no time.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.converter_parts import BRIDGE, PUSH_PULL

import nsspice

#: right behind a jump steps are as short as the rounding of fluxes allows for five digits
ROUNDING = 1e-5
#: the last row of the slow gates lies right behind an edge: there the limit of steps of 5 fs
#: (extrapolation takes them 1.83 times) tells voltages of 28 mH by three currents of 0.2 A, rounded
#: to 1.4e-17 A; across the leakage of 28 uH that is 8e-5 of what two windings do at 1e5 A/s
AT_AN_EDGE = 1e-4

#: voltage and its resistance; edge, on-time and period; windings and coupling; choke, output
PUSH_PULL_DECK = (
    """push-pull converter with leakage and without snubbers
.param primary={} secondary={} k={} on={} period={} edge={}
Vin vi 0 {}
Rin vi a {}
Vg g 0 PULSE(0 1 0 {{edge}} {{edge}} {{on}} {{period}})
Vh h 0 PULSE(0 1 {{period/2}} {{edge}} {{edge}} {{on}} {{period}})
"""
    + PUSH_PULL.replace("{", "{{").replace("}", "}}")
    + """Lo f o {}
C1 o 1_y {}
RC1 1_y 0 {}
R1 o 0 {}
"""
)
#: windings, coupling and choke; then the deck
SLOW_GATES = (
    (0.2868, 0.02811, 0.999, 0.05735),
    PUSH_PULL_DECK.format(
        *(0.2868, 0.02811, 0.999, 3.40208e-05, 0.00015447, 1.545e-07),
        *(100, 0.25, 0.05735, 0.0007776, 0.0862, 28.69),
    )
    + """.model ds D(IS=7.91e-08 CJO=4.97e-10 TT=4.58e-09)
.model sw SW(VT=0.5 RON=1.59m ROFF=2.01meg)
""",
)
FROM_REST = (
    (0.3479, 0.06286, 0.99, 0.06957),
    PUSH_PULL_DECK.format(
        *(0.3479, 0.06286, 0.99, 1.62489e-05, 3.61087e-05, 0),
        *(48, 0.00884, 0.06957, 2.233e-05, 0.0169, 243.2),
    )
    + """.model ds D(IS=4.25e-09 RS=4.63m CJO=2.08e-10)
.model sw SW(VT=0.5)
.tran 1.805u 180.54u uic
""",
)
FULL_BRIDGE = (
    """full bridge with leakage, junctions that store nothing but diffusion charges
Vin a 0 24
Vg g 0 PULSE(0 1 0 0 0 14.4901u 30.8301u)
Vh h 0 PULSE(0 1 15.415u 0 0 14.4901u 30.8301u)
"""
    + BRIDGE
    + """Rp p p3 47.3m
L1 p3 q 8.262m
L2 s 0 27.91m
L3 0 t 27.91m
K1 L1 L2 0.999
K2 L1 L3 0.999
K3 L2 L3 0.999
D5 s f ds
D6 t f ds
Lo f o_x 1.652m
RLo o_x o 6.47m
C1 o 0 14.6u
R1 o 0 7.585
.model ds D(IS=1.42e-14 N=1.73 RS=0.521 TT=17.2n)
.model sw SW(VT=0.5 RON=17.8m ROFF=22.2meg)
.tran 1.542u 308.3u uic
"""
)


def _missed(
    inductances: list[float], k: float, volts: list[np.ndarray], choke: np.ndarray
) -> float:
    """The rate of the sum of the currents, as a part of its terms; secondaries are the last two."""
    root = np.sqrt(inductances)
    matrix = k * np.outer(root, root) + (1.0 - k) * np.diag(inductances)
    rates = np.linalg.solve(matrix, np.array(volts))
    size = np.abs(rates[-2]) + np.abs(rates[-1]) + np.abs(choke)
    missed = np.abs(rates[-2] - rates[-1] + choke)
    return float((missed / np.maximum(size, 1e-6 * size.max())).max())


@pytest.mark.parametrize(
    ("values", "deck", "rounding"),
    [
        (SLOW_GATES[0], SLOW_GATES[1] + ".tran 7.723u 772.35u\n", AT_AN_EDGE),
        (*FROM_REST, ROUNDING),
    ],
    ids=["slow gates", "from rest"],
)
def test_push_pull(values: tuple[float, ...], deck: str, rounding: float) -> None:
    run = nsspice.tran(nsspice.read(deck))
    assert run.certificate.passed
    v = {node: run[f"v({node})"] for node in ("a", "m1", "m2", "s", "t", "f", "o")}
    volts = [v["a"] - v["m1"], v["m2"] - v["a"], v["s"], -v["t"]]
    primary, secondary, k, choke = values
    inductances = [primary, primary, secondary, secondary]
    assert _missed(inductances, k, volts, (v["f"] - v["o"]) / choke) < rounding


def test_full_bridge() -> None:
    run = nsspice.tran(nsspice.read(FULL_BRIDGE))
    assert run.certificate.passed
    v = {node: run[f"v({node})"] for node in ("p3", "q", "s", "t", "f", "o_x")}
    volts = [v["p3"] - v["q"], v["s"], -v["t"]]
    inductances = [8.262e-3, 27.91e-3, 27.91e-3]
    assert _missed(inductances, 0.999, volts, (v["f"] - v["o_x"]) / 1.652e-3) < ROUNDING


def test_all_tolerances_have_one_solution() -> None:
    """The currents of the ringing after the first edges do not depend on rounding."""
    ends = []
    for reltol in (1e-4, 1e-5, 1e-6):
        deck = nsspice.read(SLOW_GATES[1] + ".tran 7.723u 27.0305u\n")
        run = nsspice.tran(deck, reltol=reltol)
        assert run.certificate.passed
        ends.append([run[name][-1] for name in ("i(lo)", "v(m2)", "i(l1)")])
    apart = np.abs(np.array(ends[:2]) - ends[2]) / np.abs(ends[2])
    assert (apart < [[1e-2], [1e-3]]).all()
