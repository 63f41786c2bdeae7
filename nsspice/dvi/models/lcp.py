"""Linear complementarity problems given by matrices."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..terms.errors import wrong
from ..terms.expression import as_expr
from ..terms.sets import Cone, matrix, vector
from ..terms.variables import unknowns
from .dvi import combined
from .vi import VI

if TYPE_CHECKING:
    from .verdicts import Verdicts


class LCP(VI):
    """The linear complementarity problem ``0 <= u`` orthogonal to ``M u + q >= 0``.

    Parameters
    ----------
    M : array_like or scipy sparse matrix, shape (m, m)
    q : array_like, shape (m,)
    name : str
        Of the unknowns.

    Raises
    ------
    UsageError
        NS6003 if the shapes do not fit.

    Source: R. W. Cottle, J.-S. Pang, R. E. Stone, *The Linear Complementarity Problem* (1992).

    Examples
    --------
    >>> problem = LCP([[2.0, 1.0], [1.0, 2.0]], [-5.0, -6.0])
    >>> problem.solve()["u[0]"].__round__(12), len(problem.solutions())
    (1.333333333333, 1)
    """

    kind = "LCP"

    def __init__(self, M: Any, q: Any, *, name: str = "u") -> None:
        self.M = matrix(M, "M")
        m = self.M.shape[0]
        self.M = matrix(self.M, "M", (m, m))
        self.q = vector(q, "q", m)
        u = unknowns(name, m)
        g = combined(((self.M, u),), [as_expr(float(x)) for x in self.q])
        super().__init__(g, {u: Cone(0.0)})

    def verdict(self) -> Verdicts:
        """Return the classes of M with their witnesses, and what they imply for solutions."""
        from .verdicts import of_lcp

        return of_lcp(self)


class MLCP(VI):
    """The mixed linear complementarity problem of free z and nonnegative u.

    ``A z + C u + a = 0``, ``0 <= u`` orthogonal to ``D z + B u + b >= 0``.

    Parameters
    ----------
    A, B, C, D : array_like, shapes (n, n), (m, m), (n, m), (m, n)
    a, b : array_like, shapes (n,), (m,)
    names : (str, str)
        Of z and u.

    Raises
    ------
    UsageError
        NS6003 if the shapes do not fit.

    Source: R. W. Cottle, J.-S. Pang, R. E. Stone (1992), section 1.5.

    Examples
    --------
    >>> MLCP([[1.0]], [[1.0]], [[-1.0]], [[1.0]], [-2.0], [-4.0]).solve()["u[0]"]
    1.0
    """

    kind = "MLCP"

    def __init__(
        self,
        A: Any,
        B: Any,
        C: Any,
        D: Any,
        a: Any,
        b: Any,
        *,
        names: tuple[str, str] = ("z", "u"),
    ) -> None:
        first, second = matrix(A, "A"), matrix(B, "B")
        n, m = first.shape[0], second.shape[0]
        self.A, self.B = matrix(first, "A", (n, n)), matrix(second, "B", (m, m))
        self.C, self.D = matrix(C, "C", (n, m)), matrix(D, "D", (m, n))
        self.a, self.b = vector(a, "a", n), vector(b, "b", m)
        if names[0] == names[1]:
            raise wrong("NS6001", f"both unknowns are named {names[0]}", "give two names")
        z, u = unknowns(names[0], n), unknowns(names[1], m)
        rows = combined(((self.A, z), (self.C, u)), [as_expr(float(x)) for x in self.a])
        slacks = combined(((self.D, z), (self.B, u)), [as_expr(float(x)) for x in self.b])
        super().__init__([*rows, *slacks], {u: Cone(0.0)}, of=np.concatenate([z, u]))
