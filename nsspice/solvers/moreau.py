"""Moreau time stepping: the Python interface of the compiled stepper, for one descriptor system.

The scheme, with theta the weight of the new state and H, Hs the averaging terms (zero for theta=1):

.. math::

    (E/h + G + H) z_1 + A \\lambda_1 = (E/h + H) z_0 + (S - H_s) u_1 + H_s u_0, \\qquad
    0 \\le \\lambda_1 \\perp q - B z_1 + D \\lambda_1 \\ge 0

References: J. J. Moreau, in Nonsmooth Mechanics and Applications (1988); V. Acary, B. Brogliato,
Numerical Methods for Nonsmooth Dynamical Systems (Springer, 2008), ch. 9; T. Roubal, Non-smooth
analysis in engineering and economics (2015), section 3.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from .. import _core
from ..problems.csc import Floats
from ..problems.tape import Tape
from .compiled import core_tape
from .implicit import ImplicitStepper


@dataclass(frozen=True, slots=True)
class Records:
    """Some accepted steps as the solver took them, for checks that share no code with it.

    Engines return them as objects of the compiled core with these attributes, whose arrays are
    created when they are first read; this class can also be filled and changed in Python.

    Parameters
    ----------
    time, length : ndarray, shape (k,)
        End and length of each step [s]; infinite for a static solution, negative for the state
        just after a jump: minus the length of the short step that found it.
    z, change : ndarray, shape (k, n)
        Unknowns at the end, and their change over the step.
    lam : ndarray, shape (k, m)
    u, source_change : ndarray, shape (k, p)
        Sources at the end (left limits), and their change.
    roles : ndarray of uint8, shape (k, m), or None
        0 complementary pair, 1 closed, 2 open; None if all are complementary.
    """

    time: Floats
    length: Floats
    z: Floats
    change: Floats
    lam: Floats
    u: Floats
    source_change: Floats
    roles: npt.NDArray[np.uint8] | None

    @classmethod
    def of(cls, records: _core.Records) -> Records:
        """Return what an engine has left in the form that can be altered."""
        return cls(*(getattr(records, field.name) for field in fields(cls)))

    def __len__(self) -> int:
        return self.time.size


#: as an engine left them, or made by hand
Recorded = Records | _core.Records


def function_slopes(tape: Tape, z: Floats, u: Floats, t: Floats) -> Floats:
    """Return the derivatives of the functions of a tape by the unknowns, shape (k, p, n).

    Parameters
    ----------
    tape : Tape
    z, u, t : ndarray, shapes (k, n), (k, s), (k,)
        Points: unknowns, sources and times.
    """
    return _slopes(tape, z, u, t)[:, :, : z.shape[1]]


def source_slopes_of(tape: Tape, z: Floats, u: Floats, t: Floats) -> Floats:
    """Return the derivatives of the functions of a tape by the sources, shape (k, p, s).

    Parameters
    ----------
    tape, z, u, t
        As for :func:`function_slopes`.
    """
    n = z.shape[1]
    return _slopes(tape, z, u, t)[:, :, n : n + u.shape[1]]


def all_slopes_of(tape: Tape, z: Floats, u: Floats, t: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the derivatives by unknowns (k, p, n), sources (k, p, s) and the time alone (k, p).

    Parameters
    ----------
    tape, z, u, t
        As for :func:`function_slopes`.
    """
    found, n = _slopes(tape, z, u, t), z.shape[1]
    return found[:, :, :n], found[:, :, n : n + u.shape[1]], found[:, :, -1]


def _slopes(tape: Tape, z: Floats, u: Floats, t: Floats) -> Floats:
    """Return the derivatives by unknowns, sources and the time, shape (k, p, n + s + 1)."""
    _, places, slopes = _core.tape_values(
        core_tape(tape), np.ascontiguousarray(z), np.ascontiguousarray(u), np.ascontiguousarray(t)
    )
    table = np.asarray(slopes).reshape(z.shape[0], -1)
    out = np.zeros((z.shape[0], tape.outputs.size, z.shape[1] + u.shape[1] + 1))
    for entry, (function, variable) in enumerate(places):
        out[:, function, variable] += table[:, entry]
    return out


def function_values(tape: Tape, z: Floats, u: Floats, t: Floats) -> Floats:
    """Return the functions of a tape, shape (k, p), at points z (k, n), u (k, s), times t (k,)."""
    values, _, _ = _core.tape_values(
        core_tape(tape), np.ascontiguousarray(z), np.ascontiguousarray(u), np.ascontiguousarray(t)
    )
    return np.asarray(values, dtype=np.float64).reshape(z.shape[0], -1)


class MoreauStepper(ImplicitStepper):
    """Steps one descriptor system through time, or through the points of a sweep.

    Create it, start it (``start_dc`` or ``start_charges``), plan the instants, then call
    ``advance`` until it is done.  Nothing is stored but the present state.

    Parameters
    ----------
    system : DescriptorSystem
    outputs : sequence of Functional
        One output column each, after the column of times.
    H, Hs : Csc, optional
        Averaging terms for theta < 1, shapes (n, n) and (n, p).

    Examples
    --------
    A capacitor of 1 F discharged by 1 Ohm, one implicit step of 1 s:

    >>> import numpy as np
    >>> from nsspice.problems import Csc, DescriptorSystem, Functional
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> system = DescriptorSystem(one, one, none((1, 0)), none((0, 1)), none((0, 0)),
    ...     np.zeros(0), none((1, 0)), row_kind=np.zeros(1, np.uint8))
    >>> stepper = MoreauStepper(system, [Functional(z=((0, 1.0),))])
    >>> _ = stepper.start_charges(0.0, np.array([1.0]), 1.0)
    >>> stepper.plan(0.0, 1.0, 1.0, 0.0, 1.0)
    2
    >>> rows, done = stepper.advance(10)
    >>> rows.round(6).tolist()
    [[0.0, 1.0], [1.0, 0.5]]
    """

    def _plan(
        self, start: float, stop: float, step: float, out_start: float, out_step: float
    ) -> int:
        return self._core.plan_grid(start, stop, step, out_start, out_step)

    def follow(self, outputs: Sequence[int], start: float, stop: float) -> None:
        """Record outputs between the rows: the ends of all steps, among the rows of ``take_sides``.

        Parameters
        ----------
        outputs : sequence of int
            Which outputs are to be followed; all of them are, if there are any.
        start, stop : float
            Between which instants [s].
        """
        if outputs:
            self._core.keep_between(start, stop)

    def plan_points(self, times: Floats) -> int:
        """Plan static solutions at the given points, one row each."""
        return self._core.plan_points(np.ascontiguousarray(times, dtype=np.float64))

    def freeze_time(self, time: float) -> None:
        """Let smooth functions see a fixed time [s]: in a sweep, the time counts the points."""
        self._core.freeze_time(time)

    def follow_path(self, by_rate: bool, correctors: int | None = None) -> None:
        """Follow the path of solutions by Euler-Newton steps at the points of a static system.

        Parameters
        ----------
        by_rate : bool
            The predictor takes the rate of the sources at the old point instead of their value at
            the new one.
        correctors : int, optional
            Newton steps after the predictor: 1, or 3 if a function has kinks.
        """
        self._core.follow_path(by_rate, correctors)
