"""Responses of periodic orbits that were found by steps with error control.

One period is recorded with longer and with shorter steps, and differentiated as it is; the
order of the steps is four, so that halved steps show how far responses are off.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...problems.descriptor import Functional
from ...solvers.orbit import NoDerivative, State
from ...solvers.perturbed import Perturbed
from ...solvers.step_maps import Stimuli
from ...solvers.stepped_map import StepMap
from ...solvers.tangent import Tangent
from ..signals.curve import Floats
from .linearised import Complexes
from .steady_failure import no_derivative
from .steady_state import Orbit, Pss

#: steps are halved until responses change by less than this part
CLOSE = 1e-4
#: longest first steps in periods of the highest frequency
_COARSE = 1.0 / 32.0
_HALVINGS = 4
#: of the tolerance of the orbit: of the first steps; an error of order four falls so by halving
_LOOSE = 16.0
#: of the largest response of a signal: below, no digits are asked for
_LEAST = 1e-9
#: change by halved steps, as a part of responses or of the last change, of what is error alone
_ERROR = 0.5


class SteppedResponse:
    """The response of one orbit to stimuli at any frequencies.

    Parameters
    ----------
    orbit : Orbit
    outputs : sequence of Functional
    stimuli : Stimuli
    pss : Pss
    """

    def __init__(
        self, orbit: Orbit, outputs: Sequence[Functional], stimuli: Stimuli, pss: Pss
    ) -> None:
        self.orbit, self.outputs, self.stimuli, self.pss = orbit, outputs, stimuli, pss
        #: how far responses are off at most, relative
        self.error = 0.0
        self._highest = 0.0
        self._levels: dict[int, Perturbed] = {}

    def __call__(self, frequencies: Floats, multiples: Floats) -> Complexes:
        """Return responses, shape (frequencies, multiples, outputs, stimuli).

        Raises
        ------
        NumericalError
            NS3060 without a derivative.
        """
        highest = float(np.abs(frequencies).max(initial=0.0))
        highest += float(np.abs(multiples).max(initial=0.0)) / self.orbit.found.period
        if highest > self._highest:
            self._highest = highest
            self._levels.clear()
        s = (2j * np.pi * frequencies).astype(np.complex128)
        found, change, moved = self.at(0).responses(s, multiples), math.inf, None
        for level in range(1, _HALVINGS + 1):
            before, found, last = found, self.at(level).responses(s, multiples), change
            change, moved = _change(before, found, moved)
            if change <= CLOSE:
                break
            if change >= last:
                # rounding: shorter steps have made it worse
                found, change = before, last
                break
        self.error = max(self.error, change / (_LOOSE - 1.0))
        return found

    def at(self, level: int) -> Perturbed:
        """Return the linearised orbit, of steps halved ``level`` times.

        Raises
        ------
        NumericalError
            NS3060 without a derivative.
        """
        if level in self._levels:
            return self._levels[level]
        orbit = self.orbit
        period, share = orbit.found.period, 0.5**level
        longest = period
        if self._highest:
            longest = _COARSE * share / self._highest
        step_map = StepMap(orbit.mna.system, period, orbit.accuracy)
        fine = step_map.fine
        step_map.fine = replace(fine, reltol=max(fine.reltol * _LOOSE * share**4, 1e-13))
        gates = orbit.found.state.gates[: len(orbit.mna.system.switches)]
        try:
            state = State(orbit.found.charges, gates)
            record = step_map.recorded(state, period, min(longest, period)).steps
            tangent = Tangent(orbit.mna.system, record, orbit.found.charges)
            made = Perturbed(tangent, self.stimuli, self.outputs)
        except NoDerivative as problem:
            raise no_derivative(problem, orbit.mna, self.pss.span) from problem
        self._levels[level] = made
        return made

    @property
    def finest(self) -> Perturbed:
        """The one with the shortest steps up to now."""
        return self._levels[max(self._levels)]


def _change(before: Complexes, after: Complexes, moved: Floats | None) -> tuple[float, Floats]:
    """Return by which part responses differ at most, and by how much those of each signal.

    Where that does not fall from what it was before (``moved``) it is rounding.
    """
    size = np.abs(after)
    with np.errstate(invalid="ignore"):
        change = np.abs(after - before)
    largest = size.max(axis=(0, 1), initial=0.0)
    # what shows nothing but errors of the steps is zero
    moves: Floats = change.max(axis=(0, 1), initial=0.0)
    error = _ERROR * largest if moved is None else _ERROR * np.minimum(largest, moved)
    zero = moves >= error
    zero &= largest <= CLOSE * largest.max(initial=0.0)
    least = np.maximum(_LEAST * largest, np.where(zero, np.inf, 0.0))
    parts = change / np.maximum(size, np.where(least > 0.0, least, 1.0))
    return float(np.nan_to_num(parts, nan=0.0).max(initial=0.0)), moves
