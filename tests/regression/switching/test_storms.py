"""Spells in which events follow too fast to be followed one by one, and what comes after them."""

from __future__ import annotations

import numpy as np
import pytest
from decks.index_three import INDEX_THREE

import nsspice

PFC = """Boost converter on the mains in critical conduction, its latch of two comparisons and an RC
Vac a b SIN(0 325 50)
D1 a r
D2 b r
D3 0 a
D4 0 b
L1 r d 400u
S1 d 0 q 0 SWI
D5 d o
Co o 0 220u IC=380
Ro o 0 500
Rg b 0 1meg
Bset st 0 V=if(i(L1)<1m,1,0)
Bref ref 0 V=v(r)*6/325
Brst rs 0 V=if(i(L1)>v(ref),1,0)
Bq qi 0 V=if(v(rs)>0.5,0,if(v(st)>0.5,1,if(v(q)>0.5,1,0)))
Rq qi q 100
Cq q 0 100p
.model SWI SW(VT=0.5)
.tran {rows} 10.8m uic
"""


def test_what_comes_after_a_spell_does_not_depend_on_rows() -> None:
    """At the zero of the mains the latch oscillates through its RC of 10 ns.

    The exact engine had given up for the rest of the run there, with steps as long as the rows: the
    output ended 20 ms later between 370 and 698 V, certified, in place of 418 V.
    """
    coarse, fine = (nsspice.tran(nsspice.read(PFC.format(rows=r))) for r in ("50u", "10u"))
    for found in (coarse, fine):
        assert found.certificate.passed, found.certificate
        assert found.stats["accumulation"] == 1
        # the energy that the implicit steps have taken is that of a latch, not that of the output
        assert found.certificate.taken < 1e-6
        # points before the spell had the instant of its end, 22 us later; the sine and its
        # argument, up to pi, are rounded
        points = found.fine()
        mains = 325.0 * np.sin(100.0 * np.pi * points.axis)
        off = points.signals["v(a)"] - points.signals["v(b)"] - mains
        assert np.abs(off).max() <= 325.0 * 8.0 * np.finfo(float).eps
    # the steps of a latch without energy decide when a pulse of some ten microseconds begins;
    # it moves 380 V by (6 A)^2 400 uH / (2 220 uF 380 V) = 0.1 V
    late = coarse["v(o)"] - np.interp(coarse.time, fine.time, fine["v(o)"])
    assert np.abs(late[coarse.time < 9.9e-3]).max() < 1e-9 * 380
    assert np.abs(late).max() < 0.1


#: that of INDEX_THREE with the first derivative as a source: 2 pi cos(2 pi t)
INDEX_TWO = """The same, differentiated once
I1 0 b SIN(0 6.283185307179586 1 0 0 90)
L1 b 0 1 IC=0
D1 b c
R1 c 0 1
.tran 10m 2 uic
"""


def test_implicit_steps_that_take_energy_are_told() -> None:
    """A mode of index three cannot be followed; steps of the rows erred by 3 %, certified."""
    stepped = nsspice.tran(nsspice.read(INDEX_THREE), method="modewise")
    exact = nsspice.tran(nsspice.read(INDEX_TWO), method="modewise")
    assert exact.certificate.passed
    assert exact.stats["fixed_steps"] == 0
    error = np.abs(stepped["i(l1)"] - exact["i(l1)"]).max() / np.ptp(exact["i(l1)"])
    assert error > 1e-2
    certificate = stepped.certificate
    assert certificate.taken > certificate.granted
    assert not certificate.passed
    # what an implicit step takes of the energy is the half of its relative error
    assert certificate.taken == pytest.approx(error, rel=1.0)
