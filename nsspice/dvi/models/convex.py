r"""Convex functions: their subdifferentials as set-valued expressions, and minimisation.

For a convex f + h with f smooth, ``0 in grad f(u) + dh(u)`` says that u is a minimum.

References: R. T. Rockafellar, *Convex Analysis* (1970); P. Tseng, *Convergence of a block
coordinate descent method for nondifferentiable minimization*, J. Optim. Theory Appl. 109 (2001);
T. Roubal (2015), section 3.2.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ...netlist.expressions.derivative import derivative as _derivative
from ...netlist.expressions.node import Node, neg, show
from ..equations.point import Point
from ..equations.static import Static
from ..terms.errors import unsolved, wrong
from ..terms.expression import Expr, as_expr
from ..terms.sets import Cone
from ..terms.setvalued import SetValued, Sgn
from ..terms.splitting import Split

if TYPE_CHECKING:
    from .vi import VI

Floats = npt.NDArray[np.float64]
Map = Callable[[Floats], Floats]

_KINKS = frozenset({"abs", "max", "min", "uramp"})
_SWEEPS = 10_000


def subgradient(phi: Expr, variables: Sequence[Expr]) -> list[Expr]:
    """Return the subdifferential of a convex expression by each variable.

    Parameters
    ----------
    phi : Expr
        A sum of positive multiples of ``abs`` and ``maximum`` of linear forms, and smooth terms.
    variables : sequence of Expr

    Raises
    ------
    UsageError
        NS6005 where a kink is not convex, or not of that form.

    Examples
    --------
    >>> from nsspice.dvi import unknowns
    >>> u = unknowns("u")
    >>> subgradient(3.0 * abs(u) + u**2, [u])
    [Expr(3*sgn(u) + 2*u)]
    """
    out: list[Expr] = [as_expr(0.0) for _ in variables]

    def add(node: Node, weight: float) -> None:
        if node.op == "add":
            for arg in node.args:
                add(arg, weight)
            return
        if node.op == "neg":
            add(node.args[0], -weight)
            return
        if node.op == "mul":
            forms = [Split.of(arg) for arg in node.args]
            fixed = [not f.factors and not f.smooth for f in forms]
            if fixed.count(False) == 1:
                for f, constant in zip(forms, fixed, strict=True):
                    weight *= f.constant if constant else 1.0
                add(node.args[fixed.index(False)], weight)
                return
        if node.op == "call" and node.value in _KINKS:
            kink(str(node.value), node, weight)
            return
        if _has_kink(node):
            raise _not_convex(node)
        for k, u in enumerate(variables):
            slope = Expr(_derivative(node, u.name))
            if not (slope.node.op == "num" and slope.node.value == 0.0):
                out[k] = out[k] + weight * slope

    def kink(name: str, node: Node, weight: float) -> None:
        a = Expr(node.args[0])
        b = as_expr(0.0) if len(node.args) == 1 else Expr(node.args[1])
        if name == "min":  # min(a, b) = -max(-a, -b)
            kink("max", Node("call", (neg(a.node), neg(b.node)), "max"), -weight)
            return
        inner = a if name in ("abs", "uramp") else a - b
        if weight < 0.0 or Split.of(inner.node).smooth:
            raise _not_convex(node)
        sign = Sgn(inner) if name == "abs" else Sgn(inner, 0.0, 1.0)
        for k, u in enumerate(variables):
            slope = Split.of(inner.node).factors.get(u.name, 0.0)
            other = Split.of(b.node).factors.get(u.name, 0.0) if name == "max" else 0.0
            if other:
                out[k] = out[k] + weight * other
            if slope:
                out[k] = out[k] + (weight * slope) * sign

    add(phi.node, 1.0)
    return out


def _has_kink(node: Node) -> bool:
    todo = [node]
    while todo:
        here = todo.pop()
        if here.op == "call" and here.value in _KINKS:
            return True
        todo.extend(here.args)
    return False


def _not_convex(node: Node) -> Exception:
    return wrong(
        "NS6005",
        f"the kink of {show(node)} does not belong to a convex function of a linear form",
        "write phi as a sum of positive multiples of abs and maximum of linear forms",
    )


def minimise(problem: VI, start: dict[str, float]) -> Point:
    """Minimise f + h by descent along the coordinates; see :meth:`nsspice.dvi.VI.minimise`.

    Each coordinate is brought to the minimum along it, where its inclusion holds; for a strictly
    convex smooth part and separable kinks the only point that all of them leave alone is the
    minimum (Tseng 2001, theorem 4.1).
    """
    names = [u.name for u in problem.unknowns]
    low, high = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    for variables, K in problem.sets:
        if not isinstance(K, Cone):
            raise wrong("NS6005", "coordinate descent needs a product of intervals", "")
        for u in variables:
            k = names.index(u.name)
            low[k], high[k] = K.low, K.high
    kinks = separable_kinks(problem, names)
    g, slope = problem.function(), problem.slope()
    x: Floats = np.clip(np.array([start.get(name, 0.0) for name in names]), low, high)
    _check_gradient(slope, x, names)
    for sweep in range(_SWEEPS):
        moved = 0.0
        for k in range(x.size):
            new = _along(g, slope, x, k, kinks[k], float(low[k]), float(high[k]))
            moved = max(moved, abs(new - float(x[k])))
            x[k] = new
        if moved <= 4.0 * 2.0**-52 * float(np.max(np.abs(x), initial=0.0)):
            break
        if sweep % 16 == 0:
            _check_gradient(slope, x, names)
    else:
        raise unsolved(
            f"coordinate descent has not converged (last change {moved:.2g})",
            "use solve()",
        )
    static = Static(problem.assembly)
    minimum = dict(zip(names, map(float, x), strict=True))
    z, lam, _ = static.solve(minimum, 0.0)
    found = static.point(z, lam, 0.0)
    values = {**found.values, **minimum}
    return Point(values, found.multipliers, found.residual, found.judge)


#: kinks of one coordinate: where, and by how much the slope rises from ``low`` to ``high``
Kinks = list[tuple[float, float, float]]


def separable_kinks(problem: VI, names: Sequence[str]) -> list[Kinks]:
    """Return the kinks of each coordinate: set values, each of one unknown in its own row."""
    found: list[Kinks] = [[] for _ in names]
    for k, part in enumerate(problem.g):
        split = Split.of(part.node)
        atoms: dict[str, SetValued] = dict(part.atoms)
        for name, atom in atoms.items():
            inner = Split.of(atom.argument.node)
            weight = split.factors.get(name, 0.0)
            slope = inner.factors.get(names[k], 0.0)
            if inner.smooth or set(inner.factors) != {names[k]} or weight * slope <= 0.0:
                raise wrong(
                    "NS6005",
                    f"{name} in component {k} is not a kink of a convex function of {names[k]} "
                    f"alone",
                    "use solve()",
                )
            ends = sorted((weight * atom.low, weight * atom.high))
            found[k].append((-inner.constant / slope, ends[0], ends[1]))
    return found


def _along(g: Map, slope: Map, u: Floats, k: int, kinks: Kinks, low: float, high: float) -> float:
    """Return the minimum along one coordinate: a monotone inclusion of one unknown."""

    def value(x: float, side: float) -> float:
        v = u.copy()
        v[k] = x
        total = float(g(v)[k])
        for at, below, above in kinks:
            beyond = x > at or (x == at and side > 0.0)
            total += above if beyond else below
        return total

    # candidates where the slope jumps: ends of the interval and kinks
    for x in sorted({at for at, _, _ in kinks if low < at < high} | _finite(low, high)):
        left = -np.inf if x == low else value(x, -1.0)
        right = np.inf if x == high else value(x, 1.0)
        if left <= 0.0 <= right:
            return float(x)
    places = sorted(at for at, _, _ in kinks)
    x = float(u[k])
    a, b = low, high
    for at in places:  # the interval between kinks in which the slope vanishes
        if value(at, 1.0) < 0.0:
            a = max(a, at)
        elif value(at, -1.0) > 0.0:
            b = min(b, at)
    for _ in range(200):
        v = u.copy()
        v[k] = x = min(max(x, np.nextafter(a, np.inf)), np.nextafter(b, -np.inf))
        now, rise = value(x, 0.0), float(slope(v)[k, k])
        if now > 0.0:
            b = min(b, x)
        else:
            a = max(a, x)
        step = now / rise if rise > 0.0 else np.inf
        new = x - step
        if not a < new < b:
            new = 0.5 * (a + b) if np.isfinite(a + b) else x - np.copysign(1.0 + abs(x), now)
        if abs(new - x) <= 2.0**-52 * abs(x) or now == 0.0:
            return float(new if now != 0.0 else x)
        x = new
    return x


def _finite(low: float, high: float) -> set[float]:
    return {x for x in (low, high) if np.isfinite(x)}


def _check_gradient(slope: Map, u: Floats, names: Sequence[str]) -> None:
    J = np.asarray(slope(u))
    size = float(np.max(np.abs(J), initial=0.0))
    odd = np.abs(J - J.T)
    if odd.size and odd.max() > 1e-12 * size:
        i, j = (int(v) for v in np.unravel_index(int(np.argmax(odd)), odd.shape))
        raise wrong(
            "NS6005",
            f"g is not a gradient: its derivatives d{names[i]}/d{names[j]} and "
            f"d{names[j]}/d{names[i]} differ, but a minimum needs them equal",
            "use solve()",
        )
    if float(np.linalg.eigvalsh(0.5 * (J + J.T))[0]) < -1e-12 * size:
        raise wrong(
            "NS6005",
            "the smooth part is not convex: its Hessian has a negative eigenvalue",
            "use solve(); solutions need not be minima",
        )
