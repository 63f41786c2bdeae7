"""Piecewise-linear sources that read the current of a plain capacitor.

As a rate in the law of the source it made what is stored unsymmetric: certificates of right runs
failed, and laws of nodes were off by 1 %.
"""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

CURRENT = "V1 a 0 PULSE(0 1 10u 10u 10u 400u 1m)\nR1 a b 1k\n"
DECKS = {
    "across the resistor": "C1 a b 1u\nB1 c 0 V=max(v(b)/2+500*i(C1),0)\nC2 c d 1u\nR3 d 0 100",
    "rest": "C1 a b 1u\nB1 c 0 V=limit(0.5*(v(b)+1000*i(C1)),-0.3,0.3)\nR2 c 0 1k",
    "another state": "C1 b e 1u\nR9 e 0 50\nB1 c 0 V=max(-0.5*(v(a)-v(b)+100*i(C1)),0)\nR2 c 0 1k",
    "feeding back": "C1 a b 1u\nB1 c 0 V=max(0.1*(v(b)+1000*i(C1)),0)\nR2 c b 1k",
}


@pytest.mark.parametrize("uic", ["", "uic"])
@pytest.mark.parametrize("name", DECKS)
def test_engines_are_certified_and_agree(name: str, uic: str) -> None:
    """A source of 0 V in series tells the same current.

    Tolerance: sdirk errs by ``reltol`` of the range of 1 V in a step, some ten in a row.
    """
    text = f"{name}\n{CURRENT}{DECKS[name]}\n.tran 10u 2m {uic}\n"
    sensed = text.replace("C1 a ", "V9 a s 0\nC1 s ").replace("C1 b ", "V9 b s 0\nC1 s ")
    sensed = sensed.replace("i(C1)", "i(V9)")
    reference = nsspice.read(sensed).run(method="modewise")[0]
    runs = [nsspice.read(text).run(method=m, reltol=1e-7)[0] for m in ("modewise", "sdirk")]
    for run, tolerance in zip(runs, (1e-9, 1e-6), strict=True):
        for signal in ("v(b)", "v(c)"):
            # beside the corners of the pulse a row lies on one side or the other: the mean counts
            assert np.abs(run[signal] - reference[signal])[1:].mean() <= tolerance


def test_charges_at_the_start() -> None:
    """``IC=`` of a capacitor that is read: 2 V decay over 1 ms, and the source follows."""
    text = "discharge\nC1 b 0 1u IC=2\nR1 b 0 1k\nB1 c 0 V=max(-500*i(C1),0)\nR2 c 0 1k\n"
    run = nsspice.read(text + ".tran 0.1m 3m uic\n").run(method="modewise")[0]
    decay = 2.0 * np.exp(-run.time / 1e-3)
    assert run["v(b)"] == pytest.approx(decay, rel=1e-9)
    assert run["v(c)"] == pytest.approx(0.5 * decay, rel=1e-9)
    assert run["i(c1)"] == pytest.approx(-1e-3 * decay, rel=1e-9)
