"""Expressions once more: what the engines compute with, against the trees that were read."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...circuit import MnaSystem
from ...devices.stamper import Written
from ...problems.csc import Floats
from ...solvers.moreau import function_values
from .energy import worse

#: Points looked at in one block of records.
_MOST = 256
#: A signal is known to this part of itself: where an expression jumps or is steep between such
#: values, all of them are right.
_KNOWN = 64.0 * float(np.finfo(np.float64).eps)


class ExpressionCheck:
    """Evaluates the expressions of a deck at recorded points, and compares the tape's values.

    Every expression is taken from its tree by numpy, with the voltages of the nodes that it names;
    currents and the time are those on the tape.

    Parameters
    ----------
    mna : MnaSystem
        With smooth laws.
    """

    def __init__(self, mna: MnaSystem) -> None:
        assert mna.system.smooth is not None
        self._layout = mna.layout
        self._written: list[Written] = mna.layout.readings
        registers: list[int] = []
        for written in self._written:
            registers += [written.register, *written.signals.values()]
        outputs = np.array(registers, dtype=np.int32)
        self._tape = replace(mna.system.smooth.tape, outputs=outputs)
        self._largest = [0.0] * len(self._written)
        #: worst relative error
        self.error = 0.0
        #: expression that is off most
        self.worst: Written | None = None

    def take(self, time: Floats, z: Floats, u: Floats) -> None:
        """Compare values at points: some of them, if they are many.

        Parameters
        ----------
        time : ndarray, shape (k,)
            [s]
        z, u : ndarray, shapes (k, n), (k, p)
        """
        if not time.size:
            return
        stride = -(-time.size // _MOST)
        time, z, u = time[::stride], z[::stride], u[::stride]
        values = iter(function_values(self._tape, z, u, time).T)
        for k, written in enumerate(self._written):
            found = next(values)
            signals = {name: self._signal(name, next(values), z) for name in written.signals}
            self._largest[k] = max(self._largest[k], float(np.max(np.abs(found))))
            off = _outside(written, signals, found)
            if off > 0.0 or off != off:
                error = off / self._largest[k] if self._largest[k] > 0.0 else math.inf
                if worse(error, self.error):
                    self.error, self.worst = error, written

    def _signal(self, name: str, register: Floats, z: Floats) -> Floats:
        """Return the values of a signal."""
        if not name.startswith("v("):
            return register
        a, b = (*name[2:-1].split(","), "0")[:2]
        total = np.zeros(z.shape[0])
        for column, factor in self._layout.voltage(a, b):
            total = total + factor * z[:, column]
        return total


def _outside(written: Written, signals: Mapping[str, Floats], found: Floats) -> float:
    """Return how far values are from those of a tree, the rounding of its signals left aside."""
    rows = np.ones(found.size)
    with np.errstate(all="ignore"):
        value = written.expression.evaluate(signals) * rows
        difference = np.abs(found - value)
        if not signals or float(np.max(difference)) == 0.0:
            return float(np.max(difference))
        low = high = value
        for name in signals:
            for part in (-_KNOWN, _KNOWN):
                moved = {**signals, name: signals[name] * (1.0 + part)}
                near = written.expression.evaluate(moved) * rows
                low, high = np.minimum(low, near), np.maximum(high, near)
        # what is the same on both sides, infinite too, is right
        off = np.where(found == value, 0.0, np.maximum(low - found, found - high))
    return float(np.max(off))
