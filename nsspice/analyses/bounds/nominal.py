"""The orbit in the middle of a box: which modes follow each other, and when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...problems.csc import Floats
from ...problems.descriptor import Functional
from ...solvers.modewise import NotModewise
from ...solvers.orbit import NoDerivative, PeriodMap
from ..averages.integrals import Course
from ..gradients.carried import Lost
from ..solution.solution import Solution

#: shorter segments, as parts of the period, are parts of one event
_INSTANT = 1e-11


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the orbit without events.

    Parameters
    ----------
    start : float
        [s]
    active : frozenset of int
        Pairs that conduct.
    first, last : ndarray, shape (n,)
        All unknowns at its ends.
    """

    start: float
    active: frozenset[int]
    first: Floats
    last: Floats


@dataclass(frozen=True, slots=True)
class Nominal:
    """An orbit as the exact engine has found it.

    Parameters
    ----------
    course : Course
    sections : list of Section
    stop : float
        [s]
    """

    course: Course
    sections: list[Section]
    stop: float


def nominal_of(solution: Solution, island: int) -> Nominal:
    """Return the orbit of an island of a periodic steady state.

    Raises
    ------
    Lost
        If it is not one that the exact engine has found, driven by sources.
    """
    if solution.integrals is None:
        raise Lost("the steady state was found by steps, without a closed form")
    if island in solution.integrals.driven:
        raise Lost("an island that another one drives is run by steps")
    course = solution.integrals.course(island)
    if course.stop is None:
        raise Lost("a circuit with a free period (trigger=)")
    n = course.system.n
    system = course.system
    outputs = [Functional(z=((j, 1.0),)) for j in range(n)]
    try:
        period_map = PeriodMap(system, course.stop, outputs)
        period_map.run(course.state)
    except (NotModewise, NoDerivative) as problem:
        raise Lost(f"the run has no closed form: {problem}") from problem
    events = period_map.core.commutations(True)
    sections = []
    ends = [*(e[0] for e in events[1:]), course.stop]
    for k, (time, _, after, _, active) in enumerate(events):
        if ends[k] - time > _INSTANT * course.stop:
            before = events[(k + 1) % len(events)][1]
            sections.append(Section(time, frozenset(active), np.array(after), np.array(before)))
    return Nominal(course, sections, course.stop)
