"""Variables of a model: unknowns of static problems, states, multipliers."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...netlist.expressions.node import var
from .errors import wrong
from .expression import Expr


class Unknowns(np.ndarray[Any, np.dtype[np.object_]]):
    """A vector of variables: an array of expressions that may also be the key of a mapping.

    Examples
    --------
    >>> from nsspice.dvi import unknowns
    >>> q = unknowns("q", 3)
    >>> q.shape, q.sum(), q @ [1.0, 0.0, 2.0]
    ((3,), Expr(q[0] + q[1] + q[2]), Expr(q[0] + q[2]*2))
    """

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        """Return results of arithmetic as plain arrays, and single ones as expressions."""
        return array[()] if array.ndim == 0 else np.asarray(array)

    def __matmul__(self, other: Any) -> Any:
        return np.asarray(self) @ np.asarray(other, dtype=object)

    def __rmatmul__(self, other: Any) -> Any:
        if hasattr(other, "toarray"):
            other = other.toarray()
        return np.asarray(other, dtype=object) @ np.asarray(self)

    def __hash__(self) -> int:  # type: ignore[override]
        return id(self)


def _vector(name: str, size: int | None) -> Any:
    _check(name)
    if size is None:
        return Expr(var(name))
    if size < 1:
        raise wrong("NS6002", f"{name} has {size} components", "give 1 or more")
    out = np.empty(size, dtype=object)
    for k in range(size):
        out[k] = Expr(var(f"{name}[{k}]"))
    return out.view(Unknowns)


def _check(name: str) -> None:
    if not name.replace("_", "").isalnum() or not name[0].isalpha():
        raise wrong("NS6001", f"{name!r} is not a valid variable name", "use letters, digits and _")
    if name != name.lower():
        raise wrong(
            "NS6001",
            f"the name {name} has capital letters, which signal names do not distinguish",
            f"name it {name.lower()}",
        )
    if name in ("t", "time"):
        raise wrong("NS6001", f"{name} is the name of time", "use another name")


def unknowns(name: str, size: int | None = None) -> Any:
    """Return an unknown, or a vector of them, of a static problem.

    Parameters
    ----------
    name : str
        Of the unknown; components are called ``name[0]``, ``name[1]`` ...
    size : int, optional
        Number of components; a scalar without it.

    Examples
    --------
    >>> unknowns("price")
    Expr(price)
    """
    return _vector(name, size)


def states(*names: str, size: int | None = None) -> Any:
    """Return states, one for each name; vectors if a size is given.

    Examples
    --------
    >>> x, v = states("x", "v")
    >>> states("y", size=2).tolist()
    [Expr(y[0]), Expr(y[1])]
    """
    found = tuple(_vector(name, size) for name in names)
    return found[0] if len(found) == 1 else found


def multiplier(*names: str, size: int | None = None) -> Any:
    """Return multipliers: forces, currents, prices that a condition of the model determines.

    Examples
    --------
    >>> n = multiplier("n")
    >>> n
    Expr(n)
    """
    return states(*names, size=size)
