"""Random decks whose signals rest on thresholds, against a walk along their vertices."""

from __future__ import annotations

import pytest
from resting_decks import deck, disagreements


def _all_agree(seeds: range) -> None:
    wrong = {seed: found for seed in seeds if (found := disagreements(deck(seed)))}
    assert wrong == {}


@pytest.mark.parametrize("begin", range(0, 120, 30))
def test_signals_on_thresholds(begin: int) -> None:
    _all_agree(range(begin, begin + 30))


@pytest.mark.soak
@pytest.mark.parametrize("begin", range(0, 2000, 500))
def test_many_signals_on_thresholds(begin: int) -> None:
    _all_agree(range(begin, begin + 500))
