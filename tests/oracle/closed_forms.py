"""Closed-form solutions of the thesis examples, derived anew phase by phase.

Source of the problems: T. Roubal, Non-smooth analysis in engineering and economics (2015), with
corrections.  Each function returns a :class:`Solution`: the switching times and a function that
gives every signal at arbitrary times.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Signals = dict[str, Floats]


@dataclass(frozen=True)
class Solution:
    """Switching times [s] and the signals as a function of an array of times."""

    switches: tuple[float, ...]
    at: Callable[[Floats], Signals]


@dataclass(frozen=True)
class Phase:
    """Signals from ``start`` on, as a function of the time since then."""

    start: float
    signals: Callable[[Floats], tuple[Floats, ...]]


def _joined(phases: list[Phase], names: tuple[str, ...]) -> Solution:
    starts = np.array([p.start for p in phases])

    def at(t: Floats) -> Signals:
        t = np.asarray(t, dtype=float)
        which = np.maximum(np.searchsorted(starts, t, side="left") - 1, 0)
        out = {name: np.empty_like(t) for name in names}
        for k, phase in enumerate(phases):
            chosen = which == k
            if chosen.any():
                values = phase.signals(t[chosen] - phase.start)
                for name, value in zip(names, values, strict=True):
                    out[name][chosen] = value
        return out

    return Solution(tuple(starts[1:]), at)


def _bisect(f: Callable[[float], float], a: float, b: float) -> float:
    """Return the sign change of f in [a, b] to the last bit."""
    left = f(a)
    for _ in range(200):
        c = 0.5 * (a + b)
        if c in (a, b):
            break
        value = f(c)
        if (value < 0) == (left < 0):
            a = c
        else:
            b = c
    return 0.5 * (a + b)


def coulomb(m: float, v0: float, load: float, mu: float = 1.0, g: float = 9.81) -> Solution:
    """Example 4.1.1: ``m v' = load sin t - mu m g Sgn(v)``, v0 < 0, load below the friction.

    Signals ``v`` and ``f``, the friction force ``mu m g Sgn(v)``; at rest it balances the load.
    """
    grip = mu * m * g

    def moving(t: Floats | float) -> Floats:
        return np.asarray(v0 + mu * g * t + load / m * (1 - np.cos(t)))

    stop = _bisect(lambda t: float(moving(t)), 0.0, (abs(v0) + 2 * abs(load) / m) / (mu * g))
    return _joined(
        [
            Phase(0.0, lambda t: (moving(t), np.full_like(t, -grip))),
            Phase(stop, lambda t: (np.zeros_like(t), load * np.sin(t + stop))),
        ],
        ("v", "f"),
    )


def sgn_inductor(x0: float) -> Solution:
    """Example 2.3.1, corrected: ``x' = sin t + 2 - v``, v in Sgn_{0,2}(x), x0 < 0, until 4 pi.

    From the negative side x rises with v = 0; above zero v = 2 and x' = sin t; the return to zero
    is at 2 pi minus the crossing, where x rests with v = 2 + sin t until sin t changes sign.
    """

    def rising(t: Floats | float) -> Floats:
        return np.asarray(x0 + 2 * t + 1 - np.cos(t))

    up = _bisect(lambda t: float(rising(t)), 0.0, -x0)
    down, again = 2 * math.pi - up, 2 * math.pi
    return _joined(
        [
            Phase(0.0, lambda t: (rising(t), np.zeros_like(t))),
            Phase(up, lambda t: (math.cos(up) - np.cos(t + up), np.full_like(t, 2.0))),
            Phase(down, lambda t: (np.zeros_like(t), 2 + np.sin(t + down))),
            Phase(again, lambda t: (1 - np.cos(t), np.full_like(t, 2.0))),
        ],
        ("x", "v"),
    )


def braked_oscillator(
    m: float, c: float, k: float, forward: float, backward: float, x0: float, v0: float
) -> Solution:
    """``m x'' + c x' + k x = F``, F = ``forward`` for x' > 0, ``backward`` for x' < 0, v0 != 0.

    Covers 4.1.2 (F = -mu Sgn x') and 4.2.3 (F = 0 or Vz).  Where x' = 0 and k x lies between the
    two forces the system rests with F = k x.  Signals ``x``, ``v``, ``F``.
    """
    decay = c / (2 * m)
    omega = math.sqrt(k / m - decay**2)
    phases: list[Phase] = []
    start, x, v = 0.0, x0, v0
    force = forward if v0 > 0 else backward

    def free(x: float, v: float, force: float) -> Callable[[Floats], tuple[Floats, ...]]:
        a = x - force / k
        slope = -(decay * v + k / m * a) / omega  # x' = exp(-decay t) (v cos + slope sin)

        def signals(t: Floats) -> tuple[Floats, ...]:
            e, co, si = np.exp(-decay * t), np.cos(omega * t), np.sin(omega * t)
            position = force / k + e * (a * co + (v + decay * a) / omega * si)
            return position, e * (v * co + slope * si), np.full_like(t, force)

        return signals

    while True:
        law = free(x, v, force)
        phases.append(Phase(start, law))
        a = x - force / k
        slope = -(decay * v + k / m * a) / omega
        angle = math.atan2(v, -slope) % math.pi if v != 0.0 else math.pi
        x = float(law(np.array([angle / omega]))[0][0])
        start, v = start + angle / omega, 0.0
        if k * x < forward:
            force = forward
        elif k * x > backward:
            force = backward
        else:
            phases.append(Phase(start, _rest(x, k)))
            return _joined(phases, ("x", "v", "F"))


def _rest(x: float, k: float) -> Callable[[Floats], tuple[Floats, ...]]:
    """Return the signals of a body at rest at x, where the force carries the spring's."""
    return lambda t: (np.full_like(t, x), np.zeros_like(t), np.full_like(t, k * x))


def compliant_bounce(
    m: float, k: float, x0: float, v0: float, until: float, g: float = 9.81
) -> Solution:
    """Example 4.1.4 (4.4): free fall onto a spring of stiffness k at height 0; elastic.

    Signals ``x``, ``v``, ``n`` (contact force).
    """
    omega = math.sqrt(k / m)
    sag = m * g / k
    impact = math.sqrt(v0**2 + 2 * g * x0)  # speed at every contact, by conservation of energy

    def fall(x: float, v: float) -> Callable[[Floats], tuple[Floats, ...]]:
        return lambda t: (x + v * t - 0.5 * g * t**2, v - g * t, np.zeros_like(t))

    def contact(t: Floats) -> tuple[Floats, ...]:
        co, si = np.cos(omega * t), np.sin(omega * t)
        x = -sag + sag * co - impact / omega * si
        return x, -sag * omega * si - impact * co, -k * x

    # leaves where x returns to 0: sag (cos - 1) = impact/omega sin, second root
    stay = 2 * (math.pi - math.atan2(impact, sag * omega)) / omega
    phases = [Phase(0.0, fall(x0, v0))]
    start = (v0 + impact) / g
    while start < until:
        phases.append(Phase(start, contact))
        phases.append(Phase(start + stay, fall(0.0, impact)))
        start += stay + 2 * impact / g
    return _joined(phases, ("x", "v", "n"))


def rigid_impact(m: float, x0: float, v0: float, g: float = 9.81) -> Solution:
    """Example 4.1.4 (4.5) without restitution; ``n`` holds the regular part of the force only.

    The impulse at the impact is ``m sqrt(v0^2 + 2 g x0)``.
    """
    hit = (v0 + math.sqrt(v0**2 + 2 * g * x0)) / g
    return _joined(
        [
            Phase(0.0, lambda t: (x0 + v0 * t - 0.5 * g * t**2, v0 - g * t, np.zeros_like(t))),
            Phase(hit, lambda t: (np.zeros_like(t), np.zeros_like(t), np.full_like(t, m * g))),
        ],
        ("x", "v", "n"),
    )


def parallel_rlc(c: float, l: float, r: float, v0: float, i0: float) -> Solution:
    """Example 4.2.4: a resistor behind a full bridge acts as the resistor itself.

    ``C v' = -i - v/R``, ``L i' = v``; signals ``v``, ``i``, ``iR`` = \\|v\\|/R (bridge output).
    """
    decay = 1 / (2 * r * c)
    omega = math.sqrt(1 / (l * c) - decay**2)

    def signals(t: Floats) -> tuple[Floats, ...]:
        e, co, si = np.exp(-decay * t), np.cos(omega * t), np.sin(omega * t)
        v = e * (v0 * co + (-(i0 + v0 / r) / c + decay * v0) / omega * si)
        i = e * (i0 * co + (v0 / l + decay * i0) / omega * si)
        return v, i, np.abs(v) / r

    # zeros of v: the bridge switches there
    slope = (-(i0 + v0 / r) / c + decay * v0) / omega
    first = (math.atan2(v0, -slope) % math.pi) / omega
    count = int(40 / (decay * math.pi / omega)) + 1
    zeros = tuple(first + k * math.pi / omega for k in range(count))
    return Solution(zeros, _joined([Phase(0.0, signals)], ("v", "i", "iR")).at)


def static_limits(e: Floats, r: float, forward: float, reverse: float) -> tuple[Floats, Floats]:
    """Section 1.1: current and diode voltage of E - R - diode with drop and breakdown voltage."""
    v = np.clip(e, -reverse, forward)
    return (e - v) / r, v
