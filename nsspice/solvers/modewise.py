"""The exact mode-wise engine: its Python interface, for one descriptor system.

As long as the same pairs are active, a system of linear elements and complementarity pairs is a
linear descriptor system; the core reduces it once to a minimal set of states (the energy
coordinates that no loop or cut-set ties) and writes every segment in closed form,

.. math::

    g(t) = \\mathrm{Re} \\sum_k c_k e^{\\lambda_k t} + \\text{sources}, \\qquad
    \\lambda_k \\text{ the eigenvalues of the mode},

with the sources taken from absolute time.  What is left to search are the instants at which a
multiplier or a slack changes its sign; bounds of the fourth derivative prove that none is missed.
Where no mode can be proved (events that pile up) short implicit steps go on.

References: V. Acary, O. Bonnefon, B. Brogliato, Nonsmooth Modeling and Simulation for Switched
Circuits (Springer, 2011); A. J. van der Schaft, J. M. Schumacher, "Complementarity modeling of
hybrid systems", IEEE Trans. Automatic Control 43 (1998), doi:10.1109/9.664151.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from .. import _core
from ..problems.csc import Csc, Floats, weighted_sum
from ..problems.descriptor import DescriptorSystem, Functional, Handed
from ..problems.elements import Elements
from .compiled import compiled
from .moreau import MoreauStepper
from .stepper import Jump, Stepper, UnsolvedStep, restless

#: Unknowns and pairs together up to which a mode is reduced with dense matrices.
DENSE_LIMIT = 600
#: the same where all pairs have resistances in series: segments by series need no dense modes
SERIES_LIMIT = 2000
#: waveforms that solve a linear equation with constant coefficients, piece by piece
_LINEAR = frozenset({"dc", "pulse", "pwl", "sin", "exp", "held"})


class NotModewise(Exception):
    """A system that the mode-wise engine does not treat; the message is a clause."""


def refusal(system: DescriptorSystem, limit: int = DENSE_LIMIT) -> str | None:
    """Return why a system cannot be treated mode by mode, None if it looks as if it could.

    Parameters
    ----------
    system : DescriptorSystem
        The equations.
    limit : int
        Unknowns and pairs together that it may have.

    Examples
    --------
    >>> from nsspice.problems import Csc, Waveform
    >>> none = Csc.zeros
    >>> refusal(DescriptorSystem(none((0, 0)), none((0, 0)), none((0, 0)), none((0, 0)),
    ...     none((0, 0)), np.zeros(0), none((0, 1)), (Waveform("sffm", (0, 1, 1, 1, 1)),)))
    'an sffm source is not the solution of a linear equation'
    """
    if system.smooth is not None:
        return "smooth nonlinear elements have no closed form"
    for waveform in system.waveforms:
        if waveform.kind == "polynomial":
            return "it is driven by another block"
        if waveform.kind not in _LINEAR:
            return f"an {waveform.kind} source is not the solution of a linear equation"
    if system.n + system.m > limit:
        return f"{system.n} unknowns and {system.m} pairs are too many for dense matrices"
    return None


def symmetric_storage(system: DescriptorSystem) -> bool:
    """Return whether E is symmetric, as it is where no rate of a store controls anything.

    Examples
    --------
    >>> from nsspice.problems import Csc
    >>> none = Csc.zeros
    >>> one = Csc.from_triplets((2, 2), [0], [1], [1.0])
    >>> symmetric_storage(DescriptorSystem(one, none((2, 2)), none((2, 0)), none((0, 2)),
    ...     none((0, 0)), np.zeros(0), none((2, 0))))
    False
    """
    return system.E.transposes(system.E)


def row_operations(system: DescriptorSystem) -> Floats:
    r"""Return T for which T E is a symmetric projection, shape (n, n).

    With the singular value decomposition :math:`E = U \\Sigma V'` of rank r the product of E with
    :math:`T = V_r \\Sigma_r^{-1} U_r' + V_0 U_0'` is :math:`V_r V_r'`: the same equations in other
    combinations, whose states are the part of z on which E acts.
    """
    U, sizes, Vt = np.linalg.svd(system.E.dense())
    n = sizes.size
    kept = sizes > n * np.finfo(float).eps * sizes.max(initial=0.0)
    return np.asarray(Vt.T @ (np.where(kept, 1.0 / np.where(kept, sizes, 1.0), 1.0)[:, None] * U.T))


def with_rows(system: DescriptorSystem, T: Floats) -> DescriptorSystem:
    """Return a system with its rows multiplied by a regular matrix."""
    _, sizes, Vt = np.linalg.svd(system.E.dense())
    kept = sizes > sizes.size * np.finfo(float).eps * sizes.max(initial=0.0)
    E = Vt[kept].T @ Vt[kept]

    def rows(matrix: Csc) -> Csc:
        return Csc.from_dense(T @ matrix.dense())

    return replace(
        system,
        E=Csc.from_dense(0.5 * (E + E.T)),
        G=rows(system.G),
        A=rows(system.A),
        S=rows(system.S),
        row_kind=np.zeros(system.n, dtype=np.uint8),
        elements=Elements([], []),  # combinations of rows are not elements
    )


class ModewiseStepper(Stepper):
    """Integrates one descriptor system exactly, mode by mode.

    Used like :class:`~nsspice.solvers.moreau.MoreauStepper`: create, plan, start, then ``advance``
    until it is done.

    Parameters
    ----------
    system : DescriptorSystem
        Without smooth terms.  Where E is not symmetric its rows are combined so that it is.
    outputs : sequence of Functional
        One output column each, after the column of times.

    Raises
    ------
    NotModewise
        If the system cannot be treated.

    Examples
    --------
    A capacitor of 1 F discharged by 1 Ohm:

    >>> import numpy as np
    >>> from nsspice.problems import Csc, DescriptorSystem, Functional
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> system = DescriptorSystem(one, one, none((1, 0)), none((0, 1)), none((0, 0)),
    ...     np.zeros(0), none((1, 0)), row_kind=np.zeros(1, np.uint8))
    >>> stepper = ModewiseStepper(system, [Functional(z=((0, 1.0),))])
    >>> stepper.plan(0.0, 1.0, 1.0, 0.0, 1.0)
    2
    >>> _ = stepper.start_charges(0.0, np.array([1.0]), 1.0)
    >>> rows, done = stepper.advance(10)
    >>> rows.round(12).tolist()
    [[0.0, 1.0], [1.0, 0.367879441171]]
    """

    def __init__(self, system: DescriptorSystem, outputs: Sequence[Functional]) -> None:
        resistive = np.count_nonzero(system.D.data) >= system.m > 0
        reason = refusal(system, SERIES_LIMIT if resistive else DENSE_LIMIT)
        if reason is not None:
            raise NotModewise(reason)
        self._core: _core.Modewise
        #: what the rows of an unsymmetric system are multiplied with, None for others
        self._rows: Floats | None = None
        solved = system
        if not symmetric_storage(system):
            self._rows = row_operations(system)
            solved = with_rows(system, self._rows)
        try:
            core = _core.Modewise(compiled(solved), [(f.z, f.lam, f.dz, f.u) for f in outputs])
        except ValueError as error:
            raise NotModewise(str(error)) from error
        #: what the core solves: the same equations, in other combinations if E is not symmetric
        self._solved = solved
        super().__init__(system, core, 1 + len(outputs))

    def _plan(
        self, start: float, stop: float, step: float, out_start: float, out_step: float
    ) -> int:
        return self._core.plan(stop, out_start, out_step, step)

    def start_dc(self, time: float = 0.0, guess: tuple[Floats, Floats] | None = None) -> Floats:
        """Start from the static solution (E dropped), least norm where not unique.

        Ideal edges of sources at that time act on it at once.

        Returns
        -------
        ndarray, shape (n,)
            The static solution.

        Raises
        ------
        UnsolvedStep
            If the static equations have no solution.
        """
        static = MoreauStepper(self.system, ())
        static.watch(1)
        static.start_dc(time, guess)
        self.dc_records = static.take_records()
        self.dc_point = point, multipliers = static.state
        # where there may be several solutions, this is the one of its mode
        several = self.system.static or not self.system.passive
        active = (multipliers > 0.0).tolist() if several else None
        self._start(self.system.E.dot(point), static.gates, active)
        return point

    def start_charges(
        self,
        time: float,
        charges: Floats,
        step: float,
        guess: tuple[Floats, Floats] | None = None,
    ) -> Jump | None:
        """Start from stored charges and fluxes E z(0-), shape (n,), in the mode of a guess if any.

        Returns
        -------
        Jump or None
            What the start had to move, None if the values were consistent.

        Raises
        ------
        UnsolvedStep
            If no state satisfies all laws.
        """
        gates = self.gates_at_start(charges, step)
        self._start(charges, gates, None if guess is None else (guess[1] > 0.0).tolist())
        return self._first_jump()

    def gates_at_start(self, charges: Floats, step: float) -> list[bool]:
        """Return the states of the switches at 0+ of a run from charges and fluxes (n,).

        Parameters
        ----------
        charges : ndarray, shape (n,)
        step : float
            Of an implicit step [s], where more than sources decides.
        """
        gates = self._core.gates_by_sources()
        if gates is None:
            first = MoreauStepper(self.system, ())
            first.start_charges(0.0, charges, step)
            gates = first.gates
        return gates

    def start_given(self, charges: Floats, gates: list[bool]) -> Jump | None:
        """Start from stored charges and fluxes E z(0-), shape (n,), with known switch states."""
        self._start(charges, gates)
        return self._first_jump()

    def _start(self, charges: Floats, gates: list[bool], active: list[bool] | None = None) -> None:
        if self._rows is not None:
            charges = self._rows @ charges
        given = np.ascontiguousarray(charges, dtype=np.float64)
        failure = self._core.start(given, gates, active)
        if failure is not None:
            raise self._diagnose(failure)

    @property
    def gates(self) -> list[bool]:
        """Present states of the switches."""
        return self._core.gates()

    @property
    def beginning(self) -> tuple[Floats, Floats]:
        """Unknowns (n,) and multipliers (m,) at the begin of the present interval."""
        return self._core.beginning()

    def _diagnose(self, failure: Mapping[str, Any]) -> UnsolvedStep:
        """Ask for a proof of infeasibility."""
        if failure["restless"] is not None:
            return restless(failure)
        system = self._solved
        matrix = weighted_sum([(system.E, 1.0 / failure["length"]), (system.G, 1.0)])
        from .certificate import infeasibility

        certificate = infeasibility(
            matrix, system.A, system.B, system.D, failure["rhs"], system.q, failure["roles"]
        )
        reached = self.state[0]
        return UnsolvedStep(failure["time"], failure["residual"], certificate, point=reached)

    def watch(self, sides: bool) -> None:
        """Leave points for those who check the run; call it before the start.

        Parameters
        ----------
        sides : bool
            Keep rows on both sides of jumps too, for :meth:`take_sides`.
        """
        self._core.watch(True)
        self._core.keep_sides(sides)

    def take_along(self, auditor: _core.Auditor) -> None:
        """Let an auditor look at all segments, and balance their energy; call it before the start.

        Combined rows have no energies of their own: then the recorded points alone are balanced.
        """
        self._core.look_at_all(auditor)
        if self._rows is None:
            super().take_along(auditor)

    @property
    def looked_at(self) -> dict[str, Any] | None:
        """What an auditor has found in the segments up to now, None without one.

        The worst errors of ``complementarity``, ``gates`` and ``sources``, where they are
        (``worst_pair``, ``worst_gate``, ``worst_source``), and the numbers of ``points``, of
        segments that had to be ``judged``, and of mode equations ``factorised`` for that.
        """
        return self._core.looked_at()

    def follow(self, outputs: Sequence[int], start: float, stop: float) -> None:
        """Record some outputs between the rows: polynomials that equal closed forms to rounding.

        Parameters
        ----------
        outputs : sequence of int
            Which outputs are to be followed, from 0 on.
        start, stop : float
            Between which instants [s].
        """
        self._core.keep_pieces(list(outputs), start, stop)

    def hand_on(self, outputs: Sequence[int], to: Sequence[Handed]) -> None:
        """Hand some outputs on to other blocks; call it before the start.

        Parameters
        ----------
        outputs : sequence of int
            Which outputs, from 0 on.
        to : sequence of Handed
            They get each segment as soon as it is known to its end, accurate to rounding.
        """
        self._core.hand_on(list(outputs), list(to))

    def take_intervals(self) -> _core.Intervals:
        """Return the intervals of segments recorded since the last call."""
        return self._core.take_intervals()

    def take_references(self) -> Floats:
        """Return one of 16 rows inside segments once more, from the unknowns, (k, columns)."""
        return self._core.take_references().reshape(-1, self.columns)

    def take_records(self) -> _core.Records:
        """Return the implicit steps taken since the last call, where no mode could be proved."""
        return self._core.take_records()

    @property
    def active(self) -> list[bool]:
        """Which pairs conduct in the present segment, one entry per pair."""
        return self._core.active()

    @property
    def trouble(self) -> str | None:
        """Why some mode could not be reduced, None if all could."""
        return self._core.trouble()
