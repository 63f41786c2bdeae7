"""What all implicit steps have in common: the compiled stepper, starts, records, failures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..problems.csc import Csc, Floats, weighted_sum
from ..problems.descriptor import DescriptorSystem, Functional, SmoothTerms
from .compiled import compiled, core_matrix
from .stepper import Jump, Stepper, UnsolvedStep, restless


class ImplicitStepper(Stepper):
    """Steps one descriptor system through time by implicit steps; how long, a plan says.

    Parameters
    ----------
    system : DescriptorSystem
    outputs : sequence of Functional
        One output column each, after the column of times.
    H, Hs : Csc, optional
        Averaging terms of Moreau's steps for theta < 1, shapes (n, n) and (n, p).
    """

    def __init__(
        self,
        system: DescriptorSystem,
        outputs: Sequence[Functional],
        *,
        H: Csc | None = None,
        Hs: Csc | None = None,
    ) -> None:
        self.H, self.Hs = H, Hs
        self._core: _core.Stepper
        core = _core.Stepper(
            compiled(system),
            None if H is None or Hs is None else (core_matrix(H), core_matrix(Hs)),
            [(f.z, f.lam, f.dz, f.u, f.f, f.df) for f in outputs],
        )
        super().__init__(system, core, 1 + len(outputs))

    def start_dc(self, time: float = 0.0, guess: tuple[Floats, Floats] | None = None) -> Floats:
        """Start from the static solution at ``time`` (E dropped), least norm where not unique.

        A source with an ideal edge at that time has the value before it; see ``leave_dc``.

        Parameters
        ----------
        time : float
            Time at which sources are taken [s].
        guess : (ndarray (n,), ndarray (m,)), optional
            Unknowns and multipliers to stay close to.

        Returns
        -------
        ndarray, shape (n,)
            The solution.

        Raises
        ------
        UnsolvedStep
            If the static equations have no solution.
        """
        failure = self._begin(lambda: self._core.start_dc(time, guess))
        if failure is not None:
            raise UnsolvedStep(failure["time"], failure["residual"], None)
        return self.state[0]

    def leave_dc(self) -> None:
        """Let the ideal edges of sources at the start act on the static solution: charges stay.

        Raises
        ------
        UnsolvedStep
            If no state satisfies all laws after the edges.
        """
        failure = self._core.leave_dc()
        if failure is not None:
            raise self._diagnose(failure) or UnsolvedStep(
                failure["time"], failure["residual"], None, failure["worst_row"]
            )

    def start_charges(
        self,
        time: float,
        charges: Floats,
        step: float,
        guess: tuple[Floats, Floats] | None = None,
    ) -> Jump | None:
        """Start from stored charges and fluxes E z(0-), shape (n,), by an impulsive step.

        Parameters
        ----------
        time : float
            [s]
        charges : ndarray, shape (n,)
            [C] and [V s]
        step : float
            Of steps to come [s].
        guess : (ndarray (n,), ndarray (m,)), optional
            Unknowns and multipliers to stay close to.

        Returns
        -------
        Jump or None
            What the start had to move, None if the values were consistent.

        Raises
        ------
        UnsolvedStep
            If no state satisfies all laws.
        """
        failure = self._begin(lambda: self._core.start_charges(time, charges, step, guess))
        if failure is not None:
            raise UnsolvedStep(failure["time"], failure["residual"], None, failure["worst_row"])
        return self._first_jump()

    def watch(self, every: int, window: int = 8, sides: bool = False) -> None:
        """Choose what is left for those who check the run; call it before the start.

        Parameters
        ----------
        every : int
            One of this many steps is recorded, 1 records all, 0 none.
        window : int
            Steps recorded from each change of mode, that change included.
        sides : bool
            Keep rows on both sides of jumps, for :meth:`take_sides`.
        """
        self._core.watch(every, window, sides)

    def take_records(self) -> _core.Records:
        """Return the steps recorded since the last call."""
        return self._core.take_records()

    def _begin(self, start: Callable[[], dict[str, Any] | None]) -> dict[str, Any] | None:
        """Start, again if what failed is proved to be no conflict; return the failure left."""
        failure = start()
        if failure is None:
            return None
        problem = self._diagnose(failure)
        if problem is not None:
            raise problem
        self._core.accept_large()
        return start()

    def _diagnose(self, failure: Mapping[str, Any]) -> UnsolvedStep | None:
        """Ask for a proof of infeasibility; None if the suspect solution proves genuine."""
        if failure["restless"] is not None:
            return restless(failure)
        system = self.system
        length = failure["length"]
        matrix = system.G
        if np.isfinite(length):
            terms = [(system.E, 1.0 / length), (system.G, 1.0)]
            matrix = weighted_sum(terms if self.H is None else [*terms, (self.H, 1.0)])
        A, B, rhs = system.A, system.B, failure["rhs"]
        if system.smooth is not None:
            matrix, A, B, rhs = freed(matrix, A, B, rhs, system.smooth)
        from .certificate import infeasibility

        certificate = infeasibility(matrix, A, B, system.D, rhs, system.q, failure["roles"])
        if certificate is None and failure["suspect"]:
            return None
        return UnsolvedStep(
            failure["time"],
            failure["residual"],
            certificate,
            failure["worst_row"],
            point=failure["point"],
        )

    @property
    def unbounded(self) -> tuple[int, float] | None:
        """The row of the first unknown that no step could follow, and when [s].

        A junction blocks at once when a winding has taken its last charge: nothing is left there
        that would bound the voltage.
        """
        return self._core.unbounded()

    @property
    def gates(self) -> list[bool]:
        """State of each switch's control: True above its thresholds."""
        return self._core.gates()


def freed(
    matrix: Csc, A: Csc, B: Csc, rhs: Floats, smooth: SmoothTerms
) -> tuple[Csc, Csc, Csc, Floats]:
    """Return the relations with every smooth function replaced by an unknown of its own.

    If they contradict each other, they do so for any functions.  Rows of zeros keep the
    matrix square.
    """
    n, p = smooth.F.shape
    size = n + p
    # a function and its rate are two quantities: one sum of both with weights that do not cancel
    F = weighted_sum([(smooth.F, 1.0), (smooth.Q, np.pi)])
    return (
        Csc.from_triplets(
            (size, size),
            np.concatenate([matrix.indices, F.indices]),
            np.concatenate([matrix.columns, F.columns + n]),
            np.concatenate([matrix.data, F.data]),
        ),
        Csc.from_triplets((size, A.shape[1]), A.indices, A.columns, A.data),
        Csc.from_triplets((B.shape[0], size), B.indices, B.columns, B.data),
        np.concatenate([rhs, np.zeros(p)]),
    )
