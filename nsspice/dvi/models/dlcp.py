"""Differential complementarity problems: nonlinear, and linear ones given by their matrices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..equations.assembly import assemble
from ..equations.conditions import Complementarity
from ..terms.errors import wrong
from ..terms.expression import Expr, as_vector
from ..terms.sets import matrix, vector
from ..terms.variables import multiplier, states
from .dvi import DVI, combined, flattened


class DNCP(DVI):
    """A differential nonlinear complementarity problem: ``0 <= u`` orthogonal to ``g(t, x, u)``.

    Parameters
    ----------
    rates, start, at, name
        As for :class:`DVI`.
    g : mapping of multipliers to expressions

    Examples
    --------
    >>> from nsspice.dvi import DNCP, multiplier, states
    >>> x, u = states("x"), multiplier("u")
    >>> problem = DNCP({x: u - x}, {u: u**3 + u - x - 1.0}, start={x: 2.0})
    >>> problem.problem_class[0]
    'DNCP'
    """

    kind = "DNCP"

    def __init__(
        self,
        rates: Mapping[Any, Any],
        g: Mapping[Any, Any],
        *,
        start: Mapping[Any, Any],
        at: float = 0.0,
        name: str = "",
    ) -> None:
        pairs = flattened(g, "the condition")
        condition = Complementarity(tuple(u for u, _ in pairs), tuple(w for _, w in pairs))
        super().__init__(rates, [condition], start=start, at=at, name=name)


class DLCP(DVI):
    """A differential linear complementarity problem given by its matrices.

    ``x' = A x + B u + p``, ``0 <= u`` orthogonal to ``y = C x + D u + q >= 0``.

    Parameters
    ----------
    A, B, C, D : array_like or scipy sparse, shapes (n, n), (n, m), (m, n), (m, m)
    p, q : array_like of numbers or expressions of time, shapes (n,), (m,)
        0 by default.
    x0 : array_like, shape (n,)
    E : array_like, shape (n, n), optional
        Regular matrix before ``x'``; it need not be symmetric.
    names : (str, str)
        Of the states and the multipliers.

    Raises
    ------
    UsageError
        NS6003 if shapes do not fit.

    Examples
    --------
    >>> problem = DLCP([[0.0]], [[1.0]], [[1.0]], [[0.0]], p=[-1.0], x0=[1.0])
    >>> sol = problem.run(2.0)
    >>> [round(float(sol[name][-1]), 12) for name in ("x[0]", "u[0]")]
    [0.0, 1.0]
    """

    kind = "DLCP"

    def __init__(
        self,
        A: Any,
        B: Any,
        C: Any,
        D: Any,
        p: Any = 0.0,
        q: Any = 0.0,
        *,
        x0: Any,
        E: Any = None,
        names: tuple[str, str] = ("x", "u"),
        at: float = 0.0,
        name: str = "",
    ) -> None:
        a = matrix(A, "A")
        n = a.shape[0]
        if a.shape[1] != n:
            raise wrong("NS6003", f"A has the shape {a.shape}, which is not square", "")
        d = matrix(D, "D")
        m = d.shape[0]
        a, d = matrix(a, "A", (n, n)), matrix(d, "D", (m, m))
        b, c = matrix(B, "B", (n, m)), matrix(C, "C", (m, n))
        self.A, self.B, self.C, self.D = a, b, c, d
        self.p, self.q = _column(p, "p", n), _column(q, "q", m)
        x, u = states(names[0], size=n), multiplier(names[1], size=m)
        right = combined(((a, x), (b, u)), self.p)
        slack = combined(((c, x), (d, u)), self.q)
        start = {x: vector(x0, "x0", n)}
        condition = Complementarity(tuple(u), tuple(slack))
        #: what states, u and y are in the circuit that it was made from
        self.labels: dict[str, list[str]] = {}
        self._mass = None if E is None else matrix(E, "E", (n, n))
        super().__init__({x: np.array(right, dtype=object)}, [condition], start=start,
                         at=at, name=name)  # fmt: skip
        if self._mass is not None:
            if np.linalg.matrix_rank(self._mass) < n:
                raise wrong("NS6003", "E is singular", "write algebraic equations with equation()")
            labels = [item.name for item in x]
            self.model.mass = {
                (labels[i], labels[j]): float(self._mass[i, j])
                for i, j in zip(*np.nonzero(self._mass), strict=True)
            }
            self.assembly = assemble(self.model, self.at)

    def pivot(self, pairs: Sequence[int]) -> DLCP:
        """Return the same problem with u and y of some pairs exchanged.

        With ``y_a = C_a x + D_aa u_a + D_ab u_b + q_a`` solved for ``u_a`` the new multipliers are
        ``(y_a, u_b)``.  The trajectory is the same; a theta scheme, which averages ``A x``, is not.

        Parameters
        ----------
        pairs : sequence of int
            Numbers of the pairs, from 0.

        Raises
        ------
        UsageError
            NS6005 if the principal submatrix of D is singular.

        Source: R. W. Cottle, J.-S. Pang, R. E. Stone (1992), section 2.3.

        Examples
        --------
        >>> problem = DLCP([[-1.0]], [[1.0]], [[1.0]], [[2.0]], x0=[1.0])
        >>> problem.pivot([0]).A.tolist(), problem.pivot([0]).D.tolist()
        ([[-1.5]], [[0.5]])
        """
        m = self.D.shape[0]
        a = np.array(sorted(set(pairs)), dtype=int)
        b = np.setdiff1d(np.arange(m), a)
        inner = self.D[np.ix_(a, a)]
        if a.size and np.linalg.matrix_rank(inner) < a.size:
            raise wrong(
                "NS6005", f"D of the pairs {a.tolist()} is singular: they cannot be exchanged", ""
            )
        inverse = np.linalg.inv(inner)
        A = self.A - self.B[:, a] @ inverse @ self.C[a]
        B, C, D = self.B.copy(), self.C.copy(), self.D.copy()
        B[:, a] = self.B[:, a] @ inverse
        B[:, b] = self.B[:, b] - B[:, a] @ self.D[np.ix_(a, b)]
        C[a] = -inverse @ self.C[a]
        C[b] = self.C[b] + self.D[np.ix_(b, a)] @ C[a]
        D[np.ix_(a, a)] = inverse
        D[np.ix_(a, b)] = -inverse @ self.D[np.ix_(a, b)]
        D[np.ix_(b, a)] = self.D[np.ix_(b, a)] @ inverse
        D[np.ix_(b, b)] = self.D[np.ix_(b, b)] - D[np.ix_(b, a)] @ self.D[np.ix_(a, b)]
        p, q = np.array(self.p, dtype=object), np.array(self.q, dtype=object)
        moved = q.copy()
        moved[a] = -inverse @ q[a]
        moved[b] = q[b] + self.D[np.ix_(b, a)] @ moved[a]
        x0 = [self.start[name] for name in self.states]
        return DLCP(
            A, B, C, D, p - B[:, a] @ q[a], moved, x0=x0, E=self._mass, at=self.at, name=self.name
        )


def _column(value: Any, name: str, size: int) -> list[Expr]:
    items = as_vector(value)
    if len(items) == 1 and size > 1:
        items = items * size
    if len(items) != size:
        raise wrong("NS6003", f"{name} has {len(items)} entries; {size} are needed", "")
    return items
