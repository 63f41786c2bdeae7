"""What decays within picoseconds after a switch has closed is gone at the next output point."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

RON, VOLTS = 5e-3, 6.0
DECK = f"""a switch short-circuits picofarads
V1 a 0 5
L1 a x 100u IC=1m
C1 x 0 20p IC=5
D1 x o d
C2 o 0 10u IC=5
R2 o 0 1k
Vg g 0 PULSE(0 5 1.04u 0.4u 0.4u 6u 12u)
S1 x 0 g 0 sw
.model d D(Vfwd=0.7)
.model sw SW(VT=2.5 Ron={RON} Roff=1meg)
.tran 0.5u 30u uic
"""


@pytest.mark.parametrize("reltol", [1e-4, 1e-6])
def test_a_capacitor_is_empty_once_its_switch_has_closed(reltol: float) -> None:
    """Its time constant is 1e-13 s: from the next output point on it has the voltage of ``Ron``.

    The decay is followed to ``reltol`` of the range of ``v(x)``, and keeps no more of an
    error; twice that, for the error of the current beside it.
    """
    run = nsspice.read(DECK).run(method="sdirk", reltol=reltol)[0]
    t = run.time % 12e-6
    # the edges end 0.4 us after they begin
    on = (t > 1.45e-6) & (t < 7.4e-6)
    assert on.sum() > 20
    error = np.abs(run["v(x)"] - RON * run["i(l1)"])[on].max()
    assert error <= 2 * reltol * VOLTS
