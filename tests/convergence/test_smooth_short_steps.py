"""Short steps of circuits with smooth laws: what Newton's method accepts, and what a switch sees.

In a step of length h a capacitor is C/h and an inductor L/h.  Their terms are no currents and
voltages of the network: laws elsewhere must hold to the network's own, in the shortest step too.
"""

import numpy as np
import nsspice

BRIDGE = """Rectifier bridge whose junctions store charge, with a floating electrolytic
V1 s 0 SIN(0 24 50)
RS s a 0.2
D1 a p dr
D2 0 p dr
D3 n a dr
D4 n 0 dr
C1 p x 2200u
RX x n 0.05
RL p n 50
.model dr D(IS=7.03n RS=0.034 N=1.8 CJO=18.8p VJ=.7 M=.33 TT=4.3u BV=400 IBV=5u)
.tran 0.1m 8m
"""


def test_charges_of_junctions_at_a_floating_capacitor() -> None:
    """2.2 mF at 24 V hold 50 mC: rounding of it is what a junction of 20 pF holds at 0.3 uV."""
    run = nsspice.tran(nsspice.read(BRIDGE), method="sdirk", reltol=1e-7)
    coarse = nsspice.tran(nsspice.read(BRIDGE), method="sdirk", reltol=1e-5)
    assert run.certificate.passed
    stats = run.islands[0].stats
    assert stats["forced"] == 0
    # where rounding is chased several steps are rejected for each that is taken
    assert stats["rejected"] < stats["steps"]
    across = [r["v(p)"] - r["v(x)"] for r in (run, coarse)]
    # three times the tolerance, as everywhere
    assert np.abs(across[0] - across[1]).max() < 3e-5 * np.abs(across[0]).max()
