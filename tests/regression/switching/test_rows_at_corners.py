"""Rows that fall on corners of sources: values right after them, and not their rounding."""

import numpy as np
import pytest

import nsspice

#: at rest: a winding lies across a diode that bears nothing, and turns with rounding; the corners
#: of a saw that only a comparator sees cut steps all the same
AT_REST = """Coupled windings that carry direct currents, beside a saw
V1 a 0 12
R1 b 0 21.13
R2 c 0 7840
R3 d 0 161.4k
R4 e 0 111.3k
L1 e d 4.232m
L2 c w 844.3u
R5 w d 0.48
L3 c a 927.1u
K1 L1 L2 1
C1 b x 15.07n
R6 x 0 0.7947
C2 e 0 2.986u
C3 d b 33.4n
D1 a c lossy
S1 b 0 q 0 fast
B1 q 0 V={(v(b)>10 && v(saw)>0.622) ? 1 : 0}
V2 saw 0 PULSE(0 1 0 2.5086u 2.5086u 0 5.01721u)
.model lossy D(Ron=0.048 Roff=48Meg)
.model fast SW(VT=0.5)
.tran 0.501721u 150.516u
"""


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_windings_at_rest_stay_there_at_corners(method):
    """Fluxes are known to the rounding of their currents, 5e-16 of 0.1 mA in 4 mH and less.

    Right after a corner that makes 2e-16 V s at most in steps of 4e-15 s, the longest that show it.
    """
    run = nsspice.tran(nsspice.read(AT_REST), method=method)
    assert run.certificate.passed
    assert run.jumps == []
    exact = nsspice.tran(nsspice.read(AT_REST), method="modewise")
    for name in run.columns:
        if name.startswith("v("):
            assert np.max(np.abs(run[name] - exact[name])) < 1e-4 * 12.0, name


#: the voltage of a node between windings follows from that of others; one row stands on the corner
AFTER_STEPS = """Coupled windings and a choke with a time constant of 0.3 ns, rows on corners
V1 a 0 SIN(0 10 1561.59)
R0 a b 7.692
R1 e d 38.63
Rb b 0 214.8k
Rc c 0 297.4k
Rd d 0 292.2k
Re e 0 112.1k
L0 b c 7.373m
L1 e a 1.112m
L2 0 c 84.56u
K1 L0 L1 1
C0 d 0 1.45u
D0 b a twoway
D1 e d ideal
D2 d e lossy
S0 0 d q 0 fast
B0 q 0 V={(v(a)>2 && v(saw)>0.766) ? 1 : 0}
V2 saw 0 PULSE(0 1 0 8.00465u 8.00465u 0 16.0093u)
.model ideal D(ideal)
.model lossy D(ideal Vfwd=0.7 Ron=0.048)
.model twoway D(ideal Vrev=20 Vfwd=0.5)
.model fast SW(VT=0.5)
.tran 1.60093u 216u uic
"""


def test_rows_on_corners_err_no_more_than_others():
    circuit = nsspice.read(AFTER_STEPS)
    exact = nsspice.tran(circuit, method="modewise")
    for reltol in (1e-7, 1e-8, 1e-9):
        run = nsspice.tran(circuit, method="sdirk", reltol=reltol)
        for name in ("v(c)", "i(l0)", "i(l1)"):
            error = np.abs(run[name] - exact[name])
            # what a short step shows may differ from the limit of several by 1e-6 of the largest
            # voltage (current) of the network, 38 V
            kind = [exact[s] for s in exact.columns if s[0] == name[0]]
            assert error.max() < (100 * reltol + 2e-6) * np.abs(kind).max(), (reltol, name)


@pytest.mark.parametrize("reltol", [1e-3, 1e-5, 1e-8])
def test_no_row_shows_a_mode_that_ends_where_it_begins(reltol):
    """A coil loses its current to a diode from the corner on: 25 kV without it, 24 V with it."""
    circuit = nsspice.read("""A squared voltage drives the coil, and goes down from 10 us on
V1 in 0 24
L1 in c 0.5
R1 c x 200
B1 x 0 I=1m*v(g)**2
Vg g 0 PWL(0 5 10u 5 11u 0)
D1 x in
.tran 1u 20u
.meas highest max v(x)
""")
    run = nsspice.tran(circuit, reltol=reltol, all_points=True)
    assert run.islands[0].method == "sdirk"
    assert run["v(x)"].max() <= 24.0 + 1e-9
    assert circuit.run()[0].measures["highest"] <= 24.0 + 1e-9
