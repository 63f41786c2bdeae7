r"""Current and charge of a junction as broken lines, with as many pieces as a tolerance needs.

The current behind the ohmic resistance is a convex function of the voltage across both
(:mod:`.broken_curve`).  Its scale is the current at which the ohmic resistance is as large as the
junction's own, :math:`n V_t / R_s`; above it a difference relative to the current is allowed, and a
few pieces are enough for currents of any size: the last one, nearly that of the resistance alone,
goes on for ever.  Breakdown is such a curve in the other direction.  The charge of the depletion
layer has the scale of what it takes to the largest reverse voltage; that of diffusion follows the
line of the current.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

from .broken_curve import BrokenCurve, Curve, Knot, Law, last_good
from .junction import Junction, depletion_charge
from .number_tape import NumberTape

#: currents without ohmic resistance are followed up to so many times their scale
_RANGE = 1e3
#: thermal voltages beyond the last knot up to which the charge is followed
_BEYOND = 10.0
#: reverse voltages, as multiples of the usual one, up to which the charge is followed
_FAR = 10.0


class Settings(NamedTuple):
    """How junctions become lines.

    Parameters
    ----------
    tolerance : float
        Largest difference, relative to the scale or to the curve itself, if that is larger.
    current : float
        Scale of currents without ohmic resistance [A].
    voltage : float
        Largest reverse voltage, as far as the deck says it [V].
    """

    tolerance: float
    current: float
    voltage: float


class JunctionLines(NamedTuple):
    """Current and charge of one junction as lines.

    Parameters
    ----------
    current, depletion : BrokenCurve
    transit : float
        [s]
    scales : tuple of float
        Of the differences of current [A] and of charge [A s].
    highest, lowest : float
        Current [A] and reverse voltage [V] up to which they are bounded.
    """

    current: BrokenCurve
    depletion: BrokenCurve
    transit: float
    scales: tuple[float, float]
    highest: float
    lowest: float

    @property
    def error(self) -> float:
        """Largest difference of either."""
        return max(self.current.error, self.depletion.error)

    def charge(self, v: float) -> float:
        """Return the charge at a voltage [A s]."""
        return self.depletion.at(v) + self.transit * self.current.at(max(v, 0.0))


@lru_cache(maxsize=256)
def junction_lines(junction: Junction, settings: Settings) -> JunctionLines:
    """Return a junction as lines.

    Parameters
    ----------
    junction : Junction
    settings : Settings

    Raises
    ------
    ValueError
        If the tolerance asks for too many pieces.

    Examples
    --------
    >>> from nsspice.devices.diodes.junction import JunctionLaw
    >>> from nsspice.devices.stamper import Conditions
    >>> junction = JunctionLaw(rs=0.1).at(Conditions(), None, 0.0)
    >>> lines = junction_lines(junction, Settings(0.05, 1.0, 10.0))
    >>> len(lines.current.forward), round(lines.scales[0], 4)
    (4, 0.2586)
    >>> lines.error <= 0.05 * (1 + 1e-9)
    True
    """
    tolerance, ohms, tape = settings.tolerance, junction.resistance, NumberTape()
    scale = junction.slope / ohms if ohms else settings.current
    # what flows in the reverse direction is within the tolerance
    scale = max(scale, (junction.current + junction.recombination) / tolerance)
    # relative differences of the last piece approach the tolerance from there on
    highest = scale * (16.0 / tolerance**2 if ohms else _RANGE)

    def branch(law: Law) -> tuple[list[Knot], float]:
        curve = Curve(law, 1.0, scale, tolerance, ohms)
        return curve.knots(0.0, _voltage_of(law, highest), not ohms)

    forward, error = branch(lambda v: junction.write_current(tape, v))
    reverse: list[Knot] = []
    if junction.breakdown is not None:
        reverse, other = branch(lambda v: -junction.write_current(tape, -v))
        error = max(error, other)
    line = BrokenCurve(0.0, tuple(forward), _mirrored(reverse), error)
    top = max(knot.place for knot in forward) + _BEYOND * junction.slope
    breaks = math.inf if junction.breakdown is None else junction.low[2]
    depletion, stored = _depletion(junction, settings, top, breaks)
    return JunctionLines(
        line, depletion, junction.transit, (scale, stored + junction.transit * scale),
        math.inf if ohms else highest, min(_FAR * settings.voltage, breaks),
    )  # fmt: skip


def _mirrored(knots: list[Knot]) -> tuple[Knot, ...]:
    return tuple(knot._replace(place=-knot.place) for knot in knots)


def _depletion(
    junction: Junction, settings: Settings, top: float, breaks: float
) -> tuple[BrokenCurve, float]:
    """Return the charge of the depletion layer as a line, and its scale [A s]."""
    shape = junction.capacitance, junction.potential, junction.grading, junction.bend
    if not junction.capacitance:
        return BrokenCurve(0.0, (), (), 0.0), 0.0
    usual, lowest = (min(factor * settings.voltage, breaks) for factor in (1.0, _FAR))
    scale = -depletion_charge(-usual, *shape)
    behind = Curve(lambda v: -depletion_charge(-v, *shape), -1.0, scale, settings.tolerance)
    slope = behind.first_slope(usual)
    reverse, one = behind.knots(slope, lowest, lowest < breaks)
    ahead = Curve(lambda v: depletion_charge(v, *shape), 1.0, scale, settings.tolerance)
    forward, two = ahead.knots(slope, top, False)
    return BrokenCurve(slope, tuple(forward), _mirrored(reverse), max(one, two)), scale


def _voltage_of(current: Law, value: float) -> float:
    """Return the voltage at which a junction carries a current."""
    high = 1.0
    while current(high) < value:
        high *= 2.0
    return last_good(lambda v: current(v) <= value, 0.0, high)
