"""``.ac`` of smooth circuits beside ngspice, which linearises its own models."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

import nsspice

CHILD = """
import json, os, sys
from nsspice.compare.ngspice.child import session
ngspice = session()
ngspice.load_circuit(sys.stdin.read())
ngspice.exec_command("run")
name = next(p for p in ngspice.plot_names if p.startswith("ac"))
vectors = ngspice.plot(None, name)
found = {k: [v._data.real.tolist(), v._data.imag.tolist()] for k, v in vectors.items()}
print("RESULT" + json.dumps(found))
sys.stdout.flush()
os._exit(0)
"""

#: SPICE's own Newton method would stop at an operating point known to 1e-3
OPTIONS = ".options reltol=1e-9 abstol=1e-18 vntol=1e-14 gmin=1e-30\n"

DECKS = {
    "ladder": """ladder of R, L, C
V1 in 0 DC 1 AC 2 30
R1 in a 50
L1 a b 10u
C1 b 0 1n
R2 b c 75
K1 L1 L2 0.8
L2 c 0 20u
C2 c d 470p
R3 d 0 1k
.ac dec 5 1k 100meg
.end
""",
    "amplifier": """common emitter amplifier with charges
Vcc vcc 0 12
Vin s 0 AC 1
Rs s b0 600
Cin b0 b 10u
Rb1 vcc b 47k
Rb2 b 0 10k
Rc vcc c 2.2k
Re e 0 470
Ce e 0 47u
Q1 c b e QN
Cout c out 10u
Rl out 0 10k
.model QN NPN(IS=1e-15 BF=150 BR=3 VAF=80 CJE=8p CJC=3p TF=0.4n RB=50 RE=0.5)
.ac dec 4 10 100meg
.end
""",
    "junction": """diode with charges, biased in the forward direction, and a controlled source
Vb in 0 DC 5 AC 1
R1 in a 1k
D1 a 0 DX
C1 a out 100n
R2 out 0 10k
G1 0 g out 0 1m
R3 g 0 2k
Ig 0 g DC 1m AC 0.5 -90
.model DX D(IS=1e-14 N=1.05 RS=2 CJO=5p VJ=0.8 M=0.4 TT=12n)
.ac dec 4 100 100meg
.end
""",
}


def by_ngspice(deck: str) -> dict[str, np.ndarray]:
    done = subprocess.run(
        [sys.executable, "-c", CHILD],
        input=deck.replace(".end", OPTIONS + ".end"), capture_output=True, text=True, timeout=60,
        check=False,
    )  # fmt: skip
    assert done.returncode not in (11, 12), "this test needs ngspice and PySpice: make ngspice"
    line = next(x for x in done.stdout.splitlines() if x.startswith("RESULT"))
    table = json.loads(line.removeprefix("RESULT"))
    return {k: np.array(re) + 1j * np.array(im) for k, (re, im) in table.items()}


@pytest.mark.parametrize("name", DECKS)
def test_responses_are_those_of_ngspice(name: str) -> None:
    (sol,) = nsspice.read(DECKS[name]).run()
    other = by_ngspice(DECKS[name])
    frequency = other.pop("frequency").real
    assert np.allclose(sol.axis, frequency, rtol=1e-9)
    compared = 0
    # the constants k and q of both differ by 3.4e-7 of k/q: at 30 thermal voltages 1e-5 of a
    # current
    tolerance = 1e-9 if name == "ladder" else 2e-5
    # what a source holds at zero is rounding alone: 1e-12 of the largest response, some 5000 u
    rounding = 1e-12 * max(np.abs(values).max() for values in other.values())
    for node, values in other.items():
        if f"v({node})" in sol and "#" not in node:
            compared += 1
            size = np.abs(values).max()
            error = np.abs(sol[f"v({node})"] - values).max()
            assert error <= tolerance * size + rounding, node
    assert compared >= 3
