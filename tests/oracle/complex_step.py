"""A buck converter in two states and its derivatives by complex steps, apart from the program.

``z = (i, v, 1)`` follows ``z' = M z`` in each of three modes; instants are roots of one row by
Newton's method, integrals those of exponentials of augmented matrices.  All of it takes complex
parameters: with ``p + i h`` the imaginary part of a result over ``h`` is its derivative by ``p``,
without a difference (W. Squire, G. Trapp, SIAM Review 40 (1998) 110,
doi:10.1137/S003614459631241X).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.linalg import expm

Parameters = Mapping[str, Any]
NOMINAL = {
    "vin": 24.0, "rs": 0.03, "rd": 0.01, "vf": 0.6, "l": 40e-6, "rl": 0.02, "c": 10e-6, "r": 60.0,
    "don": 0.4, "t": 1e-5,
}  # fmt: skip


def _modes(p: Parameters) -> dict[str, Any]:
    """Return the matrices of the modes: switch, diode, neither conducts."""
    decay, charge = -1.0 / (p["r"] * p["c"]), 1.0 / p["c"]

    def mode(resistance: Any, voltage: Any) -> Any:
        first = [-(resistance + p["rl"]) / p["l"], -1.0 / p["l"], voltage / p["l"]]
        return np.array([first, [charge, decay, 0.0], [0.0, 0.0, 0.0]])

    none = np.array([[0.0, 0.0, 0.0], [0.0, decay, 0.0], [0.0, 0.0, 0.0]])
    return {"on": mode(p["rs"], p["vin"]), "off": mode(p["rd"], -p["vf"]), "none": none}


def _over(M: Any, z: Any, d: Any) -> tuple[Any, Any]:
    """Return z after a time, and the integral of the products of its entries over it."""
    n = len(M)
    square = np.kron(M, np.eye(n)) + np.kron(np.eye(n), M)
    big = np.zeros((2 * n * n, 2 * n * n), complex)
    big[: n * n, : n * n], big[n * n :, : n * n] = square, np.eye(n * n)
    whole = expm(big * d)[n * n :, : n * n] @ np.kron(z, z)
    return expm(M * d) @ z, whole.reshape(n, n)


def _after(M: Any, z: Any, d: Any) -> tuple[Any, None]:
    return expm(M * d) @ z, None


def period(p: Parameters, z: Any, over: Any = _over) -> tuple[Any, list[Any], Any]:
    """Return z after a period, the integrals of its products, and the largest current."""
    M = _modes(p)
    on, rest = p["don"] * p["t"], (1.0 - p["don"]) * p["t"]
    z, first = over(M["on"], z, on)
    top = z[0]
    if (expm(M["off"] * rest) @ z)[0].real > 0.0:
        z, second = over(M["off"], z, rest)
        return z, [first, second], top
    d = -z[0] / (M["off"] @ z)[0]  # Newton's method, in complex numbers
    for _ in range(12):
        y = expm(M["off"] * d) @ z
        d = d - y[0] / (M["off"] @ y)[0]
    y, second = over(M["off"], z, d)
    y[0] = 0.0
    y, third = over(M["none"], y, rest - d)
    return y, [first, second, third], top


def steady(p: Parameters) -> dict[str, Any]:
    """Return measures of the periodic steady state."""
    x = np.array([0.0, 9.0], complex)

    def after(x: Any) -> Any:
        return period(p, np.append(x, 1.0), _after)[0][:2]

    for _ in range(30):
        J = np.array([(after(x + 1e-6 * e) - after(x - 1e-6 * e)) / 2e-6 for e in np.eye(2)]).T
        step = np.linalg.solve(np.eye(2) - J, after(x) - x)
        x = x + step
        # the imaginary part, the derivative, comes with it, a step later
        if np.abs(step).max() < 1e-13 and np.abs(step.imag).max() < 1e-13 * np.abs(x.imag).max():
            break
    return _measures(p, np.append(x, 1.0), 1)


def transient(p: Parameters, periods: int) -> dict[str, Any]:
    """Return measures of some periods from rest."""
    return _measures(p, np.array([0.0, 0.0, 1.0], complex), periods)


def _measures(p: Parameters, z: Any, periods: int) -> dict[str, Any]:
    total, top = 0.0, -np.inf
    for _ in range(periods):
        z, more, peak = period(p, z)
        total = total + sum(more)
        top = peak if np.real(peak) > np.real(top) else top
    span = periods * p["t"]
    return {
        "v_avg": total[1, 2] / span,
        "v_rms": np.sqrt(total[1, 1] / span),
        "i_avg": total[0, 2] / span,
        "i_max": top,
        "p_r": total[1, 1] / span / p["r"],
        "v_end": z[1],
    }


def derivatives(
    measures: Callable[[Parameters], dict[str, Any]], p: Parameters
) -> dict[str, dict[str, float]]:
    """Return the derivatives of measures by all parameters."""
    found: dict[str, dict[str, float]] = {}
    for name, value in p.items():
        h = 1e-25 * value
        for measure, result in measures({**p, name: value + 1j * h}).items():
            found.setdefault(measure, {})[name] = float(np.imag(result) / h)
    return found
