"""Networks at rest beside voltages that drive nothing: rounding is no signal, and no failure."""

import numpy as np
import pytest

import nsspice

#: a floating source falls to zero within a step; all else is zero, but for rounding of its voltage
FALLING = """floating source beside a network at rest
L1 0 c 2.026m
R1 x c 9.217
C1 c y 13.46u
R2 g c 1k
V1 gg c PULSE(0 10 0.0175654 1e-05 1e-5 2.26951e-05 20m)
R3 h g 100
.tran 0.2m 60m
"""

#: a voltage across an open pair brings its rounding along
OPEN = """gate of a thyristor beside a network at rest
V1 a 0 SIN(0 100 50)
R1 d b 23.55
L1 b c 0.007951
C1 0 x 14.05u
R2 x c 23.49
D1 a b g thyristor
R3 g b 1k
V2 gg d PULSE(0 10 0.00392149 0 1e-5 0.000916225 10m)
.model thyristor SCR(Vgt=1)
.tran 0.2m 60m
"""

#: gate currents flow in loops of their own; what they leave elsewhere is rounding, then less
GATED = """thyristor without a voltage
R1 d c 55.74
R2 c 0 11.16k
R3 b 0 2152
R4 d 0 379.7
L1 0 d 10.23m
L2 d 0 57.83m
D1 b d g thyristor
R5 g d 1k
V1 g d PULSE(0 5 0.0161278 0 0 0.00059096 20m)
.model thyristor SCR(Igt=5m Vgt=0.7 Rg=10 Vh=1 Ron=10m)
.tran 0.2m 60m
"""


@pytest.mark.parametrize("deck", [FALLING, OPEN, GATED])
@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_a_network_at_rest_stays_there(deck, method):
    if deck is GATED and method == "modewise":
        method = "auto"  # a falling law of its gate is no linear element
    run = nsspice.tran(nsspice.read(deck), method=method)
    assert run.certificate.passed
    assert run.row_count == 301
    # rounding of the largest voltage through a conductance of 0.1 S, with room for elimination
    largest = 100.0
    stores = [name for name in run.columns if name in ("i(l1)", "i(l2)")]
    assert stores
    for name in stores:
        assert np.max(np.abs(run[name])) < 1e3 * np.finfo(float).eps * largest * 0.1


def test_what_is_rounding_of_zero_is_no_jump():
    run = nsspice.tran(nsspice.read(GATED), method="moreau")
    assert run.jumps == []
    assert all(island.stats["jumps"] == 0 for island in run.islands)
