"""Models in the standard form of the theorems: ``x' = f(t, x, u)``, ``0 in g(t, x, u) + N_K(u)``.

Multipliers of complementarity have K = [0, inf) and their slack for g; algebraic unknowns the whole
line; set values of ``Sgn_{low,high}(y)`` the interval [low, high] and ``g = -y``, since the sign is
the inverse of the normal cone of that interval.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from ...devices.behaviour import Compiler
from ...errors import UsageError
from ...netlist.expressions.node import num, var
from ...problems import exact
from ...problems.tape import Tape, TapeBuilder
from ...problems.theorems import ConvexSet, StandardDVI
from ..equations.conditions import Complementarity, Contact, Equation
from ..runs.scheme import put
from ..terms.expression import Expr, merged
from ..terms.sets import Cone, Polyhedron, SecondOrderCone, Set

if TYPE_CHECKING:
    from .dvi import DVI
    from .vi import VI

INF = float("inf")


@dataclass(slots=True)
class _Form:
    """Components of u in order: variables, g, sets."""

    unknowns: list[Expr] = field(default_factory=list)
    g: list[Expr] = field(default_factory=list)
    sets: list[ConvexSet] = field(default_factory=list)

    def interval(self, u: Expr, g: Expr, low: float, high: float) -> None:
        self.sets.append(ConvexSet.box(len(self.unknowns), low, high))
        self.unknowns.append(u)
        self.g.append(g)

    def condition(self, condition: Any) -> None:
        if isinstance(condition, Complementarity):
            for u, w in zip(condition.multipliers, condition.slacks, strict=True):
                self.interval(u, w, 0.0, INF)
        elif isinstance(condition, Contact):
            self.interval(condition.force, condition.gap, 0.0, INF)
        elif isinstance(condition, Equation):
            for u, right in zip(condition.unknowns, condition.rights, strict=True):
                self.interval(u, -right, -INF, INF)
        else:
            self.inequality(condition)

    def inequality(self, vi: VI) -> None:
        """Add a VI.

        Signs that are maximal monotone graphs of one component each are left out of g: statements
        on g that allow a normal cone allow any such graph (Corollary 2.1 of appendix B).
        """
        first = len(self.unknowns)
        index = {u.name: first + k for k, u in enumerate(vi.unknowns)}
        self.unknowns += vi.unknowns
        g = list(vi.g)
        if separable(vi):
            zero = {name: num(0.0) for part in g for name in part.atoms}
            g = [Expr(put(part.node, zero)) for part in g]
        self.g += g
        left = set(index.values())
        for variables, K in vi.sets:
            members = [index[u.name] for u in variables]
            left -= set(members)
            if isinstance(K, Cone):
                self.sets += [ConvexSet.box(k, K.low, K.high) for k in members]
            else:
                self.sets.append(convex_set(members, K))
        self.sets += [ConvexSet.box(k, -INF, INF) for k in sorted(left)]

    def atoms(self, parts: Sequence[Expr]) -> None:
        known: set[str] = set()
        waiting = [merged(*(part.atoms for part in parts))]
        while waiting:
            for name, atom in waiting.pop().items():
                if name not in known:
                    known.add(name)
                    waiting.append(atom.argument.atoms)
                    self.interval(Expr(var(name)), -atom.argument, atom.low, atom.high)


def separable(problem: VI) -> bool:
    """Return whether each set-valued term is an increasing graph of one component in its row."""
    from .convex import separable_kinks

    try:
        separable_kinks(problem, [u.name for u in problem.unknowns])
    except UsageError:
        return False
    return True


def convex_set(members: Sequence[int], K: Set) -> ConvexSet:
    """Return what theorems ask of a polyhedron or a second-order cone."""
    size = len(members)
    if isinstance(K, SecondOrderCone):
        least = (0.0, *[-INF] * (size - 1))
        return ConvexSet(tuple(members), least, (INF,) * size, False, size == 2, True)
    assert isinstance(K, Polyhedron)
    low: list[float] = [-INF] * size
    high: list[float] = [INF] * size
    empty = bool(np.any((K.d < 0.0) & ~K.C.any(axis=1)))
    if K.C.size * K.C.shape[0] > exact.MOST:
        # too large for exact arithmetic: what is not known of the box is left open
        inside = bool(np.all(K.d >= 0.0))  # 0 lies in it
        found = None if not inside and not empty else empty
        return ConvexSet(tuple(members), tuple(low), tuple(high), False, True, False, found)
    try:
        for k in range(size):
            for sign, ends in ((1.0, high), (-1.0, low)):
                cost = np.zeros(size)
                cost[k] = sign
                most = exact.maximise(cost.tolist(), K.C, K.d.tolist())
                if most is not None:  # rounded outwards
                    ends[k] = float(np.nextafter(sign * float(most), sign * INF))
                    if Fraction(sign * float(most)) == sign * most:
                        ends[k] = sign * float(most)
    except exact.Empty:
        empty = True
    cone = bool(np.all(K.d == 0.0))
    return ConvexSet(tuple(members), tuple(low), tuple(high), False, True, cone, empty)


def standard_form(
    problem: DVI, region: Mapping[str, tuple[float, float]] | None = None
) -> StandardDVI:
    """Return a DVI in standard form, its states within a region if there is one."""
    form = _Form()
    for condition in problem.conditions:
        form.condition(condition)
    rates = [row.right for row in problem.model.rows if row.state]
    form.atoms([*rates, *form.g])
    names = [*problem.states, *(u.name for u in form.unknowns)]
    return StandardDVI(
        len(problem.states),
        len(form.unknowns),
        tape_of(rates, names),
        tape_of(form.g, names),
        tuple(form.sets),
        tuple(problem.states),
        tuple(u.name for u in form.unknowns),
        (problem.at, INF),
        tuple(region.get(name, (-INF, INF)) for name in problem.states) if region else (),
    )


def static_form(problem: VI) -> StandardDVI:
    """Return a VI as a DVI without states."""
    form = _Form()
    form.inequality(problem)
    form.atoms(form.g)
    names = [u.name for u in form.unknowns]
    return StandardDVI(
        0,
        len(names),
        tape_of([], names),
        tape_of(form.g, names),
        tuple(form.sets),
        (),
        tuple(names),
        (-INF, INF),
    )


def tape_of(parts: Sequence[Expr], names: Sequence[str]) -> Tape:
    """Return expressions as a tape of unknowns in the order of names."""
    builder = TapeBuilder()
    places = {name: k for k, name in enumerate(names)}

    def register(name: str) -> int:
        return builder.time() if name == "time" else builder.unknown(places[name])

    compiler = Compiler(builder, register)
    for part in parts:
        builder.output(compiler.compile(part.node))
    return builder.finish()
