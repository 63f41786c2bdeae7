"""Verdicts on random problems, each attacked: what holds must not be refuted, nor what fails hold.

See ``tests/decks/verdict_problems.py`` for the problems and the attempts.
"""

from __future__ import annotations

import pytest
from decks.verdict_problems import MAKERS, false_verdicts

EVERYDAY = 20  #: of each kind


@pytest.mark.parametrize("kind", range(len(MAKERS)))
def test_no_verdict_is_refuted(kind):
    wrong = []
    for k in range(EVERYDAY):
        wrong += false_verdicts(kind + k * len(MAKERS))
    assert not wrong, wrong
