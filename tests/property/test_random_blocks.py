"""Smooth blocks behind random converters: solved one after the other, and as one system.

The oracle is a run of the whole island by steps with error control; the converter of the other one
has closed forms, and each block behind it steps of its own.
"""

from __future__ import annotations

import numpy as np
import pytest
from decks.random_blocks import block_deck

import nsspice
from nsspice.errors import NumericalError

RELTOL = 1e-9
#: errors of single steps are below 1e-9 of the range of what is stored, and what is stored forgets
#: within some of its longest steps: ten of them add up, in up to four blocks one behind the other
ERROR = 50.0 * RELTOL
#: so small a part of the converter's values is rounding in a block: sources of 10 V by laws of 1 mS
TRACE = 1e-6
#: other signals in the rows make other sums
ROUNDING = 1e-13


def check(seed: int, error: float = ERROR) -> None:
    text = block_deck(seed)
    blocks = nsspice.tran(nsspice.read(text), reltol=RELTOL)
    assert blocks.islands[0].method == "modewise"
    assert len(blocks.islands) > 1
    # the converter does not notice what senses it
    alone = nsspice.tran(nsspice.read(block_deck(seed, alone=True)))
    largest = 0.0
    for name in ("v(out)", "i(l1)"):
        scale = float(np.abs(alone[name]).max())
        assert np.abs(blocks[name] - alone[name]).max() <= ROUNDING * scale, name
        largest = max(largest, scale)
    try:
        whole = nsspice.tran(nsspice.read(text), reltol=RELTOL, method="sdirk")
    except NumericalError:
        return  # Newton's method finds no way for all at once; the blocks have passed their checks
    if np.abs(whole["v(out)"] - alone["v(out)"]).max() > error * largest:
        return  # steps have missed an event of the converter, and judge nothing behind it
    for name in blocks.columns:
        scale = max(float(np.abs(whole[name]).max()), TRACE * largest)
        assert np.abs(blocks[name] - whole[name]).max() <= error * scale, name


@pytest.mark.parametrize("seed", [3, 6, 8, 10, 11, 12, 16, 17])
def test_blocks_agree_with_the_whole(seed: int) -> None:
    check(seed)


#: what the whole leaves of static laws with junctions is up to 1e-6, whatever its tolerance
LEFT = 1e-6


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(100, 400))
def test_many_more(seed: int) -> None:
    check(seed, LEFT)
