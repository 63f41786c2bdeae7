"""The decks of ``netlists/smooth`` as equations written by hand, solved by scipy.

Static decks are scalar equations with one root, dynamic ones ordinary differential equations for
the capacitor voltages and coil currents, integrated by Radau's method of fifth order.  Each deck
has the parameter ``n``, the emission coefficient.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

VT = 1.380649e-23 * 300.15 / 1.602176634e-19
#: values of some signals over the times asked for
Table = dict[str, np.ndarray]


def junction(v: float, saturation: float, n: float) -> float:
    """Return Shockley's current, going on straight where the exponential would overflow."""
    level = v / (n * VT)
    if level > 500.0:
        return saturation * math.exp(500.0) * (1.0 + level - 500.0)
    return saturation * math.expm1(level)


def root(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the root of a monotone function."""
    return float(brentq(function, low, high, xtol=1e-15, rtol=1e-15, maxiter=500))


def radau(
    rate: Callable[[float, np.ndarray], Sequence[float]],
    start: Sequence[float],
    times: np.ndarray,
    longest: float,
) -> np.ndarray:
    """Return the states at the times, shape (k, states)."""
    found = solve_ivp(
        rate,
        (0.0, float(times[-1])),
        start,
        method="Radau",
        t_eval=times,
        rtol=1e-9,
        atol=1e-11,
        max_step=longest,
    )
    assert found.success
    return np.asarray(found.y.T)


def half_wave(times: np.ndarray, n: float = 1.0) -> Table:
    """``v_out = R IS expm1((v_in - v_out)/n VT)``."""
    out = []
    for v in 10.0 * np.sin(2 * np.pi * 50.0 * times):
        low, high = (-1e-9, v) if v > 0.0 else (v, 1e-12)
        out.append(root(lambda x, v=v: x / 1e3 - junction(v - x, 1e-14, n), low, max(high, 1e-9)))
    return {"v(out)": np.array(out)}


def zener(times: np.ndarray, n: float = 1.0) -> Table:
    """Two exponentials, the second one such that -5 mA flow at -5.1 V."""
    saturation, slope = 1e-14, n * VT
    start = 5.1 - slope * math.log(5e-3 / saturation - 1.0)  # expm1(-5.1/VT) is -1

    def diode(v: float) -> float:
        return junction(v, saturation, n) - junction(-v - start, saturation, n) - saturation

    out = []
    for v in 12.0 + 2.0 * np.sin(2 * np.pi * 100.0 * times):
        # the diode stands from ground to out
        out.append(root(lambda x, v=v: (x - v) / 220 + x / 1e3 - diode(-x), 0.0, v))
    return {"v(out)": np.array(out)}


def half_wave_capacitor(times: np.ndarray, n: float = 1.0) -> Table:
    """``C v' = i_D(v_in - v) - v/R``."""

    def rate(t: float, x: np.ndarray) -> list[float]:
        v = 10.0 * math.sin(2 * math.pi * 50.0 * t)
        return [(junction(v - x[0], 1e-14, n) - x[0] / 1e3) / 100e-6]

    return {"v(out)": radau(rate, [0.0], times, 1e-4)[:, 0]}


def bridge(times: np.ndarray, n: float = 1.0) -> Table:
    """``C v' = i - v/R`` with v = vp - vq; by symmetry p and q lie about half the source."""

    def rate(t: float, x: np.ndarray) -> list[float]:
        v = 12.0 * math.sin(2 * math.pi * 50.0 * t)
        p = (v + x[0]) / 2.0
        into = junction(v - p, 1e-12, n) + junction(-p, 1e-12, n)
        return [(into - x[0] / 2e3) / 47e-6]

    return {"v(p,q)": radau(rate, [0.0], times, 1e-4)[:, 0]}


def clamp(times: np.ndarray, n: float = 1.0) -> Table:
    """``C v' = v_out/R - i_D(-v_out)`` with v_out = v_in - v."""

    def source(t: float) -> float:
        return 5.0 * math.sin(2 * math.pi * 1e3 * t)

    def rate(t: float, x: np.ndarray) -> list[float]:
        out = source(t) - x[0]
        return [(out / 100e3 - junction(-out, 1e-14, n)) / 1e-6]

    state = radau(rate, [0.0], times, 1e-5)[:, 0]
    return {"v(out)": np.array([source(t) for t in times]) - state}


def multiplier(times: np.ndarray, n: float = 1.0) -> Table:
    """Two capacitors: ``v1 = v_in - v_a`` and ``v2 = v_out``."""

    def source(t: float) -> float:
        return 10.0 * math.sin(2 * math.pi * 1e3 * t)

    def rate(t: float, x: np.ndarray) -> list[float]:
        a = source(t) - x[0]
        first, second = junction(-a, 1e-14, n), junction(a - x[1], 1e-14, n)
        return [(second - first) / 1e-6, (second - x[1] / 100e3) / 1e-6]

    state = radau(rate, [0.0, 0.0], times, 1e-5)
    return {
        "v(out)": state[:, 1],
        "v(a)": np.array([source(t) for t in times]) - state[:, 0],
    }


def buck(times: np.ndarray, n: float = 1.0) -> Table:
    """Coil current and output voltage; the switch is closed for the first 4 of every 10 us."""
    period, on = 10e-6, 4e-6

    def node(current: float, closed: bool) -> float:
        if closed:
            return root(
                lambda v: (v - 12.0) / 10e-3 + current - junction(-v, 1e-9, n), -5.0, 12.0 + 1.0
            )
        return -n * VT * math.log1p(current / 1e-9)  # the coil current stays positive

    states, x = [], np.array([1.0, 4.5])
    last = round(float(times[-1]) / period)
    wanted = list(times)
    for cycle in range(last + 1):
        for begin, end, closed in (
            (cycle * period, cycle * period + on, True),
            (cycle * period + on, (cycle + 1) * period, False),
        ):
            inside = [min(t, end) for t in wanted if begin + 1e-12 < t <= end + 1e-12]

            def rate(t: float, y: np.ndarray, closed: bool = closed) -> list[float]:
                return [(node(y[0], closed) - y[1]) / 100e-6, (y[0] - y[1] / 4.0) / 47e-6]

            found = solve_ivp(
                rate,
                (begin, end),
                x,
                "Radau",
                t_eval=sorted({*inside, end}),
                rtol=1e-10,
                atol=1e-12,
            )
            assert found.success
            states += [found.y[:, k] for k in range(len(inside))]
            x = found.y[:, -1]
    table = np.array(states)
    return {"i(l1)": table[:, 0], "v(out)": table[:, 1]}


DECKS: dict[str, Callable[..., Table]] = {
    "half_wave": half_wave,
    "half_wave_capacitor": half_wave_capacitor,
    "bridge": bridge,
    "clamp": clamp,
    "zener": zener,
    "multiplier": multiplier,
    "buck": buck,
}
