"""Closed form of the six-pulse bridge of ``netlists/rectifiers/thyristor_bridge.net``.

Each firing begins an overlap, in which the phase that is fired (current j) takes the load current i
over from the one before on its side:

    2 La j' - La i' = e,     (L + 2 La) i' - La j' + R i = u

with the voltage ``u`` between the two phases that conducted so far and ``e`` from the phase that is
left to the one that is fired.  It ends when j = i.  Then
``(L + 2 La) i' + R i = u`` up to the next firing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

PEAK, OMEGA, LINE, CHOKE, LOAD = 325.0, 2 * np.pi * 50, 0.5e-3, 20e-3, 10.0
FIRST, SIXTH = 25e-3 / 6, 10e-3 / 3
PHASES = {"a": 0.0, "b": -2 * np.pi / 3, "c": 2 * np.pi / 3}
#: phases of the thyristors 1 to 6; those with odd numbers feed the positive rail
ORDER = ("a", "c", "b", "a", "c", "b")


class Motion:
    """Solution of ``M y' + K y = Im(S exp(j w t))`` from y(start)."""

    def __init__(self, M: np.ndarray, K: np.ndarray, S: list[complex], start: float, y: list):
        self.start = start
        self.A = -np.linalg.solve(M, K)
        self.phasor = np.linalg.solve(1j * OMEGA * M + K, np.array(S))
        self.rest = np.asarray(y, dtype=float) - np.imag(self.phasor * np.exp(1j * OMEGA * start))

    def __call__(self, t: float) -> np.ndarray:
        """Return y(t)."""
        free = expm(self.A * (t - self.start)) @ self.rest
        return free + np.imag(self.phasor * np.exp(1j * OMEGA * t))

    def rate(self, t: float) -> np.ndarray:
        """Return y'(t)."""
        free = self.A @ expm(self.A * (t - self.start)) @ self.rest
        return free + np.real(OMEGA * self.phasor * np.exp(1j * OMEGA * t))


@dataclass
class Interval:
    """What conducts from ``begin`` to ``end``; ``fired`` takes over on its side, if it is given."""

    begin: float
    end: float
    top: str
    bottom: str
    side: str
    fired: str
    motion: Motion


def intervals(stop: float) -> list[Interval]:
    """Return the intervals from the second firing, which closes the loop, to ``stop`` [s]."""
    phasor = {k: PEAK * np.exp(1j * angle) for k, angle in PHASES.items()}
    rails = {"top": "a", "bottom": "c"}
    both = CHOKE + 2 * LINE

    def alone(begin: float, end: float, current: float) -> Interval:
        u = phasor[rails["top"]] - phasor[rails["bottom"]]
        motion = Motion(np.array([[both]]), np.array([[LOAD]]), [u], begin, [current])
        return Interval(begin, end, rails["top"], rails["bottom"], "", "", motion)

    found = [alone(FIRST + SIXTH, FIRST + 2 * SIXTH, 0.0)]
    number = 2
    while found[-1].end < stop:
        begin, end = found[-1].end, FIRST + (number + 1) * SIXTH
        current = float(found[-1].motion(begin)[0])
        assert current > 0.0, "the closed form is that of continuous conduction"
        side, fired = ("top", "bottom")[number % 2], ORDER[number % 6]
        e = (phasor[fired] - phasor[rails[side]]) * (1 if side == "top" else -1)
        u = phasor[rails["top"]] - phasor[rails["bottom"]]
        M = np.array([[-LINE, 2 * LINE], [both, -LINE]])
        K = np.array([[0.0, 0.0], [LOAD, 0.0]])
        motion = Motion(M, K, [e, u], begin, [current, 0.0])
        over = brentq(lambda t, y=motion: float(np.subtract(*y(t))), begin, end, xtol=1e-17)
        found.append(Interval(begin, over, rails["top"], rails["bottom"], side, fired, motion))
        rails[side] = fired
        found.append(alone(over, end, float(motion(over)[0])))
        number += 1
    return found


def signals(t: float, found: list[Interval]) -> tuple[float, float, float, float]:
    """Return load current and voltage, current of thyristor 1 and of phase a at one instant."""
    inside = [s for s in found if s.begin <= t < s.end]
    if not inside:
        return 0.0, 0.0, 0.0, 0.0
    s = inside[0]
    y, rate = s.motion(t), s.motion.rate(t)

    def share(side: str, phase: str, holder: str) -> float:
        if s.side == side:
            return float({holder: y[0] - y[1], s.fired: y[1]}.get(phase, 0.0))
        return float(y[0]) if phase == holder else 0.0

    upper, lower = share("top", "a", s.top), share("bottom", "a", s.bottom)
    return float(y[0]), float(CHOKE * rate[0] + LOAD * y[0]), upper, upper - lower
