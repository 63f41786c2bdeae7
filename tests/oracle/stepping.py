"""The theta scheme, step by step and dense: what the compiled core must reproduce.

``(E/h + G + H) z1 + A l1 = (E/h + H) z0 + (S - Hs) u1 + Hs u0``, ``w1 = q - B z1 + D l1``.
Where a source jumps or a switch toggles, theta = 1 steps from the same charges, of a length that
goes to zero, move what is stored; a longer one from there shows the finite values right after.  No
time passes in any of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from nsspice.problems.descriptor import DescriptorSystem, Switch

from .mlcp import OracleInfeasible, OracleStuck, Point, solve
from .residual import Bools, Floats, Mlcp
from .waveforms import Corner, Side, Source, merged_corners

#: lengths of impulsive steps that are tried, in units of the nominal step
IMPULSES = (1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
#: the step that shows finite values is longer than the impulsive one by this factor
AFTER = 1e3
#: most reactions of switches at one instant
REACTIONS = 64


@dataclass
class Record:
    """One solved problem.

    ``time`` [s]; ``kind`` is ``dc start step jump gate``; ``z`` holds the unknowns to go on from,
    which differ from those of ``point`` only after impulsive steps; ``row`` marks grid instants.
    Right after a jump only the stored part of z has a meaning that does not depend on lengths.
    """

    time: float
    kind: str
    problem: Mlcp
    point: Point
    z: Floats
    u: Floats
    row: bool = False


@dataclass
class Network:
    """Dense copies of a descriptor system with the state of its switches.

    ``H`` and ``Hs`` are the averaging terms of the scheme, None for theta = 1.
    """

    system: DescriptorSystem
    start: float
    stop: float
    H: Floats | None = None
    Hs: Floats | None = None
    closed: Bools = field(init=False)

    def __post_init__(self) -> None:
        s = self.system
        self.E, self.G, self.A = s.E.dense(), s.G.dense(), s.A.dense()
        self.B, self.D, self.S = s.B.dense(), s.D.dense(), s.S.dense()
        if self.H is None or self.Hs is None:
            self.H, self.Hs = np.zeros_like(self.G), np.zeros_like(self.S)
        # a corner at the very end may lie past it by rounding
        end = self.stop + 1e-9 * (self.stop - self.start)
        self.sources = [Source(w, self.start, end) for w in s.waveforms]
        self.switch = np.zeros(s.m, dtype=bool)
        self.on = [switch.closed for switch in s.switches]
        self.closed = np.zeros(s.m, dtype=bool)
        for switch in s.switches:
            self.place(switch, switch.closed)

    def u(self, t: float, side: Side) -> Floats:
        """Return the source values at t."""
        return np.array([source.value(t, side) for source in self.sources])

    def problem(self, K: Floats, b: Floats) -> Mlcp:
        """Return the step problem with these row data and the switches as they stand."""
        return Mlcp(
            K,
            self.A,
            self.B,
            self.D,
            b,
            np.asarray(self.system.q, dtype=float),
            np.asarray(self.system.row_kind) == 1,
            self.switch,
            self.closed.copy(),
        )

    def dc(self, u: Floats) -> Mlcp:
        """Return the DC problem: nothing changes, so E drops out."""
        return self.problem(self.G, self.S @ u)

    def impulse(self, charges: Floats, u: Floats, length: float) -> Mlcp:
        """Return the problem of a theta = 1 step from charges E z."""
        return self.problem(self.E / length + self.G, charges / length + self.S @ u)

    def step(self, z0: Floats, u0: Floats, u1: Floats, h: float) -> Mlcp:
        """Return the problem of one ordinary step of length h [s]."""
        assert self.H is not None
        assert self.Hs is not None
        b = (self.E / h + self.H) @ z0 + (self.S - self.Hs) @ u1 + self.Hs @ u0
        return self.problem(self.E / h + self.G + self.H, b)

    def place(self, switch: Switch, on: bool) -> None:
        """Let the pair of a switch be closed or open; that of a fired thyristor is a diode."""
        closed = on != switch.inverted
        self.switch[switch.pair] = not (switch.latching and closed)
        self.closed[switch.pair] = closed and not switch.latching

    def toggle(self, z: Floats, lam: Floats) -> bool:
        """Apply every switch's law to the unknowns z; return whether any switch moved.

        A thyristor that carries a current stays closed.  One that opens carries none: nothing
        moves.
        """
        rounding = 1e-12 * np.abs(lam).max(initial=0.0)
        moved = False
        for k, switch in enumerate(self.system.switches):
            if switch.latching and self.on[k] and lam[switch.pair] > rounding:
                continue
            value = sum(c * z[j] for j, c in switch.control)
            slack = 8 * np.finfo(float).eps * sum(abs(c * z[j]) for j, c in switch.control)
            if self.on[k]:
                new = bool(value >= switch.off_below - slack)
            else:
                new = bool(value > switch.on_above + slack)
            moved |= new != self.on[k] and (new or not switch.latching)
            self.on[k] = new
            self.place(switch, new)
        return moved


@dataclass(frozen=True)
class Instant:
    """End of a step: its time [s], its length [s], whether it lies on the grid, whether u jumps."""

    time: float
    length: float
    row: bool
    jump: bool


def instants(start: float, stop: float, h: float, corners: list[Corner]) -> list[Instant]:
    """Return the steps over [start, stop]: multiples of h, corners hit, near doublets merged."""
    count = max(1, round((stop - start) / h))
    targets: dict[float, tuple[bool, bool]] = {}
    for k in range(1, count + 1):
        targets[start + k * h] = (True, False)
    for corner in corners:
        if corner.time <= start + 1e-9 * h:
            continue
        near = [t for t in targets if abs(t - corner.time) <= 1e-9 * h]
        row = any(targets[t][0] for t in near)
        jump = corner.jump or any(targets[t][1] for t in near)
        for t in near:
            del targets[t]
        if corner.time <= start + count * h + 1e-9 * h:
            targets[corner.time] = (row, jump)
    out: list[Instant] = []
    now, regular = start, True
    for time in sorted(targets):
        row, jump = targets[time]
        out.append(Instant(time, h if row and regular else time - now, row, jump))
        now, regular = time, row
    return out


def _change(new: Floats, old: Floats, start: Floats) -> float:
    """Return the largest change relative to the largest of the values and of the start."""
    size = max(np.abs(new).max(initial=0.0), np.abs(start).max(initial=0.0))
    return float(np.abs(new - old).max(initial=0.0) / size) if size > 0 else 0.0


def moved(
    net: Network, charges: Floats, u: Floats, h: float, z0: Floats | None
) -> tuple[Point, float]:
    """Return the state after a jump of the charges, and the length of step that resolved it [s].

    Steps of length d and 2 d are extrapolated to d = 0, and d is lowered until the stored
    quantities stay where they are: then it is short against every time constant.
    """
    lam0: Floats | None = None
    best, change, used, last = None, np.inf, h, None
    one_kind = np.asarray(net.system.row_kind) == 1
    for part in IMPULSES:
        d = part * h
        try:
            one = solve(net.impulse(charges, u, d), z0, lam0)
            two = solve(net.impulse(charges, u, 2 * d), one.z, one.lam)
        except OracleStuck:
            continue
        z = 2 * one.z - two.z
        stored = net.E @ z
        z0, lam0 = one.z, one.lam
        if last is not None:
            now = max(
                _change(stored[kind], last[kind], charges[kind])
                for kind in (one_kind, ~one_kind)  # charges and fluxes each by their own size
            )
            if now < change:
                best, change, used = Point(z, one.lam, one.w, one.active), now, d
        elif best is None:
            best, used = Point(z, one.lam, one.w, one.active), d
        last = stored
        if change <= 1e-15:
            break
    if best is None:
        raise OracleStuck("no impulsive step of any length was solved")
    return best, used


class Runner:
    """Steps a network and keeps every solved problem in ``records``."""

    def __init__(self, network: Network, h: float) -> None:
        self.network = network
        self.h = h
        self.records: list[Record] = []
        self.u = network.u(network.start, "right")
        self.carried = np.abs(network.E).sum(axis=0) > 0

    def _solve(self, kind: str, t: float, p: Mlcp, z0: Floats | None, l0: Floats | None) -> Record:
        point = solve(p, z0, l0)
        record = Record(t, kind, p, point, point.z, self.u.copy())
        self.records.append(record)
        return record

    def _impulse(self, kind: str, t: float, charges: Floats, z0: Floats | None) -> Record:
        """Solve the impulsive step and the one that shows the finite values after it."""
        net = self.network
        after, length = moved(net, charges, self.u, self.h, z0)
        stored = net.E @ after.z
        record = self._solve(
            kind, t, net.impulse(stored, self.u, AFTER * length), after.z, after.lam
        )
        record.z = np.where(self.carried, after.z, record.point.z)
        return record

    def begin(self, charges: Floats | None, z: Floats | None) -> Record:
        """Start from charges E z, or from the DC solution nearest to z."""
        net, t = self.network, self.network.start
        if charges is not None:
            # the switches belong to the state that the charges lead to
            for _ in range(REACTIONS):
                now = self._impulse("start", t, charges, z)
                if not net.toggle(now.z, now.point.lam):
                    break
                self.records.pop()
            return now
        now = self._solve("dc", t, net.dc(self.u), z, None)
        for _ in range(REACTIONS):
            if not net.toggle(now.z, now.point.lam):
                break
            now = self._solve("dc", t, net.dc(self.u), now.z, now.point.lam)
        return now

    def _settle(self, now: Record) -> Record:
        for _ in range(REACTIONS):
            if not self.network.toggle(now.z, now.point.lam):
                break
            now = self._try_impulse("gate", now)
        return now

    def _try_impulse(self, kind: str, now: Record) -> Record:
        """A jump that has no solution by itself is left to the next ordinary step."""
        try:
            return self._impulse(kind, now.time, self.network.E @ now.z, now.z)
        except (OracleInfeasible, OracleStuck):
            return now

    def advance(self, now: Record, target: Instant) -> Record:
        """Take one step and all that happens at its end."""
        net = self.network
        before, self.u = self.u, net.u(target.time, "left")
        problem = net.step(now.z, before, self.u, target.length)
        now = self._solve("step", target.time, problem, now.z, now.point.lam)
        if target.jump:
            self.u = net.u(target.time, "right")
            now = self._try_impulse("jump", now)
        now = self._settle(now)
        now.row = target.row
        return now


def run(
    network: Network,
    h: float,
    *,
    charges: Floats | None = None,
    z: Floats | None = None,
    limit: int | None = None,
) -> list[Record]:
    """Step over the network's window and return every solved problem.

    Parameters
    ----------
    h : float
        Nominal step [s].
    charges : ndarray, optional
        E z at the start (``uic``); without it the run starts from DC.
    z : ndarray, optional
        A DC solution to stay close to, for networks whose DC state is not unique.
    limit : int, optional
        Stop after this many steps.
    """
    runner = Runner(network, h)
    now = runner.begin(charges, z)
    now.row = True
    steps = instants(network.start, network.stop, h, merged_corners(network.sources))
    for target in steps if limit is None else steps[:limit]:
        now = runner.advance(now, target)
    return runner.records
