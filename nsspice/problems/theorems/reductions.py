"""Theorems on the reduction to ordinary differential equations: section 2.2 of the thesis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..intervals import bounds
from ..matrices import is_definite
from ..verdict import Verdict, Witness
from .hypotheses import (
    affine_in_u,
    closed,
    lipschitz,
    monotone_in_u,
    separated,
    strong_in_u,
    uniformly_p_in_u,
)
from .standard import StandardDVI


def theorem_2_2_1(problem: StandardDVI) -> Verdict:
    """Judge Theorem 2.2.1: the solution u(y) of the inequality is single-valued and Lipschitz.

    Hypotheses: K closed and convex, g continuous (i), Lipschitz in y = (t, x) uniformly in u (ii),
    strongly monotone in u (iii).

    Returns
    -------
    Verdict
        Where it holds the value of its witness is the constant L / mu.

    Examples
    --------
    >>> from nsspice.problems import TapeBuilder
    >>> from nsspice.problems.theorems import ConvexSet, StandardDVI
    >>> f, g = TapeBuilder(), TapeBuilder()
    >>> _ = f.output(f.unknown(1))
    >>> _ = g.output(g.op("add", g.op("mul", g.constant(2.0), g.unknown(1)), g.unknown(0)))
    >>> half = ConvexSet.box(0, 0.0, float("inf"))
    >>> theorem_2_2_1(StandardDVI(1, 1, f.finish(), g.finish(), (half,))).witness.value
    0.5
    """
    by_x = lipschitz(problem, "g", "x", "g is Lipschitz in x")
    strong = strong_in_u(problem)
    found = Verdict.theorem(
        "Theorem 2.2.1 applies",
        "Theorem 2.2.1: u(t, x) is unique and Lipschitz, g being strongly monotone in u",
        {
            "K": closed(problem),
            "(i)": _continuous(problem),
            "(ii)": by_x,
            "(ii) in t": lipschitz(problem, "g", "t", "g is Lipschitz in t"),
            "(iii)": strong,
        },
    )
    if found and by_x.witness is not None and strong.witness is not None:
        L, mu = by_x.witness.value or 0.0, strong.witness.value or np.inf
        text = f"Lipschitz constant in x: {L / mu:.6g}"
        return Verdict(found.claim, True, found.reason, Witness(text, value=L / mu),
                       found.hypotheses)  # fmt: skip
    return found


def theorem_2_2_2(problem: StandardDVI) -> Verdict:
    """Judge global unique existence: u(t, x) by 2.2.1 or 2.2.3, and f Lipschitz in x and u."""
    unique = theorem_2_2_1(problem)
    if not unique:
        other = theorem_2_2_3(problem)
        unique = other if other else unique
    problem = _narrowed(problem, unique)
    return Verdict.theorem(
        "Theorem 2.2.2 applies",
        "Theorem 2.2.2: one trajectory exists for all times, as u(t, x) is Lipschitz",
        {
            "u(t, x)": unique,
            "f in x": lipschitz(problem, "f", "x", "f is Lipschitz in x"),
            "f in u": lipschitz(problem, "f", "u", "f is Lipschitz in u"),
        },
    )


def theorem_2_2_3(problem: StandardDVI) -> Verdict:
    """Judge Theorem 2.2.3: as 2.2.1 for a product K and a uniform P-function g (A)."""
    product = Verdict.yes("K is a product", "of intervals")
    if not all(part.interval for part in problem.sets):
        product = Verdict.undecided("K is a product", "not of intervals, for which (A) is judged")
    return Verdict.theorem(
        "Theorem 2.2.3 applies",
        "Theorem 2.2.3: u(t, x) is unique and Lipschitz, g being a uniform P-function",
        {
            "K": product,
            "continuous": _continuous(problem),
            "(A)": uniformly_p_in_u(problem),
            "(B)": lipschitz(problem, "g", "x", "g is Lipschitz in x"),
            "(B) in t": lipschitz(problem, "g", "t", "g is Lipschitz in t"),
        },
    )


def corollary_2_2_1(problem: StandardDVI) -> Verdict:
    """Judge Corollary 2.2.1: ``x' = f(x) + B u``, g = C x + D u with D positive definite."""
    D = problem.fixed("g", "u")
    affine = Verdict.undecided("g is C x + D u", "its derivatives vary")
    definite = Verdict.undecided("D is positive definite", "g is not affine")
    if D is not None and problem.fixed("g", "x") is not None:
        affine = Verdict.yes("g is C x + D u", "constant derivatives")
        definite = is_definite(D).named("the symmetric part of D is positive definite")
    polyhedral = Verdict.yes("K is polyhedral", "a polyhedron")
    if not all(part.polyhedral for part in problem.sets):
        polyhedral = Verdict.no("K is polyhedral", "a second-order cone is curved")
    return Verdict.theorem(
        "Corollary 2.2.1 applies",
        "Corollary 2.2.1: one C1 trajectory exists for every start, D being positive definite",
        {
            "f": affine_in_u(problem),
            "f Lipschitz": lipschitz(problem, "f", "x", "f is Lipschitz"),
            "K": polyhedral,
            "g": affine,
            "D": definite,
            "autonomous": _autonomous(problem),
        },
    )


def theorem_2_2_4(problem: StandardDVI) -> Verdict:
    """Judge Theorem 2.2.4: uniqueness where grad l(x) B(x) is symmetric positive definite.

    Its fifth hypothesis, that all solutions have bounded u, is met for a compact K only.
    """
    C, B = problem.fixed("g", "x"), problem.fixed("f", "u")
    symmetric = Verdict.undecided("grad l B is symmetric positive definite", "it varies")
    if C is not None and B is not None:
        product = C @ B
        claim = "grad l B is symmetric positive definite"
        odd = np.abs(product - product.T)
        rounding = 4.0 * len(product) * 2.0**-53 * (np.abs(C) @ np.abs(B))
        if np.any(odd > rounding + rounding.T):
            i, j = (int(k) for k in np.unravel_index(int(np.argmax(odd)), odd.shape))
            text = f"entries {i},{j} and {j},{i} are {product[i, j]:.6g} and {product[j, i]:.6g}"
            symmetric = Verdict.no(claim, "it is not symmetric", Witness(text, (i, j)))
        else:
            symmetric = is_definite(product).named(claim)
    bounded = Verdict.yes("u is bounded", "K is compact")
    if not problem.compact:
        bounded = Verdict.undecided("all solutions have bounded u", "K is not compact")
    return Verdict.theorem(
        "Theorem 2.2.4 applies",
        "Theorem 2.2.4: there is at most one solution",
        {
            "1": closed(problem),
            "2": lipschitz(problem, "f", "x", "f is locally Lipschitz"),
            "form": affine_in_u(problem),
            "inequality": separated(problem),
            "3": monotone_in_u(problem),
            "4": symmetric,
            "5": bounded,
        },
    )


def theorem_2_2_9(problem: StandardDVI) -> Verdict:
    """Judge Theorem 2.2.9: existence for compact K, monotone g(u), Lipschitz f, h, bounded B."""
    compact = Verdict.yes("K is compact", "a bounded set")
    if not problem.compact:
        compact = Verdict.no("K is compact", problem.loose)
    return Verdict.theorem(
        "Theorem 2.2.9 applies",
        "Theorem 2.2.9: a solution exists, K being compact and g monotone",
        {
            "K": compact,
            "f": lipschitz(problem, "f", "x", "f is Lipschitz in x"),
            "f in t": lipschitz(problem, "f", "t", "f is Lipschitz in t"),
            "h": lipschitz(problem, "g", "x", "h is Lipschitz in x"),
            "h in t": lipschitz(problem, "g", "t", "h is Lipschitz in t"),
            "B": affine_in_u(problem),
            "form": separated(problem),
            "g": monotone_in_u(problem),
        },
    )


def _narrowed(problem: StandardDVI, unique: Verdict) -> StandardDVI:
    """Return the problem with bounds of u that follow from strong monotonicity.

    With 0 in K and modulus mu, ``mu |u|^2 <= <g(u) - g(0), u> <= <-g(0), u>``, so that
    ``|u| <= |g(t, x, 0)| / mu``: finite on a bounded region.
    """
    strong = strong_in_u(problem)
    if not (unique and strong and strong.witness is not None and strong.witness.value):
        return problem
    if not all(s.low[k] <= 0.0 <= s.high[k] for s in problem.sets for k in range(len(s.index))):
        return problem
    still = [*problem.box[: problem.n], *[(0.0, 0.0)] * problem.m]
    values = np.abs(bounds(problem.g, still, problem.time).values)
    size = float(np.linalg.norm(values.max(axis=1, initial=0.0))) / strong.witness.value
    if not np.isfinite(size):
        return problem
    sets = tuple(
        replace(
            s,
            low=tuple(max(low, -size) for low in s.low),
            high=tuple(min(high, size) for high in s.high),
        )
        for s in problem.sets
    )
    return replace(problem, sets=sets)


def _continuous(problem: StandardDVI) -> Verdict:
    claim = "g is continuous"
    if gap := problem.gap("g"):
        return Verdict.undecided(claim, gap)
    return Verdict.yes(claim, "no pole and no jump for all t, x and u in K")


def _autonomous(problem: StandardDVI) -> Verdict:
    claim = "the problem is autonomous"
    if problem.autonomous:
        return Verdict.yes(claim, "the time does not appear")
    return Verdict.no(claim, "the time appears; Theorem 2.2.2 admits it")
