"""Which elements conduct at an instant of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ...analyses.solution.solution import Solution

#: part of a current's peak that counts as none
_NONE = 1e-9


def conducting_at(solution: Solution, time: float) -> dict[str, bool]:
    """Return which switches, diodes and transistors conduct at an instant.

    Parameters
    ----------
    solution : Solution
        Of a transient or a periodic steady state.
    time : float
        [s]; at a change of state the one after it counts.

    Examples
    --------
    >>> import nsspice
    >>> deck = "half wave\\nV1 a 0 SIN(0 1 50)\\nD1 a b\\nR1 b 0 1\\n.tran 1m 20m\\n"
    >>> wave = nsspice.run(deck)[0]
    >>> conducting_at(wave, 5e-3), conducting_at(wave, 15e-3)
    ({'d1': True}, {'d1': False})
    """
    states: dict[str, bool] = {}
    for event in solution.events:
        on = event.change == "on"
        if event.element not in states:
            states[event.element] = not on  # before its first change
        if event.time <= time:
            states[event.element] = on
    # what never changes conducts if it carries a current
    for name in solution.columns:
        element = name[2:-1]
        letter = element.rpartition(".")[2][:1]
        if name.startswith("i(") and letter in "dsmqjzw" and element not in states:
            values = solution[name]
            there = abs(float(np.interp(time, solution.axis, values)))
            states[element] = bool(there > _NONE * float(np.max(np.abs(values), initial=0.0)))
    return states
