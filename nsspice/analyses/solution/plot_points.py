"""Signals on the points of the engine, for pictures: output points are as far apart as asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...errors import NsspiceError
from ..signals.signal_function import places
from .computed_signals import made_of
from .solution import Solution

#: points of a picture at least, so that few long pieces look smooth
_POINTS = 2000


def drawn(solution: Solution, names: Sequence[str]) -> Solution:
    r"""Return signals on the points of the engine, with both sides of every jump.

    Parameters
    ----------
    solution : Solution
        Of a sweep, and of rows without an engine, the rows stay.
    names : sequence of str
        Signals, or expressions of signals.

    Examples
    --------
    >>> import nsspice
    >>> sine = nsspice.read("sine\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n.tran 1m 1m\n").run()[0]
    >>> bool(abs(sine["v(a)"]).max() < 1e-12), round(float(drawn(sine, ["v(a)"])["v(a)"].max()), 3)
    (True, 1.0)
    """
    if solution.again is None or solution.axis.size < 2:
        return _rows(solution, names)
    needed = [n for name in names for n in made_of(name)]
    try:
        motion = solution.motion(needed)
    except NsspiceError:  # more than can be kept
        return _rows(solution, names)
    pieces = motion.pieces
    count = max(pieces.points, -(-_POINTS // pieces.begin.size))
    found = motion.signals(np.arange(pieces.begin.size), places(count))
    # instants of two pieces that meet may differ by rounding
    axis = np.maximum.accumulate(found[solution.axis_name].ravel())
    signals = {name: values.ravel() for name, values in found.items() if name in needed}
    changes: dict[str, Any] = {"fine": None, "recording": None, "again": None, "more": None}
    return replace(solution, axis=axis, signals=signals, **changes)


def _rows(solution: Solution, names: Sequence[str]) -> Solution:
    """Return the output points with both sides of jumps, where those are known of all signals."""
    rows = solution.with_jumps()
    return rows if all(n in rows for name in names for n in made_of(name)) else solution
