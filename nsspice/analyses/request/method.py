"""Which method a transient takes for an island: the most accurate that its equations allow."""

from __future__ import annotations

from typing import NamedTuple

from ...circuit import Circuit, Island, MnaSystem, ProblemClass
from ...devices.sources.delayed import Delayed
from ...problems.descriptor import DescriptorSystem
from ...solvers.modewise import refusal
from .path_following import PATH_METHODS
from .settings import Settings

#: Unknowns and pairs of an island up to which ``auto`` goes mode by mode.
AUTO_LIMIT = 300
#: Pairs times equations of an island up to which ``auto`` controls the error of steps: each change
#: of a pair is looked for by some solutions of all equations, so that this is what a run costs.
CONTROL_LIMIT = 2_000_000

#: How a static island is solved that is not treated mode by mode.
POINTS = "point by point"

_STATIC = {
    ProblemClass.LINEAR_ALGEBRAIC: "one linear system per point",
    ProblemClass.LCP: "one mixed linear complementarity problem per point, exact",
    ProblemClass.GE: "Newton's method on the generalized equation, point by point",
}
_FIXED = {
    ProblemClass.LINEAR_DAE: "implicit time steps with one factorisation",
    ProblemClass.DLCP: "Moreau time stepping, one mixed linear complementarity problem per step",
    ProblemClass.DNCP: "Moreau time stepping with Newton's method in each step",
}
_MODEWISE = (
    "the mode-wise engine: closed forms between switching instants, which are found to rounding"
)


class Choice(NamedTuple):
    """The name of a method, and why a better one is not taken if that needs a word."""

    name: str
    note: str = ""


def choose(kind: ProblemClass, system: DescriptorSystem, settings: Settings) -> Choice:
    """Return the method for a dynamic island.

    Parameters
    ----------
    kind : ProblemClass
    system : DescriptorSystem
    settings : Settings

    Examples
    --------
    >>> import nsspice
    >>> island = nsspice.read("RC\\nV1 a 0 1\\nR1 a b 1\\nC1 b 0 1").islands[0]
    >>> system = island.assemble().system
    >>> choose(island.problem_class, system, Settings()).name
    'modewise'
    >>> choose(island.problem_class, system, Settings(theta=0.5, stepped=True)).name
    'moreau'
    """
    note, controlled = "", kind is ProblemClass.DNCP
    if settings.method == "modewise":
        return Choice("modewise")
    if settings.method == "auto" and not settings.stepped and system.smooth is None:
        size = system.n + system.m
        if size > AUTO_LIMIT:
            controlled = system.m * size <= CONTROL_LIMIT
            better = "modewise is exact" if controlled else "sdirk controls the error"
            note = f"{size} unknowns and pairs: method={better}, but may take longer"
        elif reason := refusal(system):
            return unless_modewise(reason, settings)
        else:
            return Choice("modewise")
    return _stepping(controlled, note, settings)


def choose_static(system: DescriptorSystem, settings: Settings) -> Choice:
    """Return the method for a static island: mode by mode without a state, or point by point.

    Steps with error control, where they are asked for, find the instants at which pairs change.

    Examples
    --------
    >>> import nsspice
    >>> system = nsspice.read("divider\\nV1 a 0 1\\nR1 a 0 1").islands[0].assemble().system
    >>> choose_static(system, Settings()).name
    'modewise'
    """
    if settings.method == "sdirk" and system.m > 0:
        return Choice("sdirk")
    if settings.method not in ("auto", "modewise"):
        note = f"{settings.method} has no effect without stored energy"
        return Choice(POINTS, "" if settings.method in PATH_METHODS else note)
    if settings.method == "modewise":
        return Choice("modewise")  # or an error
    if system.smooth is not None:
        return Choice(POINTS)
    size = system.n + system.m
    if size > AUTO_LIMIT:
        note = f"{size} unknowns and pairs: method=modewise also finds switching instants"
        return Choice(POINTS, note)
    reason = refusal(system)
    return Choice("modewise") if reason is None else Choice(POINTS, f"not modewise: {reason}")


def unless_modewise(reason: object, settings: Settings) -> Choice:
    """Return the method for an island that the mode-wise engine refuses for a reason.

    Examples
    --------
    >>> unless_modewise("its windings are not passive", Settings()).name
    'sdirk'
    """
    return _stepping(True, f"not modewise: {reason}", settings)


def _stepping(controlled: bool, note: str, settings: Settings) -> Choice:
    """Return the kind of steps: a step or theta that is asked for means fixed ones."""
    free = settings.step is None and settings.theta == 1.0
    if settings.method == "sdirk" or (settings.method == "auto" and controlled and free):
        return Choice("sdirk", note)
    return Choice("moreau", note)


def describe(circuit: Circuit, island: Island, mna: MnaSystem) -> str:
    """Return how an island of a deck is solved, one clause.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read("RC\\nV1 a 0 1\\nR1 a b 1\\nC1 b 0 1\\n.options method=moreau")
    >>> describe(circuit, circuit.islands[0], circuit.islands[0].assemble())
    'implicit time steps with one factorisation'
    """
    kind, settings = island.problem_class, Settings.of(circuit.deck)
    if any(isinstance(device, Delayed) for device in island.devices):
        return f"steps of order {settings.order} with error control (sdirk), between delays"
    if kind in _STATIC:
        followed = settings.method in PATH_METHODS and kind is not ProblemClass.LINEAR_ALGEBRAIC
        if followed:
            return f"Euler-Newton tracking ({settings.method})"
        choice = choose_static(mna.system, settings)
        if choice.name == "modewise" and refusal(mna.system) is None:
            return _MODEWISE
        return f"{_STATIC[kind]} ({choice.note})" if choice.note else _STATIC[kind]
    choice = choose(kind, mna.system, settings)
    if choice.name == "modewise":
        return _MODEWISE
    text = _FIXED[kind]
    if choice.name == "sdirk":
        text = f"steps of order {settings.order} with error control (sdirk), events located"
    return f"{text} ({choice.note})" if choice.note else text
