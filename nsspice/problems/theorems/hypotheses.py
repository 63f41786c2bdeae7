"""Hypotheses that theorems share: Lipschitz constants, monotonicity, growth.

Derivatives between ``low`` and ``high`` over a convex set bound every difference of the function on
it by a matrix between them (the mean value theorem), so that a property of all those matrices is
one of the function.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from ..csc import Floats
from ..intervals import INF, Interval, bounds
from ..matrices import is_definite, is_p_matrix
from ..settled import monotone_exactly, p_exactly
from ..verdict import Verdict, Witness
from .standard import StandardDVI

_PARTS = 600  # parts of a box that are looked at
_VERTICES = 8  # rows up to which the vertices of an interval matrix are looked at


def lipschitz(problem: StandardDVI, function: str, by: str, claim: str) -> Verdict:
    """Judge whether f or g is Lipschitz continuous in ``x``, ``u`` or ``t``: bounded derivatives.

    Returns
    -------
    Verdict
        The value of its witness is a Lipschitz constant in the Euclidean norm.
    """
    low, high = problem.block(function, by)
    size = np.maximum(np.abs(low), np.abs(high))
    if gap := problem.gap(function):
        return Verdict.undecided(claim, gap)
    if not np.all(np.isfinite(size)):
        i, j = (int(k) for k in np.argwhere(~np.isfinite(size))[0])
        owner = problem.state(i) if function == "f" else problem.name(i)
        what = {"x": problem.state, "u": problem.name}.get(by, lambda _: "t")(j)
        return Verdict.undecided(
            claim, f"no bound of the derivative of the equation of {owner} by {what} is known"
        )
    constant = float(np.linalg.norm(size, 2)) if size.size else 0.0
    text = f"derivatives are bounded, constant {constant:.6g}"
    return Verdict.yes(claim, text, Witness(text, value=constant))


def monotone(low: Floats, high: Floats, claim: str, *, strongly: bool = False) -> Verdict:
    """Judge whether ``x . Mx >= 0`` for every matrix M between two, by the symmetric parts.

    With the middle matrix C and the radius R the least eigenvalue of every symmetric part is at
    least that of C less the spectral radius of R (J. Rohn, *Positive definiteness and stability of
    interval matrices*, SIAM J. Matrix Anal. Appl. 15, 1994).
    """
    diagonal = np.diag(high)
    for k, entry in enumerate(diagonal):
        if entry < 0.0 or (strongly and entry == 0.0 and np.diag(low)[k] == 0.0):
            x = np.eye(len(diagonal))[k]
            text = f"x . Mx <= {entry:.6g} for x = e_{k}"
            reason = "a diagonal derivative is not positive"
            return Verdict.no(claim, reason, Witness(text, (k,), x, float(entry)))
    if np.array_equal(low, high):
        found = is_definite(low) if strongly else monotone_exactly(low)
        return found.named(claim)
    # entries whose bounds are infinite on the diagonal only add; elsewhere nothing is known
    both_low, both_high = 0.5 * (low + low.T), 0.5 * (high + high.T)
    cut = both_high.copy()
    for k in range(len(cut)):
        cut[k, k] = both_low[k, k]  # the least diagonal is the worst
    if not np.all(np.isfinite(cut)) or not np.all(np.isfinite(both_low)):
        return Verdict.undecided(claim, "derivatives are not bounded")
    middle, radius = 0.5 * (both_low + cut), 0.5 * (cut - both_low)
    value = float(np.linalg.eigvalsh(middle)[0]) - float(np.linalg.norm(radius, 2))
    scale = float(np.max(np.abs(middle), initial=0.0) + np.max(radius, initial=0.0))
    slack = 8.0 * len(middle) * 2.0**-53 * scale
    if value > slack or (not strongly and value >= -slack):
        text = f"least eigenvalue of all symmetric parts: {value:.6g}"
        return Verdict.yes(claim, text, Witness(text, value=value))
    return Verdict.undecided(claim, f"bounds of the derivatives leave a form as low as {value:.6g}")


def uniformly_p(low: Floats, high: Floats, claim: str) -> Verdict:
    """Judge whether every matrix between two is P, by the vertices that decide it.

    All of them are if ``C - diag(y) R diag(y)`` is for every vector y of signs (S. Bialas,
    J. Garloff, *Intervals of P-matrices and related matrices*, Linear Algebra Appl. 58, 1984).
    """
    if not np.all(np.isfinite(low)):
        return Verdict.undecided(claim, "derivatives are not bounded from below")
    if np.array_equal(low, high):
        return p_exactly(low).named(claim)
    cut = high.copy()
    for k in range(len(cut)):
        cut[k, k] = low[k, k]
    if not np.all(np.isfinite(cut)):
        return Verdict.undecided(claim, "derivatives are not bounded")
    m = len(low)
    if m > _VERTICES:
        return Verdict.undecided(claim, f"more than {_VERTICES} components")
    middle, radius = 0.5 * (low + cut), 0.5 * (cut - low)
    for signs in itertools.product((1.0, -1.0), repeat=m - 1):
        y = np.array([1.0, *signs])
        found = is_p_matrix(middle - y[:, None] * radius * y)
        if not found:
            if found.holds is None:
                return found.named(claim)
            return Verdict.undecided(
                claim, f"a matrix within the bounds of the derivatives is not P ({found.witness})"
            )
    return Verdict.yes(claim, "all vertices of the derivatives' bounds are P-matrices")


def uniformly_p_in_u(problem: StandardDVI) -> Verdict:
    """Judge whether g is a uniform P-function of u, K being a product of intervals."""
    claim = "g is a uniform P-function of u"
    if gap := problem.gap("g"):
        return Verdict.undecided(claim, gap)
    if not all(part.interval for part in problem.sets):
        return Verdict.undecided(
            claim, "K is not a product of intervals, the only case that is judged"
        )
    return _on_set(problem, uniformly_p(*problem.block("g", "u"), claim))


def closed(problem: StandardDVI) -> Verdict:
    """Judge whether K is closed, convex and not empty."""
    claim = "K is closed, convex and not empty"
    for part in problem.sets:
        name = problem.name(part.index[0])
        if part.empty:
            return Verdict.no(claim, f"the set of {name} is empty")
        if part.empty is None:
            return Verdict.undecided(claim, f"the set of {name} may be empty")
    return Verdict.yes(claim, "a product of intervals, polyhedra and cones")


def affine_in_u(problem: StandardDVI) -> Verdict:
    """Judge whether ``f = f_0(t, x) + B u`` with a constant B."""
    claim = "f is f(t, x) + B u"
    if problem.fixed("f", "u") is not None:
        return Verdict.yes(claim, "the derivatives of f by u are constant")
    return Verdict.undecided(claim, "the derivatives of f by u vary")


def separated(problem: StandardDVI) -> Verdict:
    """Judge whether ``g = h(t, x) + g(u)``: derivatives by x free of u, and by u free of x.

    Constant ones are; others are not decided here.
    """
    claim = "the inequality is h(t, x) + g(u)"
    if problem.fixed("g", "x") is not None or problem.fixed("g", "u") is not None:
        return Verdict.yes(claim, "its derivatives by x, or by u, are constant")
    return Verdict.undecided(claim, "its derivatives by x and by u both vary")


def linear_growth(problem: StandardDVI, claim: str) -> Verdict:
    """Judge whether ``|f| <= a (|x| + 1)`` for all u that solve the inequality.

    It is if f is Lipschitz in x and bounded in the other arguments, which a compact K gives, or if
    u itself grows linearly with x: where g is strongly monotone in u.
    """
    first = lipschitz(problem, "f", "x", claim)
    if not first:
        return first
    if not _tame(problem):
        return Verdict.undecided(claim, "f at a fixed state is not known to be bounded in time")
    if problem.compact:
        second = lipschitz(problem, "f", "u", claim)
        if second or _bounded_values(problem):
            return Verdict.yes(claim, "f is Lipschitz in x, and K compact")
        return second
    strong = strong_in_u(problem)
    if strong and lipschitz(problem, "g", "x", claim) and lipschitz(problem, "f", "u", claim):
        return Verdict.yes(claim, "u(t, x) is Lipschitz in x, and f in x and u")
    return Verdict.undecided(
        claim,
        f"K is not compact and u need not grow linearly with x ({strong.reason})",
        strong.witness,
    )


def _tame(problem: StandardDVI) -> bool:
    """Return whether f depends on the time only by terms of bounded rate."""
    low, high = problem.block("f", "t")
    return bool(np.all(np.isfinite(low)) and np.all(np.isfinite(high)))


def _bounded_values(problem: StandardDVI) -> bool:
    return bool(np.all(np.isfinite(problem.bounds_f.values)))


def strong_in_u(problem: StandardDVI) -> Verdict:
    """Judge whether g is strongly monotone in u, uniformly in t and x."""
    return _by_parts(problem, "g is strongly monotone in u", strongly=True)


def monotone_in_u(problem: StandardDVI) -> Verdict:
    """Judge whether g is monotone in u."""
    return _by_parts(problem, "g is monotone in u", strongly=False)


def _by_parts(problem: StandardDVI, claim: str, *, strongly: bool) -> Verdict:
    """Judge monotonicity of g in u, where necessary on parts of the box one by one.

    A form that is positive on each part is so on all: an integral along a line adds up.
    """
    if gap := problem.gap("g"):
        return Verdict.undecided(claim, gap)
    whole = _on_set(problem, monotone(*problem.block("g", "u"), claim, strongly=strongly))
    if whole.holds is not None:
        return whole
    n, m = problem.n, problem.m
    waiting, least, tried = [problem.box], INF, 0
    while waiting and tried < _PARTS:
        box = waiting.pop()
        tried += 1
        found = bounds(problem.g, box, problem.time)
        inner = _on_set(
            problem,
            monotone(found.low[:, n : n + m], found.high[:, n : n + m], claim, strongly=strongly),
        )
        if inner.holds is None:
            at = _at_middle(problem, box, claim, strongly)
            if at is not None:
                return at
            halves = _split(box)
            if halves is None:
                return whole
            waiting += halves
        elif not inner:
            return inner
        elif inner.witness is not None and inner.witness.value is not None:
            least = min(least, inner.witness.value)
    if waiting:
        return whole
    text = f"least eigenvalue of all symmetric parts, on {tried} parts of the box: {least:.6g}"
    return Verdict.yes(claim, text, Witness(text, value=least))


def _on_set(problem: StandardDVI, found: Verdict) -> Verdict:
    """Return a verdict on all directions as one on K, which may lie in a plane."""
    flat = any(
        not part.interval or any(a == b for a, b in zip(part.low, part.high, strict=True))
        for part in problem.sets
    )
    if found.holds is not False or not flat:
        return found
    return Verdict.undecided(found.claim, f"{found.reason}; K may lie in a plane", found.witness)


def _at_middle(
    problem: StandardDVI, box: list[Interval], claim: str, strongly: bool
) -> Verdict | None:
    """Return that the form is negative at the middle of a box in K, None if it is not."""
    if not all(part.interval and part.low != part.high for part in problem.sets):
        return None  # the box around K is larger than K
    n, m = problem.n, problem.m
    point = [_middle(a, b) for a, b in box]
    found = bounds(problem.g, [(x, x) for x in point], problem.time)
    low, high = found.low[:, n : n + m], found.high[:, n : n + m]
    if not np.array_equal(low, high) or not np.all(np.isfinite(low)):
        return None
    inner = monotone(low, high, claim, strongly=strongly)
    if inner.holds is not False or inner.witness is None:
        return None
    where = ", ".join(f"{x:.6g}" for x in point)
    return Verdict.no(claim, f"{inner.reason}, at the point ({where})", inner.witness)


def _middle(a: float, b: float) -> float:
    if math.isinf(a) or math.isinf(b):
        return math.tan(0.5 * (math.atan(a) + math.atan(b)))
    return 0.5 * (a + b)


def _split(box: list[Interval]) -> list[list[Interval]] | None:
    """Return the two halves of a box across its widest side that matters, None at rounding."""
    sides = [math.atan(b) - math.atan(a) for a, b in box]
    k = int(np.argmax(sides))
    a, b = box[k]
    middle = _middle(a, b)
    if not a < middle < b:
        return None
    return [[*box[:k], (a, middle), *box[k + 1 :]], [*box[:k], (middle, b), *box[k + 1 :]]]
