"""Runs the compiled core and the oracle over the same instants and measures their distance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nsspice.circuit import MnaSystem
from nsspice.circuit.normal_form import reference
from nsspice.circuit.theta import theta_terms
from nsspice.problems.csc import Csc
from nsspice.solvers.moreau import MoreauStepper

from . import theta as oracle_theta
from .closed_forms import Floats
from .node_voltages import in_node_voltages, potentials_of
from .residual import Bools
from .stepping import Network, Record, run
from .uniqueness import unique_signals

#: a signal is judged against its own size, but not against less than this part of its kind's
FLOOR = 1e-3


@dataclass
class Comparison:
    """Largest relative distance, where it is, and how many values were compared."""

    distance: float
    signal: str
    time: float
    compared: int


def averaging(mna: MnaSystem, theta: float) -> tuple[Floats, Floats] | None:
    """Return the oracle's own (H, Hs) for the states and pairs that the normal tree chose."""
    if theta == 1.0 or mna.system.static:
        return None
    network = reference(mna)
    states = [s.terms for s in network.states]
    shut = [int(k) for k in np.flatnonzero(network.in_tree)]
    return oracle_theta.theta_terms(mna.system, theta, states, [], shut)


def compare(
    mna: MnaSystem, h: float, count: int, theta: float = 1.0, charges: Floats | None = None
) -> Comparison:
    """Take ``count`` steps with both and compare every unique unknown and multiplier.

    Parameters
    ----------
    charges : ndarray, optional
        Start from these charges; without them from the DC solution.
    """
    system = mna.system
    H, Hs = theta_terms(mna, theta)
    stepper = MoreauStepper(system, (), H=H, Hs=Hs)
    stepper.plan(0.0, count * h, h, 0.0, h)
    if charges is not None and not system.static:
        stepper.start_charges(0.0, charges, h)
    else:
        stepper.start_dc(0.0)
        charges = None
    # the oracle has unknowns of its own: voltages against ground
    plain = in_node_voltages(mna)
    potentials = potentials_of(mna)

    def state() -> tuple[Floats, Floats]:
        z, lam = stepper.state
        return potentials @ z, np.array(lam)

    states = [state()]
    stepper.advance(1)
    for _ in range(count):
        stepper.advance(1)
        states.append(state())
    network = Network(plain.system, 0.0, count * h, *(t.dense() for t in theta_terms(plain, theta)))
    if system.static:
        return _judge(plain, states, _static(network, h, count, states), plain.system.G.dense())
    if charges is not None:
        # what enters a node, from what passes the cut-sets
        charges = np.linalg.solve(potentials.T, charges)
    records = run(network, h, charges=charges, z=states[0][0])
    rows = [r for r in records if r.row]
    carried = np.abs(network.E).sum(axis=0) > 0
    compared = [(r.time, r.z, r.point.lam, *_masks(r, carried)) for r in rows]
    return _judge(plain, states, compared, network.E / h + network.G)


def averaging_distance(mna: MnaSystem, theta: float) -> float:
    """Return the relative distance of the circuit's averaging terms from the oracle's."""
    own = averaging(mna, theta)
    if own is None:
        return 0.0
    worst = 0.0
    for ours, theirs in zip(own, theta_terms(mna, theta), strict=True):
        assert isinstance(theirs, Csc)
        # the terms stand beside G and S: what is small against those is rounding
        beside = mna.system.G if theirs.shape[1] == mna.system.n else mna.system.S
        size = max(np.abs(ours).max(initial=0.0), np.abs(beside.data).max(initial=0.0))
        gap = float(np.abs(ours - theirs.dense()).max(initial=0.0))
        worst = max(worst, gap / size if size > 0 else gap)
    return worst


def short_enough(mna: MnaSystem, h: float, theta: float) -> float:
    """Return h halved until the step's matrix is monotone, and well away from the border.

    With theta < 1 a step that is long against the time constants of the reference network makes
    ``E/h + G + H`` indefinite; neither solver promises anything there.
    """
    if theta == 1.0 or mna.system.static:
        return h
    H = theta_terms(mna, theta)[0].dense()
    E, G = mna.system.E.dense(), mna.system.G.dense()
    passive = np.linalg.eigvalsh(G + G.T).min() > -1e-12 * np.abs(G).max()
    whole = h
    for _ in range(40):
        K = E / h + G + H
        if not passive or np.linalg.eigvalsh(K + K.T).min() > -1e-12 * np.abs(K).max():
            return h if h == whole else h / 8
        h /= 2
    return h


Row = tuple[float, Floats, Floats, Bools, Bools]


def _masks(record: Record, carried: Bools) -> tuple[Bools, Bools]:
    """Return what is comparable: the unique part; right after a jump only what is stored."""
    z, lam = unique_signals(record.problem, record.point)
    if record.kind in ("step", "dc"):
        return z, lam
    return z & carried, np.zeros_like(lam)


def _static(
    network: Network, h: float, count: int, states: list[tuple[Floats, Floats]]
) -> list[Row]:
    """Solve point by point, each near the core's own answer of the step before."""
    from .mlcp import solve

    rows: list[Row] = []
    for k in range(count + 1):
        t = k * h
        z, lam = states[max(k - 1, 0)]
        u = network.u(t, "right")
        problem = network.dc(u)
        point = solve(problem, z, lam)
        for _ in range(8):
            if not network.toggle(point.z, point.lam):
                break
            problem = network.dc(u)
            point = solve(problem, point.z, point.lam)
        uz, ul = unique_signals(problem, point)
        rows.append((t, point.z, point.lam, uz, ul))
    return rows


def _judge(
    mna: MnaSystem, states: list[tuple[Floats, Floats]], rows: list[Row], K: Floats
) -> Comparison:
    """Return the largest distance over all rows, relative to each signal's scale.

    Rounding leaves a part of the terms of an equation where its current or voltage vanishes; hence
    the size of the terms of the equations also counts as scale.
    """
    assert len(states) == len(rows), f"{len(states)} rows of the core, {len(rows)} of the oracle"
    names = [*mna.unknowns, *(f"l({p})" for p in mna.pairs)]
    ours = np.array([np.concatenate([r[1], r[2]]) for r in rows])
    unique = np.array([np.concatenate([r[3], r[4]]) for r in rows]).astype(bool)
    core = np.array([np.concatenate(s) for s in states])
    own = np.abs(np.where(unique, ours, 0.0)).max(axis=0, initial=0.0)
    volts = np.array([name.startswith("v(") for name in names], dtype=bool)
    scale = own.copy()
    terms = np.abs(K) @ own[: mna.system.n]
    branch = np.asarray(mna.system.row_kind) == 1
    for kind, equations in ((volts, branch), (~volts, ~branch)):
        if kind.any():
            largest = max(own[kind].max(), terms[equations].max(initial=0.0))
            scale[kind] = np.maximum(own[kind], FLOOR * largest)
    scale = np.where(scale > 0, scale, 1.0)
    gap = np.where(unique, np.abs(core - ours), 0.0) / scale
    if gap.size == 0:
        return Comparison(0.0, "", 0.0, 0)
    at, signal = np.unravel_index(int(np.argmax(gap)), gap.shape)
    return Comparison(
        float(gap[at, signal]),
        names[int(signal)],
        rows[int(at)][0],
        int(unique.sum()),
    )
