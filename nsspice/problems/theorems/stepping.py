"""Theorem 3.3.1: each step of the scheme (3.8) has one solution."""

from __future__ import annotations

import numpy as np

from ..matrices import is_definite, is_monotone
from ..verdict import Verdict
from .hypotheses import affine_in_u, lipschitz, monotone_in_u
from .standard import StandardDVI


def theorem_3_3_1(problem: StandardDVI) -> Verdict:
    """Judge Theorem 3.3.1 for small steps: unique solvability of (3.8), not its convergence.

    Hypotheses: K a closed convex cone; (A) f, B, g and h Lipschitz (h is missing in the print);
    (B) B bounded; (C) ``dh/dx B`` positive definite; (D), (F) ``g = E' Psi E`` with Psi strongly
    monotone on the range of E, which a symmetric positive semidefinite constant derivative is.
    """
    cone = Verdict.yes("K is a cone", "a product of half lines and lines")
    if not all(part.cone for part in problem.sets):
        k = next(p.index[0] for p in problem.sets if not p.cone)
        cone = Verdict.no("K is a cone", f"the set of {problem.name(k)} is not")
    C, B = problem.fixed("g", "x"), problem.fixed("f", "u")
    strong = Verdict.undecided("(dh/dx) B is positive definite", "it varies")
    if C is not None and B is not None:
        strong = is_definite(C @ B).named("(dh/dx) B is positive definite")
    D = problem.fixed("g", "u")
    form = Verdict.undecided("g is E' Psi E", "the derivatives of g by u vary")
    if D is not None:
        if np.array_equal(D, D.T):
            form = is_monotone(D).named("g is E' Psi E")
        else:
            inner = is_definite(D)
            form = (
                inner.named("g is E' Psi E")
                if inner
                else Verdict.undecided("g is E' Psi E", "D is not symmetric")
            )
    return Verdict.theorem(
        "Theorem 3.3.1 applies",
        "Theorem 3.3.1: each small step of (3.8) has one solution",
        {
            "K": cone,
            "(A) f": lipschitz(problem, "f", "x", "f is Lipschitz in x"),
            "(A) f in t": lipschitz(problem, "f", "t", "f is Lipschitz in t"),
            "(A) h": lipschitz(problem, "g", "x", "h is Lipschitz in x"),
            "(A) h in t": lipschitz(problem, "g", "t", "h is Lipschitz in t"),
            "(B)": affine_in_u(problem),
            "(C)": strong,
            "(D)": form,
            "monotone": monotone_in_u(problem),
        },
    )
