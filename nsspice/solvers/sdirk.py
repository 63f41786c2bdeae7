"""Diagonally implicit Runge-Kutta steps with error control and located events.

Between two events the set of conducting pairs is fixed; a step consists of a few implicit stages
with one matrix.  Where a guard (a multiplier of a conducting pair, a slack of another one, the
distance of a switch to its threshold) becomes negative, the step is cut there, and the
complementarity problem of a very short implicit step finds the next mode.

References: R. Alexander, SIAM J. Numer. Anal. 14 (1977) 1006 (order 2); E. Hairer, G. Wanner,
Solving Ordinary Differential Equations II (1996), section IV.6 (order 4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from .. import _core
from ..problems.descriptor import DescriptorSystem, Functional
from ..problems.passivity import passive
from .compiled import compiled
from .implicit import ImplicitStepper
from .modewise import refusal

#: points of a polynomial: those of stored quantities have the degree five, laws may bend more
_POINTS = 8


@dataclass(frozen=True, slots=True)
class Accuracy:
    """What a run with error control is asked for.

    Parameters
    ----------
    reltol : float
        Error of one step relative to the largest value of each unknown so far; 1 or more takes
        steps of fixed length.
    vntol : float
        Error of one step that is always allowed for voltages [V].
    abstol : float
        The same for currents [A].
    order : int
        2 (two stages) or 4 (five stages).
    energy : bool
        Measure errors of what stores energy by the energy that the network exchanges.
    """

    reltol: float = 1e-5
    vntol: float = 0.0
    abstol: float = 0.0
    order: int = 4
    energy: bool = False


class SdirkStepper(ImplicitStepper):
    """Steps one descriptor system through time with error control.

    Used as :class:`~nsspice.solvers.moreau.MoreauStepper`; the step of ``plan`` is the longest one.

    Parameters
    ----------
    system : DescriptorSystem
    outputs : sequence of Functional
        One output column each, after the column of times.
    accuracy : Accuracy

    Examples
    --------
    A capacitor of 1 F discharged by 1 Ohm:

    >>> import numpy as np
    >>> from nsspice.problems import Csc
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> system = DescriptorSystem(one, one, none((1, 0)), none((0, 1)), none((0, 0)),
    ...     np.zeros(0), none((1, 0)), row_kind=np.zeros(1, np.uint8))
    >>> stepper = SdirkStepper(system, [Functional(z=((0, 1.0),))], Accuracy(reltol=1e-8))
    >>> _ = stepper.start_charges(0.0, np.array([1.0]), 1.0)
    >>> stepper.plan(0.0, 1.0, 1.0, 0.0, 1.0)
    2
    >>> rows, done = stepper.advance(10)
    >>> bool(abs(rows[1, 1] - np.exp(-1.0)) < 1e-8)
    True
    """

    def __init__(
        self,
        system: DescriptorSystem,
        outputs: Sequence[Functional],
        accuracy: Accuracy | None = None,
    ) -> None:
        super().__init__(system, outputs)
        self.accuracy = accuracy or Accuracy()

    def follow(self, outputs: Sequence[int], start: float, stop: float) -> None:
        """Record some outputs between the rows: polynomials of each step's continuous solution.

        Parameters
        ----------
        outputs : sequence of int
            Which outputs are to be followed, from 0 on.
        start, stop : float
            Between which instants [s].
        """
        self._core.keep_pieces(list(outputs), start, stop, _POINTS)

    def record_all(self) -> None:
        """Record each step, for :meth:`take_intervals`."""
        self._core.record_all()

    def take_intervals(self) -> _core.Intervals:
        """Return the steps recorded since the last call, with all their stages."""
        return self._core.take_intervals()

    def above_two(self) -> tuple[float, list[bool]] | None:
        """Return since when [s] a mode has had an index above 2, and its conducting pairs.

        The voltages of such a mode are second derivatives of sources; steps whose begin is not
        consistent with them err by more the shorter they are (Hairer and Wanner, chapter VII).
        The index is that of the exact engine's reduction.  Passive networks have none above 2 where
        nothing observes them, and constant sources no derivative: bodies that rest on each other
        are followed from impacts on.
        """
        found, system = self._core.visited(), self.system
        if not found or all(w.kind == "dc" for w in system.waveforms):
            return None
        core, gates = compiled(system), self.gates
        if refusal(system) is not None or core.dominant() or passive(system, observers=False):
            return None
        return next((mode for mode in found if core.above_two(mode[1], gates)), None)

    def _plan(
        self, start: float, stop: float, step: float, out_start: float, out_step: float
    ) -> int:
        a = self.accuracy
        return self._core.plan_sdirk(
            a.order, stop, step, out_start, out_step, a.reltol, a.vntol, a.abstol, a.energy
        )
