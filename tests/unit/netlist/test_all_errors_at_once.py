"""One reading tells all that is wrong with a deck, whatever reads it."""

from __future__ import annotations

import pytest

import nsspice
from nsspice.errors import NetlistError


def test_wrong_values_are_told_beside_lines_that_cannot_be_read() -> None:
    with pytest.raises(NetlistError) as caught:
        nsspice.read("wrong\nR1 a 0 (1\nR2 a 0 abc\nC1 a 0 -1u foo=2\nV1 a 0 1\n.tran 1u 1m\n")
    lines = {d.span.line for d in caught.value.diagnostics if d.span is not None}
    assert lines == {2, 3, 4}
