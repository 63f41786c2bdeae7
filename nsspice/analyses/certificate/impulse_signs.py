"""Signs of the impulses of a jump: what passes pairs, and what they hold off.

Over a jump a pair obeys the law of its element in impulses: a charge passes it forward only, an
impulse of voltage is across it backward only, and never both.  A mode that was entered with an
impulse of the wrong sign balances all charges and fluxes, and is wrong.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...problems.csc import Floats
from ...problems.descriptor import DescriptorSystem
from ...solvers.stepper import Jump
from .charge_paths import unexplained
from .energy import worse
from .written_rows import KNOWN, TOLERANCE


def impulse_error(system: DescriptorSystem, jumps: Sequence[Jump], turned: float) -> float:
    """Return the largest impulse of a wrong sign in jumps in closed form.

    Each is relative to the impulses that meet in its pair, but to no less than the charge (flux)
    that all of the energy would be: what rounding makes of that is not an impulse.  Limits of short
    steps hold what ordinary values carry meanwhile, and are left out.  A switch may be open or
    closed: of the two impulses of its pair one vanishes.

    Parameters
    ----------
    system : DescriptorSystem
    jumps : sequence of Jump
    turned : float
        What the run has moved, next to which charges and fluxes are rounded [J].
    """
    exact = [jump for jump in jumps if jump.length == 0.0]
    kinds = np.asarray(system.row_kind)
    # pairs whose multipliers are currents: charges pass them
    charged = system.A.abs().dot(np.ones(system.m))[kinds == 1]
    if not exact or not system.m or charged.any():
        return 0.0
    own = system.E.diagonal()
    largest = [float(np.max(own[kinds == kind], initial=0.0)) for kind in (0, 1)]
    switched = np.zeros(system.m, dtype=bool)
    switched[list(system.switched)] = True
    conducting, series = system.B.abs(), system.D.abs()
    known = [KNOWN * math.sqrt(2.0 * turned * store) for store in largest]
    rounding = known[0], known[1] * _gain(system)
    worst = 0.0
    for jump in exact:
        charges, impulses = jump.multipliers, jump.unknowns
        held_off = system.D.dot(charges) - system.B.dot(impulses)
        sizes = conducting.dot(np.abs(impulses)) + series.dot(np.abs(charges))
        energy = max(system.stored_energy(jump.before), system.stored_energy(jump.after), 0.0)
        # the charge and the flux that all the energy would be in the largest store
        charge, flux = (math.sqrt(2.0 * energy * store) for store in largest)
        charges, held_off = _beyond(charges, rounding[0]), _beyond(held_off, rounding[1])
        passed = _share(charges, max(float(np.max(np.abs(charges), initial=0.0)), charge))
        held = _share(held_off, np.maximum(sizes, flux)) if flux > 0.0 else np.zeros(system.m)
        both = np.minimum(np.abs(passed), np.abs(held))
        wrong = np.where(switched, both, np.maximum(np.maximum(-passed, -held), both))
        found = float(np.max(wrong, initial=0.0))
        passed_gaps = _through_gaps(system, jump, rounding[0])
        if passed_gaps > TOLERANCE:
            worst = passed_gaps if worse(passed_gaps, worst) else worst
        if found > TOLERANCE:
            # in loops of pairs impulses are not unique: one set of right signs is enough
            moved = -system.A.dot(jump.multipliers) - _through_branches(system, jump.unknowns)
            found = min(found, max(unexplained(system, moved, jump.after), float(np.max(-held))))
        worst = found if worse(found, worst) else worst
    return worst


def _through_gaps(system: DescriptorSystem, jump: Jump, rounding: float) -> float:
    """Return the largest charge that has passed a pair which blocks right after the jump.

    Charges are relative to those that meet at the nodes of the pair, and its voltage to their
    potentials and the threshold: small capacitors next to large ones count in full.
    """
    kinds = np.asarray(system.row_kind)
    conducting, across = system.B.abs(), system.B.dot(jump.after)
    moved = system.E.abs().dot(np.abs(jump.before) + np.abs(jump.after))
    meeting = conducting.dot(moved + system.A.abs().dot(np.abs(jump.multipliers)))
    sides = np.abs(jump.before) + np.abs(jump.after)
    volts = np.abs(system.q) + conducting.dot(sides)
    # an equation among n after elimination, of the largest voltage that is there or has gone
    own = system.E.diagonal()
    gone = _share(system.A.abs().dot(np.abs(jump.multipliers)), own)
    largest = float(np.max((sides + gone)[kinds == 0], initial=0.0))
    noise = 24.0 * system.n * 0.5 * float(np.finfo(float).eps) * largest
    charges = _beyond(jump.multipliers, rounding)
    slack = _beyond(system.q - across, noise)
    both = np.minimum(np.abs(_share(charges, meeting)), np.abs(_share(slack, volts)))
    # a pair with a resistance has a voltage of its own, and a switch may be open or closed
    both[system.D.abs().dot(np.ones(system.m)) > 0.0] = 0.0
    both[list(system.switched)] = 0.0
    return float(np.max(both, initial=0.0))


def _gain(system: DescriptorSystem) -> float:
    """Return the largest gain of a voltage: a controlled source makes so much of rounding, too."""
    kinds = np.asarray(system.row_kind)
    laws, size = system.G, np.abs(system.G.data)
    own = (kinds[laws.indices] == 1) & (kinds[laws.columns] == 0)
    rows, size = laws.indices[own], size[own]
    largest, least = np.zeros(system.n), np.full(system.n, np.inf)
    np.maximum.at(largest, rows, size)
    np.minimum.at(least, rows, size)
    return float(np.max(largest / least, initial=1.0))


def _through_branches(system: DescriptorSystem, impulses: Floats) -> Floats:
    """Return the charges that impulses of branch currents bring to nodes."""
    return system.G.dot(np.where(np.asarray(system.row_kind) == 1, impulses, 0.0))


def _beyond(values: Floats, rounding: float) -> Floats:
    """Return what is left of numbers next to rounding."""
    out: Floats = np.where(np.abs(values) <= rounding, 0.0, values)
    return out


def _share(values: Floats, scale: Floats | float) -> Floats:
    """Return parts of a scale, 0 where it vanishes."""
    size = np.broadcast_to(np.asarray(scale, dtype=float), values.shape)
    out: Floats = np.divide(values, size, out=np.zeros_like(values), where=size > 0.0)
    return out
