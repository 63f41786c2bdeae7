"""Closed convex sets K of variational inequalities, in their complementarity forms.

``-g in N_K(u)`` is written with multipliers of the inequalities that make up K: for an interval
those of its ends, for a polyhedron ``{C u <= d}`` one for each row,

.. math::

    -g = C' \\mu, \\qquad 0 \\le \\mu \\perp d - C u \\ge 0.

A second-order cone is not a polyhedron; problems over it are solved by its projection.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ...problems.generalized import Cone
from .errors import wrong

__all__ = ["Box", "Cone", "Polyhedron", "SecondOrderCone", "Set", "matrix", "vector"]

Floats = npt.NDArray[np.float64]

#: an interval, as the normal cone of it is called elsewhere: ``Box(0)`` is the half line
Box = Cone


@dataclass(frozen=True)
class Polyhedron:
    """The set ``{u : C u <= d}``.

    Parameters
    ----------
    C : array_like or scipy sparse matrix, shape (k, m)
    d : array_like, shape (k,)

    Raises
    ------
    UsageError
        NS6003 if the shapes do not fit, or an entry is not a number.

    Examples
    --------
    >>> Polyhedron([[1.0, 1.0]], [2.0]).C.shape
    (1, 2)
    """

    C: Any
    d: Any

    def __post_init__(self) -> None:
        C, d = matrix(self.C, "C"), vector(self.d, "d")
        if C.shape[0] != d.size:
            raise wrong("NS6003", f"C has {C.shape[0]} rows and d {d.size} entries", "")
        object.__setattr__(self, "C", C)
        object.__setattr__(self, "d", d)


@dataclass(frozen=True, slots=True)
class SecondOrderCone:
    """The friction cone ``{(n, t) : |t| <= mu n}``, its first component the normal one.

    Parameters
    ----------
    mu : float
        Half opening, such as a coefficient of friction; positive.

    Notes
    -----
    With one tangential component it is a polyhedron, ``|t| <= mu n``; with more it is not.

    Examples
    --------
    >>> SecondOrderCone(0.5).project(np.array([0.0, 1.0, 0.0])).round(12).tolist()
    [0.4, 0.2, 0.0]
    """

    mu: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mu) and self.mu > 0.0):
            raise wrong("NS6003", f"a cone with mu = {self.mu} has no interior", "give mu > 0")

    def polyhedron(self) -> Polyhedron:
        """Return the cone of one normal and one tangential component."""
        return Polyhedron([[-self.mu, 1.0], [-self.mu, -1.0]], [0.0, 0.0])

    def project(self, u: Floats) -> Floats:
        """Return the nearest point of the cone, shape (m,)."""
        normal, tangent = u[0], u[1:]
        size = float(np.linalg.norm(tangent))
        if size <= self.mu * normal:
            return u.copy()
        if self.mu * size <= -normal:
            return np.zeros_like(u)
        along = (normal + self.mu * size) / (1.0 + self.mu**2)
        return np.concatenate([[along], self.mu * along / size * tangent])

    def slope(self, u: Floats) -> Floats:
        """Return an element of the generalised Jacobian of the projection, shape (m, m)."""
        normal, tangent = u[0], u[1:]
        size = float(np.linalg.norm(tangent))
        if size <= self.mu * normal:
            return np.eye(u.size)
        if self.mu * size <= -normal:
            return np.zeros((u.size, u.size))
        mu, unit = self.mu, tangent / size
        along = (normal + mu * size) / (1.0 + mu**2)
        out = np.zeros((u.size, u.size))
        out[0, 0] = 1.0
        out[0, 1:] = mu * unit
        out[1:, 0] = mu * unit
        spread = np.eye(unit.size) - np.outer(unit, unit)
        out[1:, 1:] = mu**2 * np.outer(unit, unit) + mu * along * (1.0 + mu**2) / size * spread
        return out / (1.0 + mu**2)


Set = Cone | Polyhedron | SecondOrderCone


def matrix(value: Any, name: str, shape: tuple[int, int] | None = None) -> Floats:
    """Return a matrix, given as nested lists, a numpy array or a scipy sparse matrix.

    Raises
    ------
    UsageError
        NS6003 if its shape does not fit, or an entry is not a number.
    """
    if hasattr(value, "toarray"):
        value = value.toarray()
    try:
        out = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise wrong("NS6003", f"{name} is not a matrix of numbers", "") from None
    if out.ndim == 0 and (shape is None or shape == (1, 1)):
        out = out.reshape(1, 1)
    if out.ndim == 1 and shape is not None and out.size == shape[0] * shape[1]:
        out = out.reshape(shape)
    if out.ndim != 2 or (shape is not None and out.shape != shape):
        needed = "two axes" if shape is None else f"the shape {shape}"
        raise wrong("NS6003", f"{name} has the shape {out.shape}; it needs {needed}", "")
    if not np.isfinite(out).all():
        raise wrong("NS6003", f"{name} has entries that are not finite numbers", "")
    return out


def vector(value: Any, name: str, size: int | None = None) -> Floats:
    """Return a vector of numbers; a scalar is repeated where the size is known.

    Raises
    ------
    UsageError
        NS6003 as of :func:`matrix`.
    """
    try:
        out = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise wrong("NS6003", f"{name} is not a vector of numbers", "") from None
    if out.ndim == 0:
        out = np.full(1 if size is None else size, float(out))
    out = out.reshape(-1) if out.ndim == 2 and 1 in out.shape else out
    if out.ndim != 1 or (size is not None and out.size != size):
        needed = "one axis" if size is None else f"the shape ({size},)"
        raise wrong("NS6003", f"{name} has the shape {out.shape}; it needs {needed}", "")
    if not np.isfinite(out).all():
        raise wrong("NS6003", f"{name} has entries that are not finite numbers", "")
    return out
