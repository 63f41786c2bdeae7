"""Verdicts on circuits whose solutions are known in closed form.

Each deck says how many DC solutions there are, for any values of the sources (at most one, or more
for some values), and how the solution at the deck's own values is: regular, isolated, one of
several.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import nsspice
from nsspice.circuit.regularity import dc_uniqueness


@dataclasses.dataclass(frozen=True)
class Known:
    """A deck and the truth about it."""

    deck: str
    #: at most one solution for all values of the sources
    at_most_one: bool
    #: what is true at the deck's own values: ``unique``, ``locally unique`` or neither
    kinds: tuple[str, ...]
    #: elements that a verdict against it has to name
    named: tuple[str, ...] = ()


UNIQUE, LOCAL = ("unique",), ("locally unique",)
OPEN, SEVERAL = ("not known",), ("several",)
IDEAL = ".model d D(ideal)\n"


def law(curve: str, volts: float = 0.0) -> str:
    """One resistor of a curve across a source: as many solutions as the curve reaches the value."""
    return f"V1 a 0 {volts}\nR1 a 0 V={{{curve}}}\n"


BRIDGE = "D1 a p d\nD2 0 p d\nD3 n a d\nD4 n 0 d\nR1 p n 1k\n" + IDEAL
PNP = """VU1 0 n1 1
RB n1 b 30k
VU2 0 n2 10
RL n2 c 3k
Q1 c b 0 pnp1
.model pnp1 PNP(alphaN=0.1 alphaI=0.7 DE=emitter DC=collector)
"""

CIRCUITS = {
    # curves with kinks: v = |i| and v = max(i, -i/2) have no solution below 0 and two above
    "abs at its kink": Known(law("abs(i)"), False, OPEN, ("r1",)),
    "abs above its kink": Known(law("abs(i)", 1.0), False, SEVERAL, ("r1",)),
    "fold at its kink": Known(law("max(i,-0.5*i)"), False, OPEN, ("r1",)),
    "fold above its kink": Known(law("max(i,-0.5*i)", 1.0), False, SEVERAL, ("r1",)),
    "rising kink": Known(law("max(i,0.5*i)"), True, UNIQUE),
    "rising kink by min": Known(law("min(i,2*i)"), True, UNIQUE),
    "fold by a condition": Known(law("if(i>0,2*i,-3*i)"), False, OPEN, ("r1",)),
    "rise by a condition": Known(law("if(i>0,2*i,3*i)"), True, UNIQUE),
    "jump up": Known(law("if(i>0,2*i+1,i)", 2.0), True, UNIQUE),
    "jump down": Known(law("if(i>0,i-1,i)", -0.5), False, SEVERAL, ("r1",)),
    "flat below its kink": Known(law("max(i,0)"), False, SEVERAL, ("r1",)),
    "ramp of two quantities": Known(
        "V1 a 0 0\nV2 b 0 0\nR1 a c 1\nR2 b c 1\nB1 c 0 I=max(v(c),2*v(c))\n", True, UNIQUE
    ),
    # smooth curves
    "argsinh": Known(law("asinh(i)", 2.0), True, UNIQUE),
    "cubic, rising": Known(law("i^3+i", 2.0), True, UNIQUE),
    "cubic, falling inside": Known(law("i^3-i"), False, SEVERAL, ("r1",)),
    "constants are folded": Known("V1 a 0 1\nR1 a b 1\nR2 b 0 V={-2/pi*atan(i)}\n", True, UNIQUE),
    "a fall steeper than the resistor": Known(
        "V1 a 0 0\nR1 a b 1\nR2 b 0 V={-2*atan(i)}\n", False, SEVERAL, ("r2",)
    ),
    # ideal elements
    "clamp": Known("V1 a 0 5\nR1 a b 1k\nD1 b 0 d\n" + IDEAL, True, UNIQUE),
    "parallel diodes that conduct": Known(
        "V1 a 0 1\nR1 a b 1\nD1 b 0 d\nD2 b 0 d\n" + IDEAL, False, SEVERAL, ("d1", "d2")
    ),
    "parallel diodes that block": Known(
        "V1 a 0 -1\nR1 a b 1\nD1 b 0 d\nD2 b 0 d\n" + IDEAL, False, UNIQUE
    ),
    "parallel diodes of two drops": Known(
        "V1 a 0 1\nR1 a b 1\nD1 b 0 d\nD2 b 0 e\n.model e D(Vfwd=0.5)\n" + IDEAL, True, UNIQUE
    ),
    "parallel diodes with resistances": Known(
        "V1 a 0 1\nR1 a b 1\nD1 b 0 d\nD2 b 0 d\n.model d D(Ron=1m)\n", True, UNIQUE
    ),
    "antiparallel diodes that conduct": Known(
        "V1 a 0 1\nR1 a b 1\nD1 b 0 d\nD2 0 b d\n" + IDEAL, False, SEVERAL, ("d1", "d2")
    ),
    "antiparallel diodes with a drop": Known(
        "V1 a 0 1\nR1 a b 1\nD1 b 0 d\nD2 0 b d\n.model d D(Vfwd=0.7)\n", True, UNIQUE
    ),
    "bridge that conducts": Known("V1 a 0 5\n" + BRIDGE, False, UNIQUE),
    "bridge at rest": Known("V1 a 0 0\n" + BRIDGE, False, UNIQUE),
    "bridge that is freewheeling": Known(
        "V1 a 0 0\nI1 n p -1\n" + BRIDGE, False, SEVERAL, ("d1", "d2")
    ),
    # gain
    "latch": Known(
        "E1 a 0 b 0 -5\nR1 a c 1k\nD1 c 0 z\nE2 d 0 c 0 -5\nR2 d b 1k\nD2 b 0 z\n"
        ".model z D(Vfwd=1 Vrev=1)\n",
        False,
        SEVERAL,
        ("e1", "e2"),
    ),
    "the same with too little gain": Known(
        "E1 a 0 b 0 -0.5\nR1 a c 1k\nD1 c 0 z\nE2 d 0 c 0 -0.5\nR2 d b 1k\nD2 b 0 z\n"
        ".model z D(Vfwd=1 Vrev=1)\n",
        True,
        UNIQUE,
    ),
    # the examples of the thesis
    "4.2.2, transistor with argsinh": Known(
        PNP + ".model emitter D(Vfwd=2 Vrev=2 V={2/pi*asinh(i)})\n"
        ".model collector D(Vfwd=4 Vrev=4 V={2*asinh(i)})\n",
        True,
        UNIQUE,
    ),
    "B 4.2, transistor with arctan": Known(
        PNP + ".model emitter D(Vfwd=2 Vrev=2 V={-2/pi*atan(i)})\n"
        ".model collector D(Vfwd=4 Vrev=4 V={-2*atan(i)})\n",
        True,
        UNIQUE,
    ),
    "B 4.2 with the numbers of its erratum": Known(
        """VU1 0 n1 -0.25146
RB n1 b 3
VU2 0 n2 -0.51567
RL n2 c 0.5
Q1 c b 0 pnp1
.model pnp1 PNP(alphaN=0.1 alphaI=0.7 DE=emitter DC=collector)
.model emitter D(Vfwd=0.2 Vrev=0.2 V={-0.5*atan(i)})
.model collector D(Vfwd=0.4 Vrev=0.4 V={-0.6*atan(i)})
""",
        False,
        ("several", "locally unique"),
        ("q1",),
    ),
    "B 4.3, controlled rectifier": Known(
        "V1 a 0 3\nR1 a b 1\nD1 b 0 scr1\n"
        ".model scr1 SCR(V={2 + 3*i - 4.5*i^2 + 1.75*i^3} alpha=2 Ron=8 Vrev=1)\n",
        True,
        UNIQUE,
    ),
    "B 4.3 with too small a resistor": Known(
        "V1 a 0 2.3\nR1 a b 0.5\nD1 b 0 scr1\n"
        ".model scr1 SCR(V={2 + 3*i - 4.5*i^2 + 1.75*i^3} alpha=2 Ron=8 Vrev=1)\n",
        False,
        ("locally unique", "several"),
        ("d1",),
    ),
}


@pytest.mark.parametrize("name", CIRCUITS)
def test_verdicts_on_circuits_of_known_answer(name):
    known = CIRCUITS[name]
    circuit = nsspice.read(f"{name}\n{known.deck}.op\n")
    (island,) = circuit.islands
    proof = dc_uniqueness(island.assemble(analysis="dc"))
    # all that is true is proved, and nothing else
    assert proof.unique is known.at_most_one, str(proof)
    (solution,) = circuit.run()
    verdict = solution.islands[0].regularity
    assert verdict.kind in known.kinds, str(verdict)
    assert set(known.named) <= {e.split(".")[0] for e in (*verdict.elements, *proof.elements)}
    # what the certificate counts as left open does not contradict it
    assert (solution.certificate.undetermined == 0) or verdict.kind == "several"


@pytest.mark.parametrize("order", [12, 13, 20, 35])
def test_p_matrices_of_many_rows_are_proved(order):
    """``0 in M z + Sgn(z) - p`` with P-matrices that are not definite: odd cycles, H-matrices."""
    from nsspice.problems import GeneralizedEquation, Sign, TapeBuilder
    from nsspice.problems.uniqueness import uniqueness

    def found(matrix):
        tape = TapeBuilder()
        z = [tape.unknown(k) for k in range(len(matrix))]
        for row in matrix:
            total = tape.constant(0.0)
            for factor, unknown in zip(row, z, strict=True):
                total = tape.op("add", total, tape.op("mul", tape.constant(float(factor)), unknown))
            tape.output(total)
        pieces = tuple((k, Sign(-1, 1)) for k in range(len(matrix)))
        return uniqueness(GeneralizedEquation(tape.finish(), pieces).system())

    cycle = np.eye(order) + 1.5 * np.roll(np.eye(order), 1, axis=1)
    if order <= 20:
        assert found(cycle).unique is bool(order % 2)
    # an H-matrix whose symmetric part is indefinite: columns of dominant rows were scaled
    rng = np.random.default_rng(order)
    dominant = rng.normal(size=(order, order))
    np.fill_diagonal(dominant, 0.0)
    dominant += np.diag(1.2 * np.abs(dominant).sum(axis=1))
    scaled = dominant * 10.0 ** rng.uniform(-2, 2, order)
    assert np.linalg.eigvalsh(scaled + scaled.T)[0] < 0.0
    assert found(scaled).unique
