"""Jumps of stored charge and flux, told as impulses of elements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..circuit import MnaSystem
from ..solvers.moreau import Jump
from .curve import Floats
from .solution import Impulse

#: Jumps and impulses below this share of the largest of their kind are rounding.
_SHARE = 1e-6
#: An impulse is more than what ordinary currents and voltages carry in this part of a step.
_INSTANT = 1e-6


def impulses_of(
    mna: MnaSystem,
    jumps: Sequence[Jump],
    step: float,
    state: tuple[Floats, Floats],
    charges: Floats | None = None,
) -> list[Impulse]:
    """Return what passed through set-valued elements and current branches, and across nodes.

    Parameters
    ----------
    mna : MnaSystem
    jumps : sequence of Jump
    step : float
        Solver step [s].
    state : (ndarray, ndarray)
        Unknowns and multipliers at the end: what ordinary values look like.
    charges : ndarray, shape (n,), optional
        Charges and fluxes from which the run started; a first jump begins there.
    """
    system = mna.system
    states = {f"i({store.name})" for store in mna.inductors}
    is_current = np.array([name.startswith("i(") for name in mna.unknowns], dtype=bool)
    ordinary = np.max(np.abs([state[0], *(jump.before for jump in jumps)]), axis=0, initial=0.0)
    currents = float(np.max(np.append(ordinary[is_current], np.abs(state[1])), initial=0.0))
    voltages = float(np.max(ordinary[~is_current], initial=0.0))
    found: list[Impulse] = []
    for number, jump in enumerate(jumps):
        after = system.E.dot(jump.after)
        from_start = number == 0 and charges is not None and not np.any(jump.before)
        before = charges if from_start and charges is not None else system.E.dot(jump.before)
        moved, size = np.abs(after - before), np.maximum(np.abs(after), np.abs(before))
        for unit, kind, usual in (("A s", 0, currents), ("V s", 1, voltages)):
            rows = system.row_kind == kind
            amount = float(np.max(moved[rows], initial=0.0))
            least = _SHARE * float(np.max(size[rows], initial=0.0))
            if amount <= max(least, _INSTANT * step * usual):
                continue
            if kind == 0:
                items = [*zip(mna.pairs, jump.multipliers.tolist(), strict=True)]
                items += [
                    (mna.unknowns[j][2:-1], float(jump.unknowns[j]))
                    for j in np.flatnonzero(is_current)
                    # the current of an inductor jumps, it has no impulse
                    if mna.unknowns[j] not in states
                ]
            else:
                items = [
                    (mna.unknowns[j], float(jump.unknowns[j])) for j in np.flatnonzero(~is_current)
                ]
            found += [
                Impulse(jump.time, name, value, unit)
                for name, value in items
                if abs(value) > _SHARE * amount
            ]
    return found
