"""A Cockcroft-Walton multiplier as an explicit differential equation, solved by scipy's Radau.

The states are the voltages of the capacitors; the node behind the source's resistor follows from
the sum of all diode currents, a monotone piecewise-linear scalar equation.  Shares nothing with
the package: neither its matrices nor its modes nor its events.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import Radau

_SERIES, _CAPACITANCE, _ON, _OFF = 1.0, 1e-6, 1.0 / 0.1, 1e-9
_REACTIONS = 200


class Multiplier:
    """10 V, 1 kHz, 1 Ohm; 1 uF throughout; diodes of 0.1 Ohm and 1 GOhm; 100 kOhm per stage.

    States are ``v(a[s-1]) - v(a[s])``, then ``v(b[s]) - v(b[s-1])``.
    """

    def __init__(self, stages: int) -> None:
        self.stages = stages
        self.load = 1e5 * stages
        self.sums = np.tril(np.ones((stages, stages)))

    def diodes(self, t: float, x: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the voltages from a to b and from b to the next a, and their conductances."""
        n, source = self.stages, 10.0 * np.sin(2e3 * np.pi * t)
        a, b = -self.sums @ x[:n], self.sums @ x[n:]
        up, across = a - b, np.concatenate([[0.0], b[:-1]]) - a  # with 0 V behind the resistor
        node, known = source, None
        for _ in range(_REACTIONS):
            g_up = np.where(up + node > 0.0, _ON, _OFF)
            g_across = np.where(across - node > 0.0, _ON, _OFF)
            if known == (g_up.tobytes(), g_across.tobytes()):
                return up + node, across - node, g_up, g_across
            known = (g_up.tobytes(), g_across.tobytes())
            total = 1.0 / _SERIES + g_up.sum() + g_across.sum()
            node = (source / _SERIES - g_up @ up + g_across @ across) / total
        raise RuntimeError("the node behind the resistor is not found")

    def rate(self, t: float, x: np.ndarray) -> np.ndarray:
        up, across, g_up, g_across = self.diodes(t, x)
        up, across = g_up * up, g_across * across
        drawn = np.append(across[1:], x[self.stages :].sum() / self.load)
        return (
            np.concatenate([self.sums.T @ (up - across), self.sums.T @ (up - drawn)]) / _CAPACITANCE
        )

    def slope(self, t: float, x: np.ndarray) -> np.ndarray:
        n = self.stages
        _, _, g_up, g_across = self.diodes(t, x)
        zero = np.zeros((1, n))
        up = np.hstack([-self.sums, -self.sums])
        across = np.hstack([self.sums, np.vstack([zero, self.sums[:-1]])])
        node = (g_across @ across - g_up @ up) / (1.0 / _SERIES + g_up.sum() + g_across.sum())
        up, across = g_up[:, None] * (up + node), g_across[:, None] * (across - node)
        load = np.concatenate([zero[0], np.full(n, 1.0 / self.load)])
        drawn = np.vstack([across[1:], load])
        return np.vstack([self.sums.T @ (up - across), self.sums.T @ (up - drawn)]) / _CAPACITANCE

    def last_node(self, stop: float, tolerance: float) -> float:
        """Return the voltage of the last node, started from rest."""
        rest = np.zeros(2 * self.stages)
        solver = Radau(
            self.rate,
            0.0,
            rest,
            stop,
            rtol=tolerance,
            atol=tolerance,
            jac=self.slope,
            max_step=2e-5,
        )
        while solver.status == "running":
            solver.step()
        assert solver.status == "finished"
        return float(solver.y[self.stages :].sum())
