"""Transformers of gyrators: capacitors behind sources, which bleeders alone tie to ground."""

import numpy as np
import pytest

import nsspice

#: i = v/R both ways, with copper; as averaged models of converters draw a winding
BRIDGE = """Half bridge, transformer of three gyrators on bleeders, rectifier with two junctions
.subckt winding a1 a2 b1 b2 R=10
Ra a1 ap 0.01
Rb b1 bp 0.01
Rm ap am 0.5
Rn bp bm 0.5
Ba am an V={-R*i(Vb)}
Bb bm bn V={R*i(Va)}
Va an a2 0
Vb bn b2 0
Bc bp bm I={-v(ap,a2)/R}
Bd ap am I={v(bp,b2)/R}
Re ap bp 100meg
Rf a2 b2 100meg
.ends
Vin in 0 10
R1 in mid 100k
C1 in mid 100u
R2 mid 0 100k
C2 mid 0 100u
Sh in h gh 0 leg
Dh h sw block
Dbh sw in block
Sl sw l gl 0 leg
Dl l 0 block
Dbl 0 sw block
Bgh gh 0 V={u(-0.5 - v(tri))}
Bgl gl 0 V={u(v(tri) - 0.5)}
Vtri tri 0 PULSE(-1 1 0 50u 50u 0 100u)
Xp sw mid n1 n10 winding R=10
X1 n3 n30 d1 r winding R=20
X2 n30 n10 r d2 winding R=20
Cc n1 n3 100u
Rb1 n1 0 100meg
Rb2 n3 0 100meg
Rb3 n10 0 100meg
Rb4 n30 0 100meg
D1 d1 p block
D2 d2 p block
L1 p o 1m
C3 o r 100u
R3 o r 10
.model block D()
.model leg SW(RON=1m VT=0.5)
.tran 1u 800u
"""


@pytest.fixture(scope="module")
def circuit():
    return nsspice.read(BRIDGE)


@pytest.mark.parametrize("reltol", [1e-5, 1e-7])
def test_bleeders_do_not_turn_the_rounding_of_charges_into_voltages(circuit, reltol):
    """C3 hangs behind the sources of two windings, on 100 MOhm.

    In a step of 20 fs its law has terms of 1e11 A, whose rounding went through the ammeter of a
    winding and the bleeders: 66 V, at 1e-7 264 V after a hundred times the steps, and at the end of
    more switchings 1e13 V and nan.  The laws held to the rounding of what was there.
    """
    run = nsspice.tran(circuit, method="sdirk", reltol=reltol)
    assert run.certificate.passed
    # half of 10 V and what L1 adds by way of windings of 10 to 20, less the drops of two junctions
    assert max(np.max(np.abs(run[name])) for name in run.columns if name[0] == "v") < 20.0
    fine, coarse = (nsspice.tran(circuit, method="moreau", step=h) for h in (2e-7, 4e-7))
    for values in (lambda r: r["i(l1)"], lambda r: r["v(o)"] - r["v(r)"]):
        # a method of first order errs by what it changes with half the step
        error = np.max(np.abs(values(fine) - values(coarse)))
        assert error < 0.01 * np.max(np.abs(values(fine)))
        assert np.max(np.abs(values(run) - values(fine))) < 2.0 * error
    assert run.stats["steps"] < 3000


def test_all_tolerances_have_the_same_end(circuit):
    runs = [nsspice.tran(circuit, method="sdirk", reltol=reltol) for reltol in (1e-5, 1e-7)]
    ends = [run["i(l1)"][-1] for run in runs]
    assert ends[0] == pytest.approx(ends[1], rel=1e-5)
