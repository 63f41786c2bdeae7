"""A fixed sample of the sweep of random decks: rows of certified runs obey every equation.

``tools/sweep_oracle.py`` takes many more; ``make soak`` some.
"""

from __future__ import annotations

import pytest
from oracle.rows.families import FAMILIES
from oracle.rows.judged_run import METHODS, judged

#: what no method runs: contradictions, and junctions in closed forms
BY_NAME = {"NS3001", "NS4020"}
#: others take minutes, or are listed with seeds of their own
LEFT_OUT = ("converter", "smooth converter", "large", "multiplier", "blocks", "regular", "stiff")
SAMPLE = [(family, 60_000) for family in FAMILIES if family not in LEFT_OUT]
SAMPLE += [("converter", seed) for seed in (4, 6, 9)]
SAMPLE += [("regular", 60_001), ("stiff", 60_001), ("blocks", 3003)]
#: ten seconds and more, of steps with error control
LONG = [("regular", 60_000), ("stiff", 60_000), ("converter", 15)]


@pytest.mark.parametrize(
    ("family", "seed"), SAMPLE + [pytest.param(*one, marks=pytest.mark.soak) for one in LONG]
)
def test_rows_of_certified_runs_are_right(family, seed):
    text = FAMILIES[family](seed)
    for method in METHODS:
        run = judged(text, method)
        assert run.outcome == "certified" or run.outcome in BY_NAME, (method, run.message)
        assert not run.rows or run.right, (method, run.worst[:3])
