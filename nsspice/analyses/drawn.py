"""Signals on the points of the engine, for pictures: output points are as far apart as asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import NsspiceError
from .motion import places
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

    Examples
    --------
    >>> import nsspice
    >>> sine = nsspice.read("sine\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n.tran 1m 1m\n").run()[0]
    >>> bool(abs(sine["v(a)"]).max() < 1e-12), round(float(drawn(sine, ["v(a)"])["v(a)"].max()), 3)
    (True, 1.0)
    """
    if solution.again is None or solution.axis.size < 2:
        return solution.with_jumps()
    try:
        motion = solution.motion(names)
    except NsspiceError:  # more than can be kept
        return solution.with_jumps()
    pieces = motion.pieces
    count = max(pieces.points, -(-_POINTS // pieces.begin.size))
    found = motion.signals(np.arange(pieces.begin.size), places(count))
    # instants of two pieces that meet may differ by rounding
    axis = np.maximum.accumulate(found[solution.axis_name].ravel())
    signals = {name: found[name].ravel() for name in names}
    changes: dict[str, Any] = {"fine": None, "recording": None, "again": None}
    return replace(solution, axis=axis, signals=signals, **changes)
