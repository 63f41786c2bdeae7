"""The laws of a circuit, checked at points of a run by code that shares nothing with its solver.

Any engine hands over points in blocks: unknowns z, multipliers, sources, and the rates of stored
charge and flux that its scheme gives.  Checked are

.. math::

    \\dot q + G z + A \\lambda = S u, \\qquad w = q_0 - B z + D \\lambda, \\qquad
    0 \\le \\lambda \\perp w \\ge 0

(Kirchhoff's laws and the element laws row by row, signs and products of the set-valued ones), each
relative to the currents and voltages that meet in it, and the sources u against the waveforms of
the deck.  The products are formed from the assembled
arrays in a module of the core of its own; no factor, map, scaling or residual of a solver takes
part.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .. import _core
from ..problems.csc import Csc, Floats
from ..problems.descriptor import DescriptorSystem
from .compiled import compiled, core_matrix
from .intervals import Recording
from .moreau import Recorded
from .stepper import Jump, Stepper, Turned


class Auditor:
    """Checks the points of one island.

    Parameters
    ----------
    system : DescriptorSystem
    H, Hs : Csc, optional
        Averaging terms of a theta scheme, shapes (n, n) and (n, p); its rates contain them.
    timed : bool
        The points belong to instants, at which sources have the values of their waveforms.

    Examples
    --------
    A current of 1 A into 2 Ohm gives 2 V; 3 V miss the law of currents by 0.5 of 1.5 + 1 A:

    >>> import numpy as np
    >>> from nsspice.solvers.moreau import Records
    >>> half, none = Csc.from_triplets((1, 1), [0], [0], [0.5]), Csc.zeros
    >>> system = DescriptorSystem(none((1, 1)), half, none((1, 0)), none((0, 1)), none((0, 0)),
    ...     np.zeros(0), Csc.from_triplets((1, 1), [0], [0], [1.0]), row_kind=np.zeros(1, np.uint8))
    >>> static, zero, one = np.full(1, np.inf), np.zeros((1, 1)), np.ones((1, 1))
    >>> for volts in 2.0, 3.0:
    ...     auditor = Auditor(system)
    ...     z, lam = volts * one, np.zeros((1, 0))
    ...     auditor.check(Records(static, static, z, zero, lam, one, zero, None))
    ...     print(auditor.result()["laws"])
    0.0
    0.2
    """

    def __init__(
        self,
        system: DescriptorSystem,
        H: Csc | None = None,
        Hs: Csc | None = None,
        timed: bool = False,
    ) -> None:
        self.system = system
        averaging = None
        if H is not None and Hs is not None and (H.data.size or Hs.data.size):
            averaging = (core_matrix(H), core_matrix(Hs))
        self._core = _core.Auditor(compiled(system), averaging, timed)

    def check(self, records: Recorded, frozen: float | None = None) -> None:
        """Take recorded steps into the worst errors.

        Parameters
        ----------
        records : Records, as an engine left them or made by hand
        frozen : float, optional
            The time that smooth functions see [s], if that of the records counts something else.
        """
        self._core.take_steps(records, frozen)

    def accompany(self, stepper: Stepper) -> None:
        """Let a stepper add up the energies of all its steps; call it before the run.

        The sums are made from the arrays of this auditor, and take a few numbers for any
        length of the run; :attr:`Stepper.balance` has their totals.
        """
        stepper.take_along(self._core)

    def check_intervals(self, intervals: Recording) -> None:
        """Take recorded intervals of continuous solutions into the worst errors."""
        self._core.take_intervals(intervals)

    def check_turns(self, turns: Sequence[Turned], tolerance: float = 0.0) -> None:
        """Take gates that have turned into the worst error of gates.

        Parameters
        ----------
        turns : sequence of tuple
            As a stepper reports them.
        tolerance : float
            To which the steps of the run know instants.
        """
        self._core.take_turns(turns, tolerance)

    def jump_error(
        self,
        moved: Floats,
        jump: Jump,
        stored: Floats,
        gave: float | None = None,
    ) -> float:
        """Return the relative balance error of charge and flux over a jump.

        What moved into each row, shape (n,), plus what impulses brought there vanishes, but for
        what the sources gave while it lasted; ``stored`` is the size of what was there.  In a
        passive network sources ``gave`` so much energy [J], and no impulse passes a pair that is
        open afterwards.
        """
        return self._core.jump_error(
            moved,
            stored,
            jump.before,
            jump.after,
            (jump.time, jump.length, jump.span),
            jump.sources,
            jump.unknowns,
            jump.multipliers,
            jump.functions,
            gave,
        )

    def result(self) -> dict[str, Any]:
        """Return worst errors, where they are, and how much was checked."""
        return self._core.result()
