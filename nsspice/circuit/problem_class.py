"""Problem classes: what kind of mathematical problem a circuit is, from cheap to costly."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from ..devices.device import Device


class ProblemClass(Enum):
    """The cheapest class that fits is chosen and reported.

    Examples
    --------
    >>> ProblemClass.DLCP.value
    'dynamic linear complementarity problem'
    """

    LINEAR_ALGEBRAIC = "linear algebraic system"
    LCP = "linear complementarity problem"
    GE = "generalized equation"
    LINEAR_DAE = "linear differential-algebraic system"
    DLCP = "dynamic linear complementarity problem"
    DNCP = "dynamic nonlinear complementarity problem"


def classify(devices: Sequence[Device]) -> tuple[ProblemClass, str]:
    """Return the problem class of an island and the sentence that says why.

    Parameters
    ----------
    devices : sequence of Device

    Examples
    --------
    >>> classify([])[1]
    'no element stores energy, none is set-valued, all laws are linear'
    """
    storing = [d.name for d in devices if d.stores_energy]
    valued = [d.name for d in devices if d.pair_count]
    smooth = [d.name for d in devices if d.smooth]
    dynamic, pairs, laws = "no element stores energy", "none is set-valued", "all laws are linear"
    if storing:
        dynamic = f"{_list(storing)} store{_s(storing)} energy"
    if valued:
        pairs = f"{_list(valued)} {_are(valued)} set-valued"
    if smooth:
        laws = f"{_list(smooth)} {_are(smooth)} smooth and nonlinear"
    if valued and not smooth:
        laws = "all other laws are linear"
    reason = f"{dynamic}, {pairs}, {laws}"
    if smooth:
        return (ProblemClass.DNCP if storing else ProblemClass.GE), reason
    if valued:
        return (ProblemClass.DLCP if storing else ProblemClass.LCP), reason
    return (ProblemClass.LINEAR_DAE if storing else ProblemClass.LINEAR_ALGEBRAIC), reason


def _list(names: Sequence[str]) -> str:
    """Return up to four names, the rest counted."""
    if len(names) > 4:
        return f"{', '.join(names[:3])} and {len(names) - 3} more"
    return ", ".join(names[:-1]) + (" and " if len(names) > 1 else "") + names[-1]


def _s(names: Sequence[str]) -> str:
    return "s" if len(names) == 1 else ""


def _are(names: Sequence[str]) -> str:
    return "is" if len(names) == 1 else "are"
