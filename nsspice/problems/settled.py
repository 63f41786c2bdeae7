"""Classes of matrices where rounding decides: settled by exact arithmetic.

The functions of :mod:`nsspice.problems.matrices` judge a matrix to the rounding of its entries, as
is right for those of circuits.  A matrix that a user gives is meant literally, and 1e-20 is not
zero: these judge it exactly, where it has few rows, and otherwise leave open what rounding decides.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import exact
from .matrices import is_definite, is_monotone, is_p0_matrix, is_p_matrix, square
from .verdict import Verdict, Witness

#: rows up to which a matrix is eliminated in exact arithmetic
_ROWS = 40


def monotone_exactly(matrix: npt.ArrayLike) -> Verdict:
    """Judge whether ``x . Mx >= 0`` for all x.

    Examples
    --------
    >>> bool(monotone_exactly([[1.0, 1.0], [1.0, 1.0 - 2.0**-53]]))
    False
    """
    m = square(matrix)
    found = is_monotone(m)
    if is_definite(m) or not np.all(np.isfinite(m)):
        return found
    if len(m) > _ROWS:
        text = f"rounding decides, and {len(m)} rows are more than {_ROWS}"
        return Verdict.undecided(found.claim, text) if found else found
    if exact.semidefinite(m):
        text = "the symmetric part is positive semidefinite"
        return found if found else Verdict.yes(found.claim, f"{text}, in exact arithmetic")
    if not found:
        return found
    text = "the symmetric part has a negative pivot in exact arithmetic"
    return Verdict.no(found.claim, "x . Mx is negative for some x", Witness(text))


def p_exactly(matrix: npt.ArrayLike, *, zero: bool = False) -> Verdict:
    """Judge whether all principal minors are positive, or at least not negative.

    Parameters
    ----------
    matrix : array_like, shape (m, m)
    zero : bool
        Whether they may be zero: P0.

    Examples
    --------
    >>> bool(p_exactly([[1.0, 1.0], [1.0, 1.0 + 2.0**-52]]))
    True
    """
    m = square(matrix)
    found = is_p0_matrix(m) if zero else is_p_matrix(m)
    if found.holds is None or not np.all(np.isfinite(m)) or (found and not zero):
        return found
    if len(m) <= exact.SUBSETS:
        sign, rows = exact.least_minor(m)
        holds = sign >= 0 if zero else sign > 0
        if holds is found.holds:
            return found
        if holds:
            return Verdict.yes(found.claim, "all principal minors, in exact arithmetic")
        text = f"the minor of rows {', '.join(map(str, rows))} is negative in exact arithmetic"
        return Verdict.no(found.claim, "a principal minor is negative", Witness(text, rows))
    if found.holds is False and found.witness is not None:
        rows = found.witness.rows
        value = exact.determinant(m[np.ix_(rows, rows)])
        if value < 0 or (value == 0 and not zero):
            return found
    elif is_monotone(m) and (is_definite(m) or (len(m) <= _ROWS and exact.semidefinite(m))):
        return found
    return Verdict.undecided(found.claim, f"rounding decides, and there are {len(m)} rows")


__all__ = ["monotone_exactly", "p_exactly"]
