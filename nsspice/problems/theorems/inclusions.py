r"""Theorems on differential inclusions ``x' in F(t, x)``: section 2.3 of the thesis.

F(t, x) is the set of all f(t, x, u) with u in SOL(K, g(t, x, .)).
"""

from __future__ import annotations

import numpy as np

from ..csc import Floats
from ..matrices import is_definite
from ..verdict import Verdict, Witness
from .hypotheses import affine_in_u, linear_growth, lipschitz, monotone, monotone_in_u, separated
from .reductions import theorem_2_2_2, theorem_2_2_4
from .standard import StandardDVI


def convex_values(problem: StandardDVI) -> Verdict:
    """Judge whether F(t, x) is non-empty, bounded, closed and convex.

    So it is for compact K, g monotone in u (SOL is then non-empty, convex and compact), and f
    affine in u.
    """
    claim = "F(t, x) is non-empty, compact and convex"
    if not problem.compact:
        return Verdict.undecided(claim, f"{problem.loose}: SOL may be empty or unbounded")
    for function in "fg":
        if gap := problem.gap(function):
            return Verdict.undecided(claim, gap)
    for part in (monotone_in_u(problem), affine_in_u(problem)):
        if not part:
            return Verdict.undecided(claim, f"{part.claim} is not known: {part.reason}")
    return Verdict.yes(claim, "K is compact, g monotone in u, f affine in u")


def semicontinuous(problem: StandardDVI) -> Verdict:
    """Judge whether F is outer semicontinuous: its graph is closed and its values are bounded."""
    claim = "F is outer semicontinuous"
    inner = convex_values(problem)
    if inner:
        return Verdict.yes(claim, "SOL has a closed graph, and K is compact")
    return Verdict.undecided(claim, inner.reason)


def one_sided_lipschitz(problem: StandardDVI) -> Verdict:
    r"""Judge (2.18): ``<a - b, x - y> <= l |x - y|^2`` for a in F(t, x), b in F(t, y).

    For ``f = f_0(t, x) + B u`` and ``g = h(t, x) + g(u)`` with g monotone, two solutions satisfy
    ``<h(x) - h(y), u - v> <= 0``.  If ``P B = (dh/dx)'`` for a symmetric positive definite P, the
    multipliers are dissipative in the norm of P, and f_0 alone decides.  Where g does not depend on
    u and K is a product of intervals, each component may be scaled by a positive number before.

    Source: V. Acary, B. Brogliato, *Numerical Methods for Nonsmooth Dynamical Systems* (2008),
    section 2.5 (passive linear complementarity systems).
    """
    claim = "F is one-sided Lipschitz"
    smooth = lipschitz(problem, "f", "x", "f is Lipschitz in x")
    if not smooth:
        return Verdict.undecided(claim, smooth.reason)
    for part in (affine_in_u(problem), separated(problem), monotone_in_u(problem)):
        if not part:
            return Verdict.undecided(claim, f"{part.claim}: {part.reason}")
    B, C = problem.fixed("f", "u"), problem.fixed("g", "x")
    if B is None or C is None:
        return Verdict.undecided(claim, "the derivatives of f by u, or of h by x, vary")
    P = _metric(B, C)
    if P is None and (scaled := _scaled(problem, B, C)) is not None:
        P = _metric(scaled, C)
    if P is None:
        return Verdict.undecided(
            claim, "no scalar product is found in which the multipliers are dissipative"
        )
    text = "the multipliers are dissipative in a scalar product, and f is Lipschitz in x"
    return Verdict.yes(claim, text, Witness(text))


def _metric(B: Floats, C: Floats) -> Floats | None:
    """Return a positive definite P with ``P B = C'``, None if none is found.

    With ``C B`` symmetric positive definite on what it does not annihilate,
    ``P = C'(C B)^+ C + Pi' Pi`` is one, where ``Pi = 1 - B (C B)^+ C`` annihilates B.
    """
    n = B.shape[0]
    if B.shape[1] == 0:
        return np.eye(n)
    product = C @ B
    scale = np.abs(C) @ np.abs(B)
    rounding = 8.0 * (n + len(product)) * 2.0**-53 * max(float(np.max(scale, initial=0.0)), 1e-300)
    if np.any(np.abs(product - product.T) > rounding):
        return None
    values, vectors = np.linalg.eigh(0.5 * (product + product.T))
    if values[0] < -rounding:
        return None
    kept = values > rounding
    # the kernel of C B must be that of B and of C': else no P maps one to the other
    loose = vectors[:, ~kept]
    if np.any(np.abs(B @ loose) > rounding) or np.any(np.abs(C.T @ loose) > rounding):
        return None
    inverse = vectors[:, kept] @ np.diag(1.0 / values[kept]) @ vectors[:, kept].T
    Pi = np.eye(n) - B @ inverse @ C
    P = C.T @ inverse @ C + Pi.T @ Pi
    defect = np.abs(P @ B - C.T)
    size = np.abs(P) @ np.abs(B) + np.abs(C.T)
    if np.any(defect > 1e-9 * np.max(size)) or not is_definite(P):
        return None
    return np.asarray(P)


def _scaled(problem: StandardDVI, B: Floats, C: Floats) -> Floats | None:
    """Return B with its columns as long as the rows of C, where components may be scaled."""
    D = problem.fixed("g", "u")
    if D is None or D.any() or not all(part.interval for part in problem.sets):
        return None
    columns, rows = np.linalg.norm(B, axis=0), np.linalg.norm(C, axis=1)
    if np.any((columns == 0.0) != (rows == 0.0)):
        return None
    return np.asarray(B * np.where(columns > 0.0, rows / np.maximum(columns, 1e-300), 1.0))


def theorem_2_3_1(problem: StandardDVI) -> Verdict:
    """Judge Theorem 2.3.1: a local solution exists; with (2.18) it is the only one."""
    return Verdict.theorem(
        "Theorem 2.3.1 applies",
        "Theorem 2.3.1 (Filippov): a solution exists for a short time",
        {"(i)": convex_values(problem), "(ii)": semicontinuous(problem)},
    )


def theorem_2_3_2(problem: StandardDVI, *, unique: bool = False) -> Verdict:
    """Judge Theorem 2.3.2: a solution exists for all times, with (2.18) the only one.

    Parameters
    ----------
    problem : StandardDVI
    unique : bool
        Whether its last part, uniqueness, is asked for.
    """
    hypotheses = {
        "(i)": convex_values(problem),
        "(ii)": semicontinuous(problem),
        "(iii)": linear_growth(problem, "F grows linearly (2.21)"),
    }
    if unique:
        hypotheses["(2.18)"] = one_sided_lipschitz(problem)
    what = "one solution exists" if unique else "a solution exists"
    claim = f"Theorem 2.3.2 applies{' with uniqueness' if unique else ''}"
    return Verdict.theorem(claim, f"Theorem 2.3.2: {what} for all times", hypotheses)


def theorem_2_3_3(problem: StandardDVI) -> Verdict:
    """Judge Theorem 2.3.3: ``x' in -F(x)`` with F maximal monotone and linearly bounded."""
    claim = "F is maximal monotone"
    inner = Verdict.undecided(claim, "the derivatives of f by u, or of h by x, vary")
    B, C = problem.fixed("f", "u"), problem.fixed("g", "x")
    if B is not None and C is not None:
        low, high = problem.block("f", "x")
        rest = monotone(-high, -low, "-f is monotone in x")
        scaled = _scaled(problem, B, C)
        forms = [B] if scaled is None else [B, scaled]
        rounding = 8.0 * 2.0**-53 * max(1e-300, float(np.max(np.abs(C), initial=0.0)))
        if not any(np.all(np.abs(form - C.T) <= rounding) for form in forms):
            inner = Verdict.undecided(claim, "B is not (dh/dx)': another scalar product may do")
        elif not rest:
            inner = Verdict(claim, None, f"-f is not known to be monotone: {rest.reason}")
        else:
            good = monotone_in_u(problem)
            inner = (
                good.named(claim)
                if not good
                else Verdict.yes(claim, "B = (dh/dx)', g and -f are monotone")
            )
    return Verdict.theorem(
        "Theorem 2.3.3 applies",
        "Theorem 2.3.3: exactly one solution exists on [a, inf)",
        {
            "autonomous": _autonomous(problem),
            "F": inner,
            "growth": linear_growth(problem, "F grows linearly"),
        },
    )


def _autonomous(problem: StandardDVI) -> Verdict:
    claim = "the problem is autonomous"
    if problem.autonomous:
        return Verdict.yes(claim, "the time does not appear")
    return Verdict.no(claim, "the time appears; Theorem 2.3.2 admits it")


def existence(problem: StandardDVI) -> Verdict:
    """Return whether a trajectory exists for all times, by the first theorem that says so."""
    return _first(
        f"a trajectory exists {_while(problem)}",
        (theorem_2_2_2(problem), theorem_2_3_2(problem)),
    )


def uniqueness(problem: StandardDVI) -> Verdict:
    """Return whether there is one trajectory, by the first theorem that says so."""
    return _first(
        f"the trajectory is the only one{' ' + _while(problem) if problem.region else ''}",
        (
            theorem_2_2_2(problem),
            theorem_2_3_3(problem),
            theorem_2_3_2(problem, unique=True),
            theorem_2_2_4(problem),
        ),
    )


def _while(problem: StandardDVI) -> str:
    return "while the states stay in the region" if problem.region else "for all times"


def _first(claim: str, theorems: tuple[Verdict, ...]) -> Verdict:
    tried = {found.claim: found for found in theorems}
    for found in theorems:
        if found:
            return Verdict(claim, True, found.reason, found.witness, tried)
    nearest = next((found for found in theorems if found.holds is None), theorems[-1])
    name = nearest.claim.removesuffix(" applies")
    return Verdict(claim, None, f"no theorem applies; {name}: {nearest.reason}", None, tried)
