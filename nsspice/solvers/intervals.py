"""Intervals of a continuous solution, which engines record for the certificate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from .. import _core
from ..problems.csc import Floats


@dataclass(frozen=True, slots=True)
class Intervals:
    """k intervals with s points each: nodes of a quadrature, or stages of a Runge-Kutta step.

    Engines return them as objects of the compiled core with these attributes, whose arrays are
    created when they are first read; this class can also be filled and changed in Python.

    Parameters
    ----------
    begin, end : ndarray, shape (k,)
        [s]
    shortest : ndarray, shape (k,)
        Shortest time that the rates stand for [s].
    swing : ndarray, shape (k,)
        Energy of the terms of a closed form if none of them cancelled [J]; 0 for a step.
    steps : ndarray of uint8, shape (k,)
        Steps of the engine that end with each.
    signed : ndarray of uint8, shape (k,)
        1 if the signs of the pairs are promised at all points, 0 at the last one alone.
    doubt : ndarray, shape (k,)
        How far controls of switches may lie beyond their thresholds [V, A]; infinite where some
        switches are sampled.
    first, first_u : ndarray, shapes (k, n), (k, p)
        Unknowns and sources at the beginning.
    time, weight : ndarray, shape (k, s)
        Instants, and weights of the rates in the change of the state [s].
    inner : ndarray, shape (k, s, s), or empty
        Weights of the rates in the states of the points [s]; empty for a closed form.
    z, rate : ndarray, shape (k, s, n)
        Unknowns, and the rates of those that are stored; the last point is the end.
    lam : ndarray, shape (k, s, m)
    u : ndarray, shape (k, s, p)
    function_rate : ndarray, shape (k, s, functions)
        Rates of the smooth functions.
    roles : ndarray of uint8, shape (k, m), or empty
        0 complementary pair, 1 closed, 2 open; empty if all are complementary.
    boundary_end, boundary_begin : ndarray, shape (some, n)
        Unknowns where one motion ends, or a reported jump, and where the next one begins; nothing
        but what is stored counts.  Of all that were compared those that differ most, and those at
        which most is stored.
    boundaries : int
        How many were compared.
    known : float
        Relative residual to which an iteration has solved the points; 0 for a closed form.
    """

    begin: Floats
    end: Floats
    shortest: Floats
    swing: Floats
    steps: npt.NDArray[np.uint8]
    signed: npt.NDArray[np.uint8]
    doubt: Floats
    first: Floats
    first_u: Floats
    time: Floats
    weight: Floats
    inner: Floats
    z: Floats
    rate: Floats
    lam: Floats
    u: Floats
    function_rate: Floats
    roles: npt.NDArray[np.uint8]
    boundary_end: Floats
    boundary_begin: Floats
    boundaries: int
    known: float

    @classmethod
    def of(cls, intervals: _core.Intervals) -> Intervals:
        """Return what an engine has left in the form that can be altered."""
        return cls(*(getattr(intervals, field.name) for field in fields(cls)))


def joined(parts: Sequence[Intervals]) -> Intervals:
    """Return recordings that follow each other as one, without their interval boundaries."""
    filled = [part for part in parts if part.begin.size] or list(parts[:1])
    tables = {
        field.name: np.concatenate([getattr(part, field.name) for part in filled])
        for field in fields(Intervals)
        if field.name not in ("boundaries", "known")
    }
    total = sum(part.boundaries for part in parts)
    return Intervals(**tables, boundaries=total, known=max(part.known for part in parts))


#: as an engine left them, or made by hand
Recording = Intervals | _core.Intervals
