r"""Whether a descriptor system has a trajectory, and only one: circuits and what is like them.

For two solutions of ``E z' + G z + A lam + F f(z) = s``, ``0 <= lam perp q - B z + D lam >= 0``
with the same stored quantities at the start

.. math::

    \tfrac12 \frac{d}{dt} \delta z' E\, \delta z = -\delta z' G\, \delta z - \delta z' F\, \delta f
    - \delta z' A\, \delta\lambda \le 0

where E is symmetric positive semidefinite, G and the smooth functions are monotone, B = A' and D
is positive semidefinite: what is stored has one trajectory at most.  A step of length h has one
solution for any values of the sources if ``M = D + B (E/h + G)^{-1} A`` is a P-matrix; if M is
monotone it has a solution where the slacks can be made nonnegative, which no ``y >= 0`` with
``M'y <= 0`` may contradict.

Source: M. K. Camlibel, L. Iannelli, F. Vasca, *Passivity and complementarity*, Math. Program. 145
(2014) 531-563; J.-S. Pang, D. E. Stewart (2008), section 5.
"""

from __future__ import annotations

import itertools

import numpy as np

from ..csc import Floats
from ..descriptor import DescriptorSystem
from ..feedback import undecided_switches
from ..held_switches import held
from ..matrices import is_monotone
from ..one_solution import certainly_p, pair_matrix
from ..regularity import inverses
from ..slopes import shapes
from ..verdict import Verdict

ROWS = 400  #: unknowns of a system that is judged
_PAIRS = 60  # pairs up to which linear programs are solved
_SWITCHES = 8  # of which all states are looked at
#: step at which steps are judged, relative to the shortest time constant of the entries
_SHORT = 1e-3


def one_trajectory(system: DescriptorSystem) -> Verdict:
    """Judge whether what is stored has at most one trajectory from each start.

    Examples
    --------
    >>> from nsspice.problems import Csc
    >>> one, none = Csc.from_triplets((1, 1), [0], [0], [1.0]), Csc.zeros
    >>> system = DescriptorSystem(one, one, one, one, none((1, 1)), np.zeros(1), none((1, 0)))
    >>> bool(one_trajectory(system))
    True
    """
    claim = "one trajectory at most of what is stored"
    if system.n > ROWS:
        return Verdict.undecided(claim, f"more than {ROWS} unknowns")
    E, G = system.E.dense(), system.G.dense()
    if not np.array_equal(E, E.T) or not is_monotone(E):
        return Verdict.undecided(claim, "the storage is not symmetric and nonnegative")
    if system.smooth is not None:
        if system.smooth.Q.data.size:
            return Verdict.undecided(claim, "smooth laws store charge or flux")
        found = _monotone_part(system)
        if found is None:
            return Verdict.undecided(claim, "some smooth law is not known to be monotone")
        G = G + found
    gain = is_monotone(G)
    if not gain:
        return Verdict.undecided(claim, "the linear laws have gain", gain.witness)
    if not system.A.transposes(system.B):
        return Verdict.undecided(claim, "pairs act elsewhere than they are controlled")
    series = is_monotone(system.D.dense())
    if not series:
        return Verdict.undecided(claim, "a pair has a negative resistance", series.witness)
    until = ", between two switchings" if system.switches else ""
    return Verdict.yes(claim, f"all laws are monotone: differences of stored energy decay{until}")


def each_step(system: DescriptorSystem) -> Verdict:
    """Judge whether each short implicit step has a solution, for any values of the sources.

    A linear system, in all states of its switches, which none of them may decide for itself.
    """
    claim = "a solution each, for any values of the sources"
    if system.n > ROWS:
        return Verdict.undecided(claim, f"more than {ROWS} unknowns")
    if system.smooth is not None:
        return Verdict.undecided(claim, "smooth laws")
    undecided = undecided_switches(system)
    if undecided:
        return Verdict.undecided(claim, f"switches: {next(iter(undecided.values()))}")
    switched = sorted(system.switched)
    if len(switched) > _SWITCHES:
        return Verdict.undecided(claim, f"more than {_SWITCHES} switches")
    h = _SHORT * _shortest(system.E.dense(), system.G.dense())
    reasons = set()
    for states in itertools.product((False, True), repeat=len(switched)):
        inner, _ = held(system, dict(zip(switched, states, strict=True)))
        found = _in_state(inner, h, claim)
        if not found:
            return found
        reasons.add(found.reason)
    return Verdict.yes(claim, sorted(reasons)[-1])  # monotone is less than P


def _in_state(system: DescriptorSystem, h: float, claim: str) -> Verdict:
    """Judge the steps of a system without switches."""
    E, G = system.E.dense(), system.G.dense()
    A, B = system.A.dense(), system.B.dense()
    inverse, computed = inverses((E / h + G)[None]), pair_matrix(E / h + G, A, B, system.D.dense())
    if inverse is None or computed is None:
        return Verdict.undecided(claim, "something is left free")
    M, error = computed
    if certainly_p(M, error):
        return Verdict.yes(claim, "and one only: the matrix of the pairs is P")
    if is_monotone(M) and system.m <= _PAIRS:
        reach = B @ inverse[0] @ np.hstack([system.S.dense(), E])
        if _never_contradicted(M, reach, system.q):
            return Verdict.yes(claim, "monotone, and its slacks can always be made nonnegative")
    return Verdict.undecided(
        claim, "sources may contradict the pairs, as a voltage across an ideal diode does"
    )


def _never_contradicted(M: Floats, reach: Floats, q: Floats) -> bool:
    """Return whether ``q + reach s + M lam >= 0`` has a solution ``lam >= 0`` for every s.

    By Farkas's lemma: no ``y >= 0`` with ``M'y <= 0`` sees the data, and ``y . q >= 0`` for all.
    """
    from scipy.optimize import linprog

    m = q.size
    size = max(float(np.max(np.abs(M), initial=0.0)), 1e-300)
    span = np.max(np.abs(reach), axis=0, initial=0.0)
    ways = [q / max(float(np.max(np.abs(q), initial=0.0)), 1e-300)]
    for column, largest in zip(reach.T, span, strict=True):
        if largest > 0.0:
            ways += [column / largest, -column / largest]
    for way in ways:
        got = linprog(
            way,
            A_ub=M.T / size,
            b_ub=np.zeros(m),
            A_eq=np.ones((1, m)),
            b_eq=[1.0],
            bounds=(0.0, None),
        )
        # no such y at all (status 2) contradicts nothing; what is negative by the tolerance of the
        # linear program, 1e-7, or by rounding remains undecided
        if got.status != 2 and not (got.status == 0 and got.fun >= -1e-9):
            return False
    return True


def _shortest(E: Floats, G: Floats) -> float:
    """Return the smallest ratio of a store to what conducts next to it [s]; 1 without any."""
    stores = np.abs(np.diag(E))
    beside = np.max(np.abs(G), axis=1, initial=0.0)
    kept = (stores > 0.0) & (beside > 0.0)
    return float(np.min(stores[kept] / beside[kept])) if kept.any() else 1.0


def _monotone_part(system: DescriptorSystem) -> Floats | None:
    """Return the linear parts of the smooth functions, None unless the rest is monotone.

    A ridge ``u phi(v . z)`` is if u is a multiple of v of the sign of phi'.
    """
    assert system.smooth is not None
    F = system.smooth.F.dense()
    found, ridges = shapes(system.smooth.tape)
    linear = np.zeros((system.n, system.n))
    columns: dict[int, Floats] = {}
    for k, shape in enumerate(found):
        if not F[:, k].any():
            continue
        if shape is None:
            return None
        for j, value in shape.linear.items():
            linear[:, j] += F[:, k] * value
        for r, value in shape.ridges.items():
            columns[r] = columns.get(r, np.zeros(system.n)) + F[:, k] * value
    for r, u in columns.items():
        v = np.zeros(system.n)
        for j, value in ridges[r].direction.items():
            v[j] = value
        factor = float(u @ v) / float(v @ v) if v.any() else 0.0
        rounding = 4.0 * system.n * 2.0**-53 * float(np.max(np.abs(u), initial=0.0))
        if np.max(np.abs(u - factor * v), initial=0.0) > rounding:
            return None
        low, high = ridges[r].low, ridges[r].high
        if (factor > 0.0 and low < 0.0) or (factor < 0.0 and high > 0.0):
            return None
    return linear
