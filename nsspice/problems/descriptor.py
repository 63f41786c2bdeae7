"""The complementarity descriptor system, the form every circuit takes before it is solved.

.. math::

    E z' + G z + A \\lambda = S u(t), \\qquad
    w = q - B z + D \\lambda, \\qquad 0 \\le \\lambda \\perp w \\ge 0

For passive networks E is symmetric positive semidefinite, G + G' and D are positive semidefinite
and B = A', so that each implicit step is a monotone mixed linear complementarity problem (MLCP).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt

from .csc import Csc, Floats
from .elements import Elements
from .passivity import passive
from .tape import Tape


class Handed(Protocol):
    """What one block of a circuit hands to another: a function that grows during the run."""

    def begin_with(self, value: float) -> None:
        """Say what the value is before the first instant."""

    def value(self, time: float, side: int = 1) -> float:
        """Return the value at an instant [s], the left limit for side -1."""

    def count(self) -> int:
        """Return the number of pieces."""

    def end(self) -> float:
        """Return up to where it is known [s]."""

    def error(self) -> float:
        """Return how far it was off where it was looked at, as a part of its largest value."""


@dataclass(frozen=True, slots=True)
class Waveform:
    """A source value as a function of time.

    Parameters
    ----------
    kind : str
        ``dc sin pulse pwl exp sffm am``, ``polynomial`` for what another block hands on, ``held``
        for what a controller sets.
    values : tuple of float
        Complete parameters, no defaults left open, in this order: dc ``(value)``; sin ``(offset,
        amplitude, frequency, delay, damping, phase_deg)``; pulse ``(v1, v2, delay, rise, fall,
        width, period, count)`` with period ``inf`` for a single pulse and count ``inf`` for no
        limit, rise or fall 0 for an ideal edge; pwl ``(t1, v1, t2, v2, ...)`` with equal
        neighbouring times for a jump; exp ``(v1, v2, td1, tau1, td2, tau2)``; sffm ``(offset,
        amplitude, carrier, index, signal)``; am ``(amplitude, offset, modulation, carrier,
        delay)``.
    repeat : float
        pwl only: time from which the curve repeats, ``nan`` for none.
    scale : float
        Factor applied to the value.
    handed : Handed or None
        Of the kinds ``polynomial`` and ``held``: a piecewise polynomial that grows during the run.

    Times are in s, frequencies in Hz, damping in 1/s, values in V or A.

    Examples
    --------
    >>> Waveform("sin", (0.0, 10.0, 50.0, 0.0, 0.0, 90.0)).kind  # 10 cos(2 pi 50 t)
    'sin'
    """

    kind: str
    values: tuple[float, ...]
    repeat: float = float("nan")
    scale: float = 1.0
    handed: Handed | None = None


@dataclass(frozen=True, slots=True)
class Switch:
    """Control law of a switched pair: closed above one threshold, open below the other.

    A switch is a pair whose multiplier has a free sign while it is closed (w = 0) and vanishes
    while it is open.

    Parameters
    ----------
    pair : int
        Which complementarity pair.
    control : tuple of (int, float)
        The control value [V or A] as a combination of unknowns z: pairs ``(j, factor)``.
    on_above, off_below : float
        Thresholds [V or A], ``off_below <= on_above``; between them the state is kept (hysteresis).
    closed : bool
        State of the pair before the first evaluation: True if it conducts.
    inverted : bool
        True if the pair is active while the control is *below* (a switch with RON > ROFF).
    latching : bool
        True for a thyristor: while it is closed the pair is a diode (lam >= 0), and it opens only
        when that diode has ceased to conduct.
    at_threshold : bool or None
        For a comparison, whether it is above its threshold where the control stays at it.  None for
        a switch, which turns when the control has come to the threshold and stays there.

    Examples
    --------
    >>> Switch(pair=0, control=((1, 1.0),), on_above=0.5, off_below=0.5).closed
    False
    """

    pair: int
    control: tuple[tuple[int, float], ...]
    on_above: float
    off_below: float
    closed: bool = False
    inverted: bool = False
    latching: bool = False
    at_threshold: bool | None = None

    def __post_init__(self) -> None:
        if not self.off_below <= self.on_above:
            raise ValueError(
                f"a switch that closes above {self.on_above:g} cannot open below "
                f"{self.off_below:g}: off_below <= on_above is needed"
            )


@dataclass(frozen=True, slots=True)
class SmoothTerms:
    """Smooth nonlinear functions f(z, u, t), and where they enter a descriptor system.

    .. math::

        E z' + (Q f)' + G z + F f + A \\lambda = S u

    Parameters
    ----------
    tape : Tape
        The p functions: currents [A], voltages [V], charges [A s] or fluxes [V s].
    F : Csc, shape (n, p)
        Where they enter as they are.
    Q : Csc, shape (n, p)
        Where their rates enter (charges in KCL rows, fluxes in branch rows).

    Examples
    --------
    A current of 1 nS times the cube of the only unknown:

    >>> from nsspice.problems import TapeBuilder
    >>> tape = TapeBuilder()
    >>> cube = tape.op("mul", tape.unknown(0), tape.op("mul", tape.unknown(0), tape.unknown(0)))
    >>> _ = tape.output(tape.op("mul", tape.constant(1e-9), cube))
    >>> one = Csc.from_triplets((1, 1), [0], [0], [1.0])
    >>> SmoothTerms(tape.finish(), F=one, Q=Csc.zeros((1, 1))).F.shape
    (1, 1)
    """

    tape: Tape
    F: Csc
    Q: Csc


@dataclass(frozen=True, eq=False)
class DescriptorSystem:
    """Arrays of one complementarity descriptor system; the module says which equations these are.

    Parameters
    ----------
    E, G : Csc, shape (n, n)
        Storage [F, H] and conductance-like [S, Ohm] matrices.
    A : Csc, shape (n, m)
        How the multipliers enter the rows.
    B : Csc, shape (m, n)
        How the unknowns enter the slacks.
    D : Csc, shape (m, m)
        Series resistance of the pairs [Ohm].
    q : ndarray, shape (m,)
        Constant part of the slacks [V]: forward drops and breakdown voltages.
    S : Csc, shape (n, p)
        Where the p waveforms enter.
    waveforms : tuple of Waveform, length p
    switches : tuple of Switch
    row_kind : ndarray of uint8, shape (n,)
        0 for current rows (KCL), 1 for voltage rows (branches); residuals are scaled per kind.  All
        are current rows if it is left out.
    smooth : SmoothTerms or None
        Smooth nonlinear terms, None in a system that is linear but for its pairs.
    elements : Elements or None
        The capacitors and resistors that E and G were summed from, None if they were not kept.

    Raises
    ------
    ValueError
        If shapes do not fit.

    Examples
    --------
    A source of 5 V behind 1 kOhm, an ideal diode from the node to ground, and 1 uF in parallel:

    >>> from nsspice.problems import weighted_sum
    >>> one = Csc.from_triplets((1, 1), [0], [0], [1.0])
    >>> system = DescriptorSystem(
    ...     E=weighted_sum([(one, 1e-6)]), G=weighted_sum([(one, 1e-3)]), A=one, B=one,
    ...     D=Csc.zeros((1, 1)), q=np.zeros(1), S=weighted_sum([(one, 1e-3)]),
    ...     waveforms=(Waveform("dc", (5.0,)),), row_kind=np.zeros(1, np.uint8))
    >>> system.n, system.m, system.passive
    (1, 1, True)
    """

    E: Csc
    G: Csc
    A: Csc
    B: Csc
    D: Csc
    q: Floats
    S: Csc
    waveforms: tuple[Waveform, ...] = ()
    switches: tuple[Switch, ...] = ()
    row_kind: npt.NDArray[np.uint8] = field(default_factory=lambda: np.zeros(0, dtype=np.uint8))
    smooth: SmoothTerms | None = None
    elements: Elements | None = None

    def __post_init__(self) -> None:
        n, m = self.n, self.m
        if self.row_kind.size == 0 and n:
            object.__setattr__(self, "row_kind", np.zeros(n, dtype=np.uint8))
        needed = {
            "E": (self.E.shape, (n, n)),
            "G": (self.G.shape, (n, n)),
            "A": (self.A.shape, (n, m)),
            "B": (self.B.shape, (m, n)),
            "D": (self.D.shape, (m, m)),
            "q": (self.q.shape, (m,)),
            "S": (self.S.shape, (n, self.S.shape[1])),
            "row_kind": (self.row_kind.shape, (n,)),
        }
        for name, (shape, fitting) in needed.items():
            if shape != fitting:
                raise ValueError(
                    f"{name} has the shape {shape}, not {fitting}: G has {n} rows, A {m} columns"
                )

    @property
    def n(self) -> int:
        """Number of unknowns z."""
        return self.G.shape[0]

    @property
    def m(self) -> int:
        """Number of complementarity pairs, switches included."""
        return self.A.shape[1]

    @property
    def switched(self) -> frozenset[int]:
        """The pairs that switches hold open or closed; that of a thyristor keeps its signs."""
        return frozenset(s.pair for s in self.switches if not s.latching)

    @property
    def timed(self) -> bool:
        """True if a smooth function depends on the time itself."""
        return self.smooth is not None and self.smooth.tape.timed

    @property
    def static(self) -> bool:
        """True if nothing stores energy (E = 0, no charge functions)."""
        return self.E.data.size == 0 and (self.smooth is None or self.smooth.Q.data.size == 0)

    @cached_property
    def storage(self) -> Csc:
        """The symmetric part of E, which stores; the rest are rates that control sources."""
        E = self.E
        own, places = E.data, E.columns * self.n + E.indices
        mirrored = E.indices * self.n + E.columns
        found = np.minimum(np.searchsorted(places, mirrored), max(places.size - 1, 0))
        other = np.where(places[found] == mirrored, own[found], 0.0) if own.size else own
        least = np.copysign(np.minimum(np.abs(own), np.abs(other)), own)
        both = np.where(own * other > 0.0, least, 0.0)
        return Csc(E.shape, E.indptr, E.indices, both)

    def stored_energy(self, z: Floats) -> float:
        """Return the energy [J] of the unknowns z (n,), that of smooth laws aside."""
        with np.errstate(over="ignore", invalid="ignore"):  # beyond the range of numbers: infinite
            return 0.5 * float(z @ self.storage.dot(z))

    @cached_property
    def passive(self) -> bool:
        """True if the arrays show that the network is passive: each step is a monotone problem."""
        return passive(self)


@dataclass(frozen=True, slots=True)
class Functional:
    """A scalar output: a linear combination of the quantities of a descriptor system.

    ``y = sum c z[j] + sum c lam[j] + sum c z'[j] + sum c u[j] + sum c f[j] + sum c f'[j]`` with the
    smooth functions f.

    Parameters
    ----------
    z, lam, dz, u, f, df : tuple of (int, float)
        Pairs ``(j, c)`` for the unknowns, the multipliers, the rates of the unknowns, the sources,
        the smooth functions and their rates.

    Examples
    --------
    The difference of two node voltages:

    >>> Functional(z=((0, 1.0), (1, -1.0))).lam
    ()
    """

    z: tuple[tuple[int, float], ...] = ()
    lam: tuple[tuple[int, float], ...] = ()
    dz: tuple[tuple[int, float], ...] = ()
    u: tuple[tuple[int, float], ...] = ()
    f: tuple[tuple[int, float], ...] = ()
    df: tuple[tuple[int, float], ...] = ()
