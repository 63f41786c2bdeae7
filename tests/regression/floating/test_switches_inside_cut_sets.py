"""A rectifier behind line inductances, with a switch across its load.

While all junctions block, the DC side floats: nothing but leakage leads there, and the currents of
the lines are the sum of it.  The sum of the laws of the DC side takes the place of one of them, and
did not where a switch or an ideal diode stands in one of these laws, though both its ends are
inside.  Newton's method failed in all but steps of 0.1 ns: 2971 steps for 2 ms with the default
tolerance, no end with others.
"""

import numpy as np
import pytest

import nsspice

RECTIFIER = """three-phase rectifier of junctions
Va a 0 SIN(0 325 50)
Vb b 0 SIN(0 325 50 0 0 -120)
Vc c 0 SIN(0 325 50 0 0 120)
La a a1 100u
Lb b b1 100u
Lc c c1 100u
D1 a1 p dj
D3 b1 p dj
D5 c1 p dj
D4 n a1 dj
D6 n b1 dj
D2 n c1 dj
Ldc p r 1m
Cdc r n 470u
Rl r n 100
{across}
Vg g 0 0
.model sl sw(vt=0.5)
.model di D(Vfwd=0)
.model dj d(is=1e-9 n=1.6 rs=10m)
.tran 100u 10m
"""
ACROSS = {
    "a switch": "S1 r n g 0 sl",
    "a clamp": "D7 n r di",
    "both": "S1 r n g 0 sl\nD7 n r di",
}


@pytest.mark.parametrize("across", ACROSS.values(), ids=ACROSS)
def test_steps_stay_long(across: str) -> None:
    circuit = nsspice.read(RECTIFIER.format(across=across))
    runs = [nsspice.tran(circuit, reltol=reltol) for reltol in (1e-5, 1e-6, 1e-8)]
    for run, most in zip(runs, (300, 500, 1200), strict=True):
        assert run.certificate is not None
        assert run.certificate.passed
        assert run.islands[0].stats["steps"] <= most
    load = runs[2]["v(r)"] - runs[2]["v(n)"]
    for name in ("i(la)", "i(lb)", "i(lc)", "i(ldc)"):
        size = np.abs(runs[2][name]).max()
        assert np.abs(runs[0][name] - runs[2][name]).max() <= 1e-4 * size
    assert np.abs(runs[0]["v(r)"] - runs[0]["v(n)"] - load).max() <= 1e-4 * load.max()
