"""Jumps of stored charge and flux: what moved, through which elements, at what cost in energy."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...circuit import MnaSystem
from ...problems.csc import Csc
from ...problems.descriptor import DescriptorSystem
from ...solvers.moreau import function_values
from ...solvers.stepper import Jump
from ..results.jumps import Impulse, JumpReport, Moved
from ..signals.curve import Floats

#: Impulses below this share of the largest of a jump are rounding.
_SHARE = 1e-6
#: A jump is reported if what a store holds, as the root of its energy, changes by more than this
#: share of the largest: a small capacitor next to large ones counts.
_NOTICED = 1e-8
#: A change of what a store holds by this share of the largest of its kind is rounding.
_ROUNDING = 1e-13
#: An impulse is more than what ordinary currents and voltages carry in this part of a step.
_INSTANT = 1e-6
#: Elements across which a flux impulse is reported: those that can hold any voltage.
_HOLD = frozenset("disw")
#: Controlled sources whose currents pass on the impulses of their controls.
_DRIVE = frozenset("fg")


def jumps_of(
    mna: MnaSystem,
    jumps: Sequence[Jump],
    step: float,
    state: tuple[Floats, Floats],
    start: tuple[Floats, float] | None = None,
    tolerance: float = 0.0,
    initial: Mapping[str, float] | None = None,
) -> list[JumpReport]:
    """Return what moved in each jump, and the impulses of elements that moved it.

    Parameters
    ----------
    mna : MnaSystem
    jumps : sequence of Jump
    step : float
        Solver step [s].
    state : (ndarray, ndarray)
        Unknowns and multipliers at the end: what ordinary values look like.
    start : (ndarray, float), optional
        Charges and fluxes (n,) from which the run started, and their energy [J]; a first jump
        begins there.
    tolerance : float
        A jump that changes no store by more than this part of what it holds is not reported: where
        the laws of a mode tie stores, it mends the error of the steps before.
    initial : mapping, optional
        Voltages of nodes by name with which the run began [V], for capacitors without ``IC=``.
    """
    system = mna.system
    is_current = np.array([name.startswith("i(") for name in mna.unknowns], dtype=bool)
    ordinary = np.max(np.abs([state[0], *(jump.before for jump in jumps)]), axis=0, initial=0.0)
    currents = float(np.max(np.append(ordinary[is_current], np.abs(state[1])), initial=0.0))
    voltages = float(np.max(ordinary[~is_current], initial=0.0))
    weights = _weights(system)
    held = weights * system.E.dot(ordinary)
    found = []
    for number, jump in enumerate(jumps):
        charges, energy = start_of(mna, jump, start if number == 0 else None)
        linear = system.E.dot(jump.after)
        after = linear + stored_functions(mna, jump, jump.after)
        moved, size = np.abs(after - charges), np.maximum(np.abs(after), np.abs(charges))
        if np.all(moved <= tolerance * size):
            continue
        impulses: list[Impulse] = []
        jumped = False
        for kind, usual in ((0, currents), (1, voltages)):
            rows = system.row_kind == kind
            amount = float(np.max(moved[rows], initial=0.0))
            change = float(np.max((weights * moved)[rows], initial=0.0))
            least = _NOTICED * float(np.max((weights * size)[rows], initial=0.0))
            # the start from an operating point moves rounding of zero charges
            least = max(least, _ROUNDING * float(np.max(np.abs(held)[rows], initial=0.0)))
            if change <= least or amount <= _INSTANT * step * usual:
                continue
            jumped = True
            items = _charges(mna, jump) if kind == 0 else _fluxes(mna, jump, after - charges)
            impulses += [
                Impulse(jump.time, name, value, "A s" if kind == 0 else "V s")
                for name, value in items
                if abs(value) > _SHARE * amount
            ]
        if jumped:
            reached, given = system.stored_energy(jump.after), delivered(mna, jump)
            stores = _stores(mna, jump, charges, after, initial or {})
            found.append(JumpReport(jump.time, energy, reached, given, stores, impulses))
    return found


def shared_at_start(
    mna: MnaSystem, given: Mapping[str, float], reached: Floats, energy: float
) -> JumpReport | None:
    """Return what is lost where capacitors in parallel begin with unequal voltages.

    The sum of their charges stays, ``(C1 + C2) v = C1 v1 + C2 v2``: no law sees a jump.

    Parameters
    ----------
    mna : MnaSystem
    given : mapping
        Initial voltages of nodes by name [V], for capacitors without ``IC=``.
    reached : ndarray, shape (n,)
        The state with which the run begins.
    energy : float
        Of the capacitors and inductors by their initial values [J].
    """
    left = mna.system.stored_energy(reached)
    if not energy - left > _ROUNDING * energy:
        return None
    stores, initial = [], mna.initial_voltages(given)
    for store in mna.capacitors:
        old = initial[store.name]
        new = sum(c * float(reached[j]) for j, c in store.functional.z)
        if abs(new - old) > _SHARE * max(abs(new), abs(old)):
            stores.append(Moved(store.name, store.value * old, store.value * new, "A s"))
    return JumpReport(0.0, energy, left, 0.0, stores, []) if stores else None


def _weights(system: DescriptorSystem) -> Floats:
    """Return what charges and fluxes (n,) are measured by: ``1 / sqrt(E_ii)``, or all alike.

    Smooth laws store charges of their own, of which E knows nothing.
    """
    weights = np.ones(system.n)
    if system.smooth is None:
        own = system.E.diagonal()
        weights[own > 0.0] = 1.0 / np.sqrt(own[own > 0.0])
    return weights


def start_of(
    mna: MnaSystem, jump: Jump, start: tuple[Floats, float] | None
) -> tuple[Floats, float]:
    """Return charges and fluxes (n,) before a jump, and their energy [J]."""
    if start is not None and not np.any(jump.before):
        return start
    charges = mna.system.E.dot(jump.before)
    energy = mna.system.stored_energy(jump.before)
    return charges + stored_functions(mna, jump, jump.before), energy


def stored_functions(mna: MnaSystem, jump: Jump, z: Floats) -> Floats:
    """Return the charges and fluxes (n,) of smooth laws on one side of a jump."""
    smooth = mna.system.smooth
    if smooth is None or not smooth.Q.data.size:
        return np.zeros(mna.system.n)
    time = np.array([jump.time])
    values = function_values(smooth.tape, z[None, :], jump.sources[None, :], time)
    return smooth.Q.dot(values[0])


def delivered(mna: MnaSystem, jump: Jump) -> float:
    """Return the energy that the sources give during a jump [J]."""
    with np.errstate(over="ignore", invalid="ignore"):  # beyond the range of numbers: infinite
        return float(jump.unknowns @ mna.system.S.dot(jump.sources))


def followed(observing: Csc, jump: Jump) -> float:
    """Return the energy that controlled sources give which follow sources [J].

    With impulses Z and the state z after the jump it is ``-(Z'M z + z'M Z)`` of their laws M.
    """
    if not observing.data.size:
        return 0.0
    impulses, after = jump.unknowns, jump.after
    with np.errstate(over="ignore", invalid="ignore"):
        return -float(impulses @ observing.dot(after) + after @ observing.dot(impulses))


def _charges(mna: MnaSystem, jump: Jump) -> Iterator[tuple[str, float]]:
    """Yield the charges that passed through set-valued elements and current branches [A s]."""
    yield from zip(mna.pairs, jump.multipliers.tolist(), strict=True)
    states = {f"i({store.name})" for store in mna.inductors}
    for name, value in zip(mna.unknowns, jump.unknowns.tolist(), strict=True):
        # the current of an inductor jumps, it has no impulse; nobody asks for those inside elements
        if name.startswith("i(") and name not in states and "#" not in name:
            yield name[2:-1], value
    for device in mna.devices:
        if device.letter in _DRIVE:
            current = mna.functional(f"i({device.name})")
            value = sum(c * float(jump.unknowns[j]) for j, c in current.z)
            yield device.name, value + sum(c * float(jump.multipliers[i]) for i, c in current.lam)


def _fluxes(mna: MnaSystem, jump: Jump, change: Floats) -> Iterator[tuple[str, float]]:
    """Yield the flux across inductors, and across what cut their current [V s]."""
    for store in mna.inductors:
        yield store.name, float(change[mna.layout.branches[store.name]])
    for device in mna.devices:
        if device.letter in _HOLD:
            terms = mna.layout.voltage(*device.ends)
            yield device.name, sum(c * float(jump.unknowns[j]) for j, c in terms)


def _stores(
    mna: MnaSystem, jump: Jump, charges: Floats, after: Floats, initial: Mapping[str, float]
) -> list[Moved]:
    """Return charge (flux) of each capacitor (inductor) that the jump changed.

    The flux of a winding is that of all currents that share it.
    """
    begun = np.linalg.norm(jump.before) > 0.0
    given = {} if begun else mna.initial_voltages(initial)
    capacitors, inductors = [], []
    for store in mna.capacitors:
        old, new = (
            store.value * sum(c * float(z[j]) for j, c in store.functional.z)
            for z in (jump.before, jump.after)
        )
        if not begun:  # the run begins with this jump: the initial value of the deck
            old = store.value * given[store.name]
        capacitors.append(Moved(store.name, old, new, "A s"))
    for store in mna.inductors:
        row = mna.layout.branches[store.name]
        inductors.append(Moved(store.name, float(charges[row]), float(after[row]), "V s"))
    out = []
    for moved in capacitors, inductors:
        largest = max((max(abs(m.before), abs(m.after)) for m in moved), default=0.0)
        for m in moved:
            size = max(abs(m.before), abs(m.after))
            if abs(m.after - m.before) > max(_SHARE * size, _ROUNDING * largest):
                out.append(m)
    return out
