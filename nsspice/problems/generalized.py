"""Generalized equations: ``p(t) in g(z) + F(z)`` with a smooth g and piecewise-linear F.

F is a product of maximal monotone graphs of one component each, written as complementarity pairs.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .csc import Csc
from .descriptor import DescriptorSystem, SmoothTerms
from .tape import Tape


def _numbers(piece: object, *names: str) -> None:
    """Turn the parameters of a graph, which may be whole numbers, into floats."""
    for name in names:
        object.__setattr__(piece, name, float(getattr(piece, name)))


@dataclass(frozen=True, slots=True)
class Sign:
    """The graph of a sign: ``low`` for z < at, ``high`` for z > at, all between at z = at.

    The law of a practical diode, of dry friction, of a relay.

    Parameters
    ----------
    low, high : float
        ``low <= high``.
    at : float
        Where it jumps.

    Examples
    --------
    >>> Sign(-1.0, 1.0)  # Coulomb friction of 1 N
    Sign(low=-1.0, high=1.0, at=0.0)
    """

    low: float
    high: float
    at: float = 0.0

    def __post_init__(self) -> None:
        _numbers(self, "low", "high", "at")
        if not self.low <= self.high:
            raise ValueError(f"a sign from {self.low} down to {self.high} is not monotone")


@dataclass(frozen=True, slots=True)
class Cone:
    """The normal cone of an interval: z stays in ``[low, high]``, forces act only at its ends.

    Parameters
    ----------
    low, high : float
        Either may be infinite.

    Examples
    --------
    >>> Cone(0.0).high
    inf
    """

    low: float = -np.inf
    high: float = np.inf

    def __post_init__(self) -> None:
        _numbers(self, "low", "high")
        if not self.low <= self.high:
            raise ValueError(f"the interval from {self.low} to {self.high} is empty")


@dataclass(frozen=True, slots=True)
class Ramp:
    """A kink: ``slope (z - at)`` beyond ``at``, zero before.

    Parameters
    ----------
    at : float
        Where the kink is.
    slope : float
        Positive.

    Examples
    --------
    >>> Ramp(at=0.7, slope=10.0).slope  # a diode of 0.7 V and 0.1 Ohm, current over voltage
    10.0
    """

    at: float
    slope: float

    def __post_init__(self) -> None:
        _numbers(self, "at", "slope")
        if not self.slope > 0.0:
            raise ValueError(f"a ramp needs a positive slope, not {self.slope}")


Piece = Sign | Cone | Ramp


@dataclass(frozen=True, slots=True)
class GeneralizedEquation:
    """The problem to find z(t) with ``p(t) in g(z, t) + F(z)``.

    Parameters
    ----------
    g : Tape
        n functions of n unknowns, and of the time if wanted; written by a :class:`TapeBuilder`.
    pieces : tuple of (int, Piece)
        Components of F: number of the unknown and its graph; several of one unknown add up.

    Examples
    --------
    A diode characteristic, asinh and a practical diode of 1 V in series:

    >>> from nsspice.problems import GeneralizedEquation, Sign, TapeBuilder
    >>> tape = TapeBuilder()
    >>> _ = tape.output(tape.op("asinh", tape.unknown(0)))
    >>> GeneralizedEquation(tape.finish(), ((0, Sign(-1.0, 1.0)),)).n
    1
    """

    g: Tape
    pieces: tuple[tuple[int, Piece], ...] = field(default_factory=tuple)

    def __post_init__(self) -> None:
        if any(not 0 <= k < self.n for k, _ in self.pieces):
            raise ValueError(f"a piece belongs to a component that is not among 0 to {self.n - 1}")

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return int(self.g.outputs.size)

    def system(self) -> DescriptorSystem:
        """Return the problem with pairs: unknowns z, then one value for each sign.

        The first n rows are ``g(z) + values + multipliers = p``.  A sign has the value v with
        ``z - at = l1 - l2`` and the slacks ``high - v``, ``v - low``.
        """
        n = self.n
        size = n + sum(isinstance(piece, Sign) for _, piece in self.pieces)
        G: list[tuple[int, int, float]] = []
        A: list[tuple[int, int, float]] = []
        B: list[tuple[int, int, float]] = []
        D: list[tuple[int, int, float]] = []
        q: list[float] = []
        extra = n

        def pair(row: int, sign: float, constant: float, series: float = 0.0) -> None:
            k = len(q)
            A.append((row, k, sign))
            B.append((k, row, sign))
            if series:
                D.append((k, k, series))
            q.append(constant)

        for k, piece in self.pieces:
            if isinstance(piece, Sign):
                G.extend([(k, extra, 1.0), (extra, k, -1.0)])
                pair(extra, 1.0, piece.high)
                pair(extra, -1.0, -piece.low)
                extra += 1
            elif isinstance(piece, Cone):
                if np.isfinite(piece.low):
                    pair(k, -1.0, -piece.low)
                if np.isfinite(piece.high):
                    pair(k, 1.0, piece.high)
            else:
                pair(k, 1.0, piece.at, 1.0 / piece.slope)
        m = len(q)
        kinds = np.zeros(size, np.uint8)
        kinds[:n] = 1  # z are like currents, the values of signs like voltages
        return DescriptorSystem(
            E=Csc.zeros((size, size)),
            G=_csc((size, size), G),
            A=_csc((size, m), A),
            B=_csc((m, size), B),
            D=_csc((m, m), D),
            q=np.array(q),
            S=Csc.zeros((size, 0)),
            row_kind=kinds,
            smooth=SmoothTerms(
                self.g,
                _csc((size, n), [(k, k, 1.0) for k in range(n)]),
                Csc.zeros((size, n)),
            ),
        )

    def offsets(self) -> np.ndarray:
        """Return what the right-hand side of :meth:`system` is besides p: the places of signs."""
        places = [-piece.at for _, piece in self.pieces if isinstance(piece, Sign)]
        return np.concatenate([np.zeros(self.n), places])


def _csc(shape: tuple[int, int], entries: list[tuple[int, int, float]]) -> Csc:
    rows, cols, values = zip(*entries, strict=True) if entries else ((), (), ())
    return Csc.from_triplets(shape, rows, cols, values)
