"""Conditions that determine multipliers and other unknowns: complementarity, contact, equations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...netlist.expressions.node import show
from ..terms.errors import wrong
from ..terms.expression import Expr, as_vector
from ..terms.sets import Cone, Polyhedron, SecondOrderCone, Set
from .assembly import Model, Pair, Row


@dataclass(frozen=True, slots=True)
class Complementarity:
    """``0 <= u`` orthogonal to ``w >= 0``, component by component."""

    multipliers: tuple[Expr, ...]
    slacks: tuple[Expr, ...]

    def write(self, model: Model) -> None:
        """Add the pairs."""
        for u, w in zip(self.multipliers, self.slacks, strict=True):
            model.pairs.append(Pair(u.name, w, multiplier=True))


def complementarity(u: Any, w: Any) -> Complementarity:
    """Return the condition that multipliers u and expressions w are nonnegative, one of them zero.

    Parameters
    ----------
    u : multiplier or vector of them
    w : Expr or array of Expr, of the same length

    Raises
    ------
    UsageError
        NS6003 if the lengths differ.

    Examples
    --------
    >>> from nsspice.dvi import multiplier, states
    >>> complementarity(multiplier("i"), 5.0 - states("v")).slacks
    (Expr(5 - v),)
    """
    left, right = as_vector(u), as_vector(w)
    if len(left) != len(right):
        raise wrong("NS6003", f"{len(left)} multipliers for {len(right)} expressions", "")
    return Complementarity(tuple(left), tuple(right))


@dataclass(frozen=True, slots=True)
class Contact:
    """A contact force n that acts while a gap is closed, with Newton's law of impacts.

    Parameters
    ----------
    force, gap : Expr
    restitution : float
        e in ``(gap rate after) = -e (gap rate before)``, 0 to 1.
    """

    force: Expr
    gap: Expr
    restitution: float

    def write(self, model: Model) -> None:
        """Add the pair."""
        model.pairs.append(Pair(self.force.name, self.gap, multiplier=True))


def contact(force: Expr, gap: Expr, restitution: float = 0.0) -> Contact:
    """Return the unilateral contact ``0 <= n`` orthogonal to ``gap >= 0``.

    Parameters
    ----------
    force : multiplier
        Contact force n, which enters the rates of speeds.
    gap : Expr
        Distance from the obstacle.
    restitution : float
        Newton's coefficient: 0 inelastic, 1 elastic.

    Raises
    ------
    UsageError
        NS6003 unless ``0 <= restitution <= 1``.

    Source: J. J. Moreau, *Unilateral contact and dry friction in finite freedom dynamics*, in
    Nonsmooth Mechanics and Applications (1988), with one coefficient for a contact.

    Examples
    --------
    >>> from nsspice.dvi import multiplier, states
    >>> contact(multiplier("n"), gap=states("x") - 1.0, restitution=0.8).restitution
    0.8
    """
    if not 0.0 <= restitution <= 1.0:
        raise wrong("NS6003", f"a restitution of {restitution} creates or removes too much energy",
                    "give a number from 0 to 1")  # fmt: skip
    return Contact(force, gap, float(restitution))


@dataclass(frozen=True, slots=True)
class Equation:
    """Algebraic equations ``0 = f``, each with the unknown that it determines."""

    unknowns: tuple[Expr, ...]
    rights: tuple[Expr, ...]

    def write(self, model: Model) -> None:
        """Add the rows."""
        for unknown, right in zip(self.unknowns, self.rights, strict=True):
            model.rows.append(Row(unknown.name, right))


def equation(unknown: Any, zero: Any) -> Equation:
    """Return the algebraic equation that determines an unknown: ``zero = 0``.

    Examples
    --------
    >>> from nsspice.dvi import multiplier, states
    >>> u, x = multiplier("u"), states("x")
    >>> equation(u, abs(u + x) - abs(u - x) - u).unknowns
    (Expr(u),)
    """
    left, right = as_vector(unknown), as_vector(zero)
    if len(left) != len(right):
        raise wrong("NS6003", f"{len(left)} unknowns for {len(right)} equations", "")
    return Equation(tuple(left), tuple(right))


Within = Mapping[Any, Set]


def members(within: Within) -> list[tuple[list[Expr], Set]]:
    """Return the variables of each set of a product K."""
    found = []
    for key, K in within.items():
        variables = as_vector(key)
        if not isinstance(K, Cone | Polyhedron | SecondOrderCone):
            raise wrong(
                "NS6003",
                f"{K!r} is not a set for {variables[0].name}",
                "give a Cone, Box, Polyhedron or SecondOrderCone",
            )
        found.append((variables, K))
    return found


def write_membership(model: Model, variables: list[Expr], K: Set, rows: Mapping[str, Row]) -> None:
    """Add ``-g in N_K(u)`` for the variables u of one set: the rows ``0 = -g - N``, and pairs."""
    if isinstance(K, Cone):
        for u in variables:
            name = u.name
            if np.isfinite(K.low):
                model.pairs.append(Pair(f"{name}.low", u - K.low, ((name, -1.0),)))
            if np.isfinite(K.high):
                model.pairs.append(Pair(f"{name}.high", K.high - u, ((name, 1.0),)))
        return
    if isinstance(K, SecondOrderCone):
        if len(variables) != 2:
            raise wrong(
                "NS6005",
                f"the second-order cone of {', '.join(u.name for u in variables)} is not a "
                f"polyhedron, which this method needs",
                "VI(...).solve accepts it; elsewhere replace it by a pyramid (a Polyhedron)",
            )
        K = K.polyhedron()
    if K.C.shape[1] != len(variables):
        raise wrong(
            "NS6003",
            f"the polyhedron of {variables[0].name} has {K.C.shape[1]} columns for "
            f"{len(variables)} unknowns",
            "",
        )
    names = [u.name for u in variables]
    for k, (row, bound) in enumerate(zip(K.C, K.d, strict=True)):
        used = [(u, c) for u, c in zip(variables, row, strict=True) if c]
        slack = bound - sum((c * u for u, c in used[1:]), used[0][1] * used[0][0]) if used else None
        if slack is None:
            if bound < 0.0:
                raise wrong("NS6003", f"row {k} of the polyhedron says 0 <= {bound:g}", "")
            continue
        enters = tuple((u.name, float(c)) for u, c in used)
        model.pairs.append(Pair(f"{names[0]}.face{k}", slack, enters))


def shown(expression: Expr) -> str:
    """Return an expression as text."""
    return show(expression.node)
