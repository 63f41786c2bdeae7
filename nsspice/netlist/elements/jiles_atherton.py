"""Cores of Jiles and Atherton, ``.model X CORE(...)``: fitted by a table and stops.

The magnetisation follows, with the field H and ``d`` the sign of its change,

    M_an = MS He/(A + |He|),  He = H + ALPHA M
    M_irr' = max(d (M_an - M), 0)/(K - ALPHA d (M_an - M))
    dM/dH = ((1 - C) M_irr' + C M_an')/(1 - ALPHA C M_an')

as in Xyce, whose parameters and units are PSpice's.  Its major loop from a tip far in saturation
and its initial curve are computed here, and fitted by what ``core.py`` builds.

References: D. C. Jiles and D. L. Atherton, "Theory of ferromagnetic hysteresis", Journal of
Magnetism and Magnetic Materials 61 (1986) 48, doi:10.1016/0304-8853(86)90066-1; Xyce Reference
Guide, "Mutual inductors".
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..deck import Model
from ..findings import Unreadable

Floats = npt.NDArray[np.float64]

_MU0 = 4e-7 * math.pi
#: PSpice's values of what is not given: A/m, A/m, A/m, 1, 1, cm^2, cm, cm, 1
_DEFAULTS = {
    "ms": 1e6, "a": 1e3, "k": 500.0, "c": 0.2, "alpha": 0.0, "area": 0.1, "path": 1.0, "gap": 0.0,
    "pack": 1.0,
}  # fmt: skip
#: the field of the tips, in units of A + K: the loop is closed there but for a thousandth
_TIP = 5.0
#: steps of Runge and Kutta's method in a quarter of the loop
_STEPS = 800
#: points at which the fit is made and judged
_POINTS = 400
#: pieces of the table up to the tip, which err by 1/n^2 of its range at most, and doublings beyond
_PIECES, _BEYOND = 12, 7
#: densities at which the stops reach their limits, as parts of that of the tip
_LEVELS = (1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2)
#: sweeps of coordinate descent
_SWEEPS = 2000


@dataclass(frozen=True, slots=True)
class Material:
    """What a card says.

    Parameters
    ----------
    ms, a, k : float
        Saturation, shape and pinning [A/m].
    c, alpha : float
        Reversible part and feedback of the magnetisation.
    """

    ms: float
    a: float
    k: float
    c: float
    alpha: float

    def rate(self, field: float, magnetisation: float, way: float) -> float:
        """Return dM/dH."""
        effective = field + self.alpha * magnetisation
        span = self.a + abs(effective)
        lag = max(way * (self.ms * effective / span - magnetisation), 0.0)
        slope = self.ms * self.a / span**2
        irreversible = lag / (self.k - self.alpha * lag)
        part = (1.0 - self.c) * irreversible + self.c * slope
        return part / (1.0 - self.alpha * self.c * slope)

    def path(self, fields: Floats, start: float) -> Floats:
        """Return the magnetisation along fields that rise or fall [A/m], by Runge and Kutta."""
        found = [start]
        way = math.copysign(1.0, fields[-1] - fields[0])
        for one, two in zip(fields[:-1].tolist(), fields[1:].tolist(), strict=True):
            h, m = two - one, found[-1]
            k1 = self.rate(one, m, way)
            k2 = self.rate(one + 0.5 * h, m + 0.5 * h * k1, way)
            k3 = self.rate(one + 0.5 * h, m + 0.5 * h * k2, way)
            k4 = self.rate(two, m + h * k3, way)
            found.append(m + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
        return np.array(found)


@dataclass(frozen=True, slots=True)
class Fit:
    """A core: the curve without hysteresis, and stops.

    Parameters
    ----------
    area, path, gap : float
        [m^2, m, m]
    curve : list of (float, float)
        Points (H, B), from the origin on [A/m, T].
    levels : list of (float, float)
        Of each stop its limit [A/m], and the density at which it reaches it [T].
    loop, first : float
        Largest differences on the major loop and the initial curve, as parts of the tip's density.
    """

    area: float
    path: float
    gap: float
    curve: list[tuple[float, float]]
    levels: list[tuple[float, float]]
    loop: float
    first: float

    def table(self, turns: float) -> list[tuple[float, float]]:
        """Return points (current, flux) without hysteresis [A, V s]."""
        gap = self.gap / _MU0
        upper = [
            ((h * self.path + b * gap) / turns, turns * self.area * b) for h, b in self.curve[1:]
        ]
        return [*((-i, -f) for i, f in reversed(upper)), (0.0, 0.0), *upper]

    def stops(self, turns: float) -> list[tuple[float, float]]:
        """Return limit [A] and inductance [H] of each stop."""
        limits = [limit * self.path / turns for limit, _ in self.levels]
        fluxes = [turns * self.area * density for _, density in self.levels]
        return [(i, flux / i) for i, flux in zip(limits, fluxes, strict=True)]


def fitted(model: Model) -> Fit:
    """Return the fit of a card.

    Raises
    ------
    Unreadable
        NS2003 for a parameter that the card does not have, NS1025 for impossible values.
    """
    given = _values(model)
    material = Material(*(given[key] for key in ("ms", "a", "k", "c", "alpha")))
    tip = _TIP * (material.a + material.k)
    quarter = tip * np.linspace(0.0, 1.0, _STEPS + 1) ** 2
    whole = np.concatenate([-quarter[:0:-1], quarter])
    first = material.path(quarter, 0.0)
    back = material.path(whole[::-1], float(first[-1]))
    rise = _MU0 * (quarter + first)
    top = float(rise[-1])
    fall = _MU0 * (whole + back[::-1])
    grid = np.linspace(-top, top, 2 * _POINTS + 1)
    down = np.interp(grid, fall, whole)
    up = -down[::-1]
    start = np.interp(grid[_POINTS:], rise, quarter)
    middle = 0.5 * (up + down)
    limits, without = _stops(grid, 0.5 * (up - down), middle, start)
    levels = [(limit, part * top) for limit, part in zip(limits, _LEVELS, strict=True) if limit]
    curve = _curve(grid[_POINTS:], without[_POINTS:])
    curve += _beyond(material, curve[-1], tip)
    if any(h1 <= h0 or b1 <= b0 for (h0, b0), (h1, b1) in itertools.pairwise(curve)):
        message = f"core {model.name}: no table and stops fit these values"
        raise Unreadable("NS1025", message, model.span, "its curves must rise")
    table = np.interp(np.abs(grid), *np.array(curve).T[::-1]) * np.sign(grid)
    answer = _initial(grid[_POINTS:], levels)
    loop = table + _initial(np.array([top]), levels)[0] - 2.0 * _initial(0.5 * (top - grid), levels)
    return Fit(
        given["area"] * given["pack"] * 1e-4,
        given["path"] * 1e-2,
        given["gap"] * 1e-2,
        curve,
        levels,
        _apart(loop, grid, whole, fall) / top,
        _apart(table[_POINTS:] + answer, grid[_POINTS:], quarter, rise) / top,
    )


def _values(model: Model) -> dict[str, float]:
    found = dict(_DEFAULTS)
    for key, param in model.params.items():
        if key == "level":
            continue  # levels of PSpice differ in rates, which no core has here
        if key not in found:
            hint = f"it has {', '.join(found)}".upper()
            message = f"core {model.name} has no parameter {key}"
            raise Unreadable("NS2003", message, param.span, hint)
        if not isinstance(param.value, float):
            raise Unreadable("NS1010", f"core {model.name}: {key} is not a number", param.span)
        zero = key in ("c", "alpha", "gap")
        if not (0.0 < param.value < math.inf or (zero and param.value == 0.0)):
            message = f"core {model.name}: {key} cannot be {param.value:g}"
            raise Unreadable("NS1025", message, param.span, "give a positive number")
        found[key] = param.value
    if found["c"] > 1.0 or found["alpha"] * found["ms"] >= found["a"]:
        message = f"core {model.name}: its magnetisation has no single curve"
        hint = "C is at most 1, and ALPHA*MS less than A"
        raise Unreadable("NS1025", message, model.span, hint)
    return found


def _initial(density: Floats, levels: list[tuple[float, float]]) -> Floats:
    """Return the field of stops that start at rest [A/m]."""
    parts = [limit * np.minimum(density / level, 1.0) for limit, level in levels]
    return np.asarray(sum(parts, np.zeros_like(density)))


def _stops(
    grid: Floats, width: Floats, middle: Floats, start: Floats
) -> tuple[list[float], Floats]:
    """Return the limits of the stops, and what is left of the curve between the branches.

    From the tip a stop of level b is at ``1 - 2 min((top - B)/2b, 1)``; half the sum and half the
    difference of it and its mirror image are its parts in middle and width of the loop.  Errors of
    the field count by the slope of the curve, as errors of the density.
    """
    top = grid[-1]
    slope = np.abs(np.gradient(grid, middle))
    ends = [np.minimum(0.5 * (top + s * grid)[:, None] / top / _LEVELS, 1.0) for s in (1.0, -1.0)]
    ends = [part - 0.5 * np.minimum(1.0 / np.array(_LEVELS), 1.0) for part in ends]
    wide, shift = ends[0] + ends[1], ends[0] - ends[1]
    rest = np.minimum(grid[_POINTS:, None] / top / _LEVELS, 1.0) - shift[_POINTS:]
    weight = np.concatenate([slope, slope[_POINTS:]])[:, None]
    rows = np.vstack([wide, rest]) * weight
    wanted = np.concatenate([width, start - middle[_POINTS:]]) * weight[:, 0]
    limits = _not_negative(rows, wanted)
    return limits.tolist(), middle - shift @ limits


def _not_negative(rows: Floats, wanted: Floats) -> Floats:
    """Return the least squares solution without negative numbers, by coordinate descent."""
    normal, right = rows.T @ rows, rows.T @ wanted
    found = np.zeros(rows.shape[1])
    for _ in range(_SWEEPS):
        for k in range(found.size):
            found[k] = max(found[k] + (right[k] - normal[k] @ found) / normal[k, k], 0.0)
    return found


def _curve(density: Floats, field: Floats) -> list[tuple[float, float]]:
    """Return corners of a broken line: their density follows the root of the curvature."""
    coarse = slice(None, None, 4)
    h, b = field[coarse], density[coarse]
    bend = np.abs(np.gradient(np.gradient(b, h), h))
    sums = np.concatenate([[0.0], np.cumsum(np.sqrt(0.5 * (bend[1:] + bend[:-1])) * np.diff(h))])
    fields = np.interp(np.linspace(0.0, sums[-1], _PIECES + 1), sums, h)
    return list(zip(fields.tolist(), np.interp(fields, h, b).tolist(), strict=True))


def _beyond(material: Material, last: tuple[float, float], tip: float) -> list[tuple[float, float]]:
    """Return points beyond the tip, where the loop has closed."""
    field, density = last
    points, m = [], np.array([float(density / _MU0 - tip)])
    for k in range(_BEYOND):
        fields = np.linspace(2.0**k * tip, 2.0 ** (k + 1) * tip, 100)
        m = material.path(fields, float(m[-1]))
        points.append((field + fields[-1] - tip, float(_MU0 * (fields[-1] + m[-1]))))
    return points


def _apart(field: Floats, density: Floats, fields: Floats, densities: Floats) -> float:
    """Return the largest difference of two curves in density [T], at the fields of one."""
    return float(np.abs(np.interp(field, fields, densities) - density).max())
