"""The DC solution with which a stepper starts, from either of two forms of its equations.

At DC nothing flows into what is stored, and `.op` leaves it out, while a run in time keeps it.  The
solutions are the same, but not the order of elimination, nor the sums of laws of nodes that only
charges tie; where Newton's method takes a long way, it may find only one of the two.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ...problems.csc import Csc
from ...problems.descriptor import DescriptorSystem
from ...solvers.moreau import MoreauStepper
from ...solvers.stepper import Stepper, UnsolvedStep
from ..signals.curve import Floats


def without_storage(system: DescriptorSystem) -> DescriptorSystem:
    """Return the system in which capacitors are open and inductors short.

    Examples
    --------
    >>> import numpy as np
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> system = DescriptorSystem(one, one, none((1, 0)), none((0, 1)), none((0, 0)),
    ...     np.zeros(0), none((1, 0)), row_kind=np.zeros(1, np.uint8))
    >>> system.static, without_storage(system).static
    (False, True)
    """
    smooth = system.smooth
    if smooth is not None:
        smooth = replace(smooth, Q=Csc.zeros(smooth.Q.shape))
    return replace(system, E=Csc.zeros(system.E.shape), smooth=smooth)


def start_dc(
    stepper: Stepper,
    other: Callable[[], DescriptorSystem],
    guess: tuple[Floats, Floats] | None,
) -> Floats:
    """Start a stepper from the DC solution at time 0, and return its unknowns (n,).

    Parameters
    ----------
    stepper : Stepper
    other : callable
        Gives its system with what is stored if the stepper has none, and the other way round: if
        Newton's method fails, it may find a solution there, which is then the guess.
    guess : (ndarray (n,), ndarray (m,)) or None
        Unknowns and multipliers to stay close to.

    Raises
    ------
    UnsolvedStep
        If neither form shows a solution.
    """
    try:
        return stepper.start_dc(0.0, guess)
    except UnsolvedStep as problem:
        if problem.certificate is not None or problem.worst_row is None:
            raise
        system = other()
        if system.static == stepper.system.static:
            raise
        second = MoreauStepper(system, ())
        try:
            second.start_dc(0.0, guess)
            return stepper.start_dc(0.0, second.state)
        except UnsolvedStep:
            raise problem from None
