"""Differential mixed variational inequalities: a convex function in addition to the inequality."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..terms.expression import Expr
from ..terms.sets import Set
from ..terms.variables import Unknowns
from .convex import subgradient
from .dvi import DVI, flattened
from .vi import VI


class DMVI(DVI):
    r"""A differential mixed variational inequality.

    .. math::

        \dot x = f + B u, \qquad \langle h + g(u), v - u \rangle + \varphi(v) - \varphi(u) \ge 0
        \quad (v \in K)

    Parameters
    ----------
    rates, start, at, name
        As for :class:`DVI`.
    g : mapping of multipliers to expressions
        ``{u: h + g(u)}``.
    phi : Expr
        Convex: a sum of multiples of ``abs`` and ``maximum`` of linear forms, and smooth terms.
    within : mapping of multipliers to sets
        K; the whole space for multipliers not listed.

    References
    ----------
    T. Roubal (2015), (2.2), with the signs of phi corrected.

    Examples
    --------
    ``phi = |u|`` makes u vanish while the force on it is below 1:

    >>> from nsspice.dvi import DMVI, multiplier, states
    >>> x, u = states("x"), multiplier("u")
    >>> problem = DMVI({x: -u}, g={u: u - x}, phi=abs(u), start={x: 3.0})
    >>> round(float(problem.run(10.0)["x"][-1]) - 1.0, 3)
    0.0
    """

    kind = "DMVI"

    def __init__(
        self,
        rates: Mapping[Any, Any],
        g: Mapping[Any, Any],
        phi: Expr,
        within: Mapping[Any, Set] | None = None,
        *,
        start: Mapping[Any, Any],
        at: float = 0.0,
        name: str = "",
    ) -> None:
        pairs = flattened(g, "the condition")
        slopes = subgradient(phi, [u for u, _ in pairs])
        total = np.array([h + s for (_, h), s in zip(pairs, slopes, strict=True)], dtype=object)
        variables = np.array([u for u, _ in pairs], dtype=object).view(Unknowns)
        condition = VI(total, within=dict(within or {}), of=variables)
        super().__init__(rates, [condition], start=start, at=at, name=name)
        self.phi = phi
