"""What is known of a problem before it is solved: theorems and matrix classes as verdicts."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...problems import exact
from ...problems import matrices as classes
from ...problems.settled import monotone_exactly, p_exactly
from ...problems.theorems import (
    corollary_2_2_1,
    theorem_2_2_1,
    theorem_2_2_2,
    theorem_2_2_3,
    theorem_2_2_4,
    theorem_2_2_9,
    theorem_2_3_1,
    theorem_2_3_2,
    theorem_2_3_3,
    theorem_3_3_1,
)
from ...problems.theorems import hypotheses as h
from ...problems.theorems.inclusions import existence, one_sided_lipschitz, uniqueness
from ...problems.uniqueness import uniqueness as uniqueness_of
from ...problems.verdict import Verdict
from .standard import standard_form, static_form

if TYPE_CHECKING:
    from ...problems.theorems import StandardDVI
    from .dvi import DVI
    from .lcp import LCP
    from .vi import VI


class Verdicts(dict[str, Verdict]):
    """Verdicts by the name of the theorem or property.

    Examples
    --------
    >>> from nsspice.dvi import LCP
    >>> found = LCP([[1.0, 2.0], [2.0, 1.0]], [-1.0, -1.0]).verdict()
    >>> found["P"].holds, found["copositive"].holds, str(found["P"].witness)
    (False, True, 'the minor of rows 0, 1 is -3')
    """

    def __str__(self) -> str:
        return "\n".join(f"{name}: {found}" for name, found in self.items())

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        return {name: found.to_dict() for name, found in self.items()}


def of_lcp(problem: LCP) -> Verdicts:
    """Return the classes of the matrix of an LCP, and what they say of its solutions."""
    M = problem.M
    found = Verdicts(
        {
            "P": p_exactly(M),
            "P0": p_exactly(M, zero=True),
            "H": classes.is_h_matrix(M),
            "M": classes.is_m_matrix(M),
            "monotone": monotone_exactly(M),
            "strongly monotone": classes.is_definite(M),
            "copositive": classes.is_copositive(M),
            "strictly copositive": classes.is_copositive(M, strict=True),
        }
    )
    found["existence"] = _lcp_existence(problem, found)
    found["uniqueness"] = (
        Verdict.yes("one solution for every q", "M is a P-matrix")
        if found["P"]
        else found["P"].named("one solution for every q")
    )
    return found


def _lcp_existence(problem: LCP, found: Verdicts) -> Verdict:
    """Judge whether an LCP has a solution; M and q are taken literally, without rounding."""
    claim = "a solution exists"
    for name, why in (
        ("P", "M is a P-matrix"),
        ("strictly copositive", "M is strictly copositive"),
    ):
        if found[name]:
            return Verdict.yes(claim, why)
    M, q = problem.M, problem.q.tolist()
    if all(x >= 0.0 for x in q):
        return Verdict.yes(claim, "u = 0, since q >= 0")
    m = len(q)
    small = m * m <= exact.MOST
    if small:
        if not exact.feasible(-M, q, nonnegative=True):
            return Verdict.no(claim, "no u >= 0 has M u + q >= 0")
        if found["monotone"]:
            return Verdict.yes(claim, "M is monotone and the problem feasible")
    for on in _modes(problem):
        if small and exact.solves(M, q, on):
            return Verdict.yes(claim, f"with u > 0 in {len(on)} components, in exact arithmetic")
    if m <= exact.SUBSETS:
        return Verdict.no(claim, "none in any of the modes")
    return Verdict.undecided(claim, "M is in no class that decides")


def _modes(problem: LCP) -> Iterator[list[int]]:
    """Yield sets of components that may be positive: of what the solver finds, then all if few."""
    from ...errors import NumericalError

    m = problem.q.size
    try:
        u = problem.solve()[problem.unknowns]
        yield np.flatnonzero(u > 2.0**-40 * np.max(np.abs(u))).tolist()
    except NumericalError:
        pass
    if m <= exact.SUBSETS:
        for on in itertools.product((False, True), repeat=m):
            yield np.flatnonzero(on).tolist()


def of_vi(problem: VI) -> Verdicts:
    """Return what is known of a static problem for every value of the time."""
    standard = static_form(problem)
    first, third = theorem_2_2_1(standard), theorem_2_2_3(standard)
    uniform = h.uniformly_p_in_u(standard)
    monotone, strong = h.monotone_in_u(standard), h.strong_in_u(standard)
    found = Verdicts(
        {
            "monotone": monotone.named("g is monotone"),
            "strongly monotone": strong.named("g is strongly monotone"),
            "uniform P": uniform,
            "Theorem 2.2.1": first,
            "Theorem 2.2.3": third,
        }
    )
    found["existence"] = _vi_existence(standard, strong, found["uniform P"])
    found["uniqueness"] = _vi_uniqueness(problem, standard, strong, found["uniform P"])
    return found


def _vi_existence(standard: StandardDVI, strong: Verdict, uniform: Verdict) -> Verdict:
    claim = "a solution exists"
    closed = h.closed(standard)
    if not closed:
        return closed.named(claim)
    if gap := standard.gap("g"):
        return Verdict.undecided(claim, gap)
    if strong or uniform:
        return Verdict.yes(claim, (strong or uniform).reason)
    if standard.compact:
        return Verdict.yes(claim, "K is compact and g continuous")
    return Verdict.undecided(claim, f"{standard.loose}; {strong.reason}")


def _vi_uniqueness(
    problem: VI, standard: StandardDVI, strong: Verdict, uniform: Verdict
) -> Verdict:
    claim = "there is at most one solution"
    if strong or uniform:
        return Verdict.yes(claim, (strong or uniform).reason)
    # slopes that only tend to zero: modes and mean slopes decide (Gale and Nikaido)
    other = uniqueness_of(problem.assembly.system)
    return Verdict(claim, True if other.unique else None, other.reason)


def of_dvi(problem: DVI, region: Mapping[str, tuple[float, float]] | None = None) -> Verdicts:
    """Return what the theorems of chapters 2 and 3 say of a DVI."""
    s = standard_form(problem, region)
    return Verdicts(
        {
            "existence": existence(s),
            "uniqueness": uniqueness(s),
            "Theorem 2.2.1": theorem_2_2_1(s),
            "Theorem 2.2.2": theorem_2_2_2(s),
            "Theorem 2.2.3": theorem_2_2_3(s),
            "Corollary 2.2.1": corollary_2_2_1(s),
            "Theorem 2.2.4": theorem_2_2_4(s),
            "Theorem 2.2.9": theorem_2_2_9(s),
            "Theorem 2.3.1": theorem_2_3_1(s),
            "Theorem 2.3.2": theorem_2_3_2(s),
            "Theorem 2.3.2, uniqueness": theorem_2_3_2(s, unique=True),
            "Theorem 2.3.3": theorem_2_3_3(s),
            "Theorem 3.3.1": theorem_3_3_1(s),
            "linear growth": h.linear_growth(s, "linear growth (2.21)"),
            "one-sided Lipschitz": one_sided_lipschitz(s),
        }
    )
