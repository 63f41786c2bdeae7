"""A clock for what costs are measured with: it counts steps, so that no machine is too slow."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from nsspice.compare.cost import measure, problem


@dataclass
class StepClock:
    """Reads as the module ``time``; a step takes ``step`` seconds, a look at the clock ``look``."""

    step: float = 1e-5
    look: float = 0.0
    now: float = 0.0

    def process_time(self) -> float:
        self.now += self.look
        return self.now

    perf_counter = process_time


class Once:
    """A timer for runs that take as long each time."""

    def least(self, method: str, value: float, seconds: float, run: object) -> float:
        return seconds

    def second_turn(self, rows: list[object]) -> list[object]:
        return rows


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> StepClock:
    """Let runs whose cost is measured take so long as their steps say, and run none again."""
    found, run = StepClock(), problem.run_tran

    def counted(*args, **kwargs):
        solution = run(*args, **kwargs)
        found.now += found.step * (solution.stats.get("steps") or solution.stats["segments"])
        return solution

    monkeypatch.setattr(problem, "time", found)
    monkeypatch.setattr(problem, "run_tran", counted)
    monkeypatch.setattr(measure, "Timer", Once)
    return found
