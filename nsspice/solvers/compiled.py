"""Systems as the compiled core takes them: read once for all engines, checks and runs."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

from .. import _core
from ..problems.csc import Csc
from ..problems.descriptor import DescriptorSystem, SmoothTerms
from ..problems.elements import elements_of
from ..problems.tape import Tape

_KNOWN: WeakKeyDictionary[DescriptorSystem, _core.System] = WeakKeyDictionary()


def core_matrix(m: Csc) -> tuple[Any, ...]:
    """Return a matrix as the compiled core takes it."""
    return (m.shape[0], m.shape[1], m.indptr, m.indices, m.data)


def core_tape(tape: Tape) -> tuple[Any, ...]:
    """Return a tape as the compiled core takes it."""
    return (tape.ops, tape.args, tape.constants, tape.outputs)


def core_smooth(smooth: SmoothTerms) -> tuple[Any, ...]:
    """Return smooth terms as the compiled core takes them."""
    return (core_tape(smooth.tape), core_matrix(smooth.F), core_matrix(smooth.Q))


def compiled(system: DescriptorSystem) -> _core.System:
    """Return a system as the compiled core has read it, kept as long as the system is.

    Raises
    ------
    ValueError
        If its arrays do not fit together.
    """
    found = _KNOWN.get(system)
    if found is not None:
        return found
    matrices = (system.E, system.G, system.A, system.B, system.D)
    elements = elements_of(system)
    found = _KNOWN[system] = _core.System(
        (*map(core_matrix, matrices), system.q, core_matrix(system.S), system.row_kind),
        [(w.kind, w.values, w.repeat, w.scale, w.handed) for w in system.waveforms],
        [
            (
                s.pair,
                s.control,
                s.on_above,
                s.off_below,
                s.closed != s.inverted,  # the core keeps the state of the control
                s.inverted,
                s.latching,
                s.at_threshold,
            )
            for s in system.switches
        ],
        None if system.smooth is None else core_smooth(system.smooth),
        elements.capacitors,
        elements.conductors,
        elements.before,
    )
    return found


def shows_passive(system: DescriptorSystem) -> bool:
    """Return whether the arrays show that the network is passive: ``system.passive``, sooner.

    Examples
    --------
    >>> import numpy as np
    >>> from nsspice.problems import Csc
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> shows_passive(DescriptorSystem(one, one, none((1, 0)), none((0, 1)), none((0, 0)),
    ...     np.zeros(0), none((1, 0)), row_kind=np.zeros(1, np.uint8)))
    True
    """
    # most networks show it by their diagonals: eigenvalues take as long as the run of a small one
    return system.smooth is not None or compiled(system).dominant() or system.passive
