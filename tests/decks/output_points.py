"""Whether what a run says of its output points (NS5004) is so, by a run that shows all points."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

import nsspice


def told(
    run: nsspice.Solution,
    fine: Callable[[], nsspice.Solution],
    near: float = 0.05,
    kinds: str = "vi",
) -> list[str]:
    """Return the codes of the warnings of a run, without NS5004 if all that it claims is true.

    Parameters
    ----------
    run : Solution
    fine : callable
        Returns the same run with all points.
    near : float
        Part of what is told: it is told from stages of steps, of lower order than their ends.
    kinds : str
        Voltages or currents, where one of them depends on the steps.
    """
    codes = []
    for warning in run.warnings:
        if warning.code != "NS5004":
            codes.append(warning.code)
            continue
        claims = re.findall(rf"([{kinds}]\([^)]*\)) by (\S+) \S+ \(at (\S+) s\)", warning.message)
        assert claims
        shown = fine()
        codes += [f"NS5004 {claim}" for claim in claims if not _is_true(run, shown, near, *claim)]
    return codes


def _is_true(
    run: nsspice.Solution,
    fine: nsspice.Solution,
    part: float,
    name: str,
    amount: str,
    instant: str,
) -> bool:
    # the instant is told with six digits: it may fall into the interval beside its own
    near = np.clip(
        np.searchsorted(run.time, float(instant) * (1.0 + 1e-5 * np.array([-1, 1]))),
        1,
        run.time.size - 1,
    )
    beyond = 0.0
    for k in np.unique(near):
        low, high = sorted(run[name][k - 1 : k + 1])
        inside = fine[name][(fine.time >= run.time[k - 1]) & (fine.time <= run.time[k])]
        beyond = max(beyond, low - inside.min(), inside.max() - high)
    return bool(beyond >= (1.0 - part) * float(amount))
