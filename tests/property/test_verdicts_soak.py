"""2000 random problems with verdicts, each attacked; run by ``make soak``."""

from __future__ import annotations

import pytest
from decks.verdict_problems import false_verdicts

PROBLEMS, PART = 2000, 100


@pytest.mark.soak
@pytest.mark.parametrize("first", range(0, PROBLEMS, PART))
def test_no_verdict_is_refuted(first):
    wrong = {seed: text for seed in range(first, first + PART) if (text := false_verdicts(seed))}
    assert not wrong, wrong
