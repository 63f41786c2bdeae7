"""The linearised equations along one period of steps with error control.

With q = E z + Q f(z) what is stored and r its rate, each stage of a recorded step solves

.. math::

    C_i\\, \\delta z_i = \\delta q_0 + \\sum_{j \\le i} a_{ij}\\, \\delta r_j, \\qquad
    \\delta r_i + G_i\\, \\delta z_i + A\\, \\delta\\lambda_i = S\\, \\delta u_i

in the mode of that stage, C and G being the slopes there: the result is the derivative of the
computed period map for fixed step lengths.  Where a guard g ends a mode, the instant moves by
:math:`\\delta t = -\\delta g / \\dot g`.

References: R. Telichevesky, K. S. Kundert, J. K. White, "Efficient AC and noise analysis of
two-tone RF circuits", Proc. 33rd DAC (1996) 292, doi:10.1145/240518.240573; R. I. Leine, H.
Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems (Springer, 2004), section 7.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..problems.csc import Floats
from ..problems.descriptor import DescriptorSystem
from .intervals import Intervals
from .moreau import all_slopes_of, function_values
from .orbit import NoDerivative

Bools = npt.NDArray[np.bool_]

#: of a step: an implicit step so short is an instant
INSTANT = 1e-6
#: condition beyond which equations are taken for singular: something floats
_SINGULAR = 1e13
#: of the period: a guard that its rate takes to zero within that time ends the mode
AT_ZERO = 1e-6
#: of the largest charge or flux of its row: a larger change between two steps is a jump
_JUMP = 1e-6


@dataclass(frozen=True, slots=True)
class Slopes:
    """Equations linearised at k points.

    Parameters
    ----------
    C, G : ndarray, shape (k, n, n)
        Of what is stored, and of what flows, by the unknowns.
    by_unknown, by_source, by_time : ndarray, shapes (k, p, n), (k, p, sources), (k, p)
        Derivatives of the smooth functions.
    """

    C: Floats
    G: Floats
    by_unknown: Floats
    by_source: Floats
    by_time: Floats


@dataclass(frozen=True, slots=True)
class Guard:
    """A quantity whose zero ends a mode.

    Parameters
    ----------
    row : ndarray, shape (n + m,)
        Its derivatives by unknowns and multipliers.
    rate : float
        [1/s]
    kind : str
        ``on`` and ``off`` for the thresholds of a switch, ``multiplier``, ``slack``.
    place : int
        Number of the switch, or of the pair.
    """

    row: Floats
    rate: float
    kind: str
    place: int

    @property
    def instant(self) -> Floats:
        """How its instant depends on unknowns and multipliers [s], shape (n + m,)."""
        return np.asarray(-self.row / self.rate)


class Tangent:
    """What differentiates one recorded period.

    Parameters
    ----------
    system : DescriptorSystem
    record : Intervals
        All steps of the period, which begins at 0.
    charges : ndarray, shape (n,)
        What is stored at its beginning.

    Raises
    ------
    NoDerivative
        If the steps leave parts of the period out.
    """

    def __init__(self, system: DescriptorSystem, record: Intervals, charges: Floats) -> None:
        self.system, self.record = system, record
        smooth = system.smooth
        none = np.zeros((system.n, 0))
        self.E, self.flow = system.E.dense(), system.G.dense()
        self.A, self.B, self.D = system.A.dense(), system.B.dense(), system.D.dense()
        self.F = none if smooth is None else smooth.F.dense()
        self.Q = none if smooth is None else smooth.Q.dense()
        #: rows that store, and rates of what is stored there at all places, shape (k, s, n)
        self.stored = np.flatnonzero(np.abs(self.E).sum(axis=1) + np.abs(self.Q).sum(axis=1))
        self.r = self._rates()
        self.modes = self._modes()
        #: lengths (k,) and parts of them at the places (k, s); differences of instants are rounded
        self.length = record.weight.sum(axis=1)
        self.parts = record.inner.sum(axis=2) / self.length[:, np.newaxis]
        #: what is stored at the begin and at the end of each step, shape (k, n)
        self.begins = self._stored(record.first, record.first_u, record.begin)
        self.ends = self._stored(record.z[:, -1], record.u[:, -1], record.end)
        before = np.vstack([charges, self.ends[:-1]])
        gaps = record.begin - np.append(0.0, record.end[:-1])
        self.period = float(record.end[-1])
        if np.abs(gaps).max() > AT_ZERO * self.period:
            raise NoDerivative("unproved", float(record.begin[int(np.argmax(np.abs(gaps)))]))
        #: largest of what each row stores
        self.size = np.maximum(np.abs(before), np.abs(self.begins)).max(axis=0)
        #: whether something jumps, or the mode changes, at the begin of each step
        self.jumps = (np.abs(self.begins - before) > _JUMP * self.size).any(axis=1)
        self.turns = np.append(False, (self.modes[:-1, -1] != self.modes[1:, 1]).any(axis=1))
        known = np.append(False, (record.rate[1:, 0] == record.rate[:-1, -1]).all(axis=1))
        #: whether each step continues the one before
        self.continues = known & ~self.jumps & ~self.turns & (gaps == 0.0)

    def _rates(self) -> Floats:
        """Return what flows into the stores, shape (k, s, n).

        Of the equations: differences over the shortest steps are lost in rounding.
        """
        record, smooth = self.record, self.system.smooth
        found = record.u @ self.system.S.dense().T - record.z @ self.flow.T
        found -= record.lam @ self.A.T
        if smooth is not None:
            found -= self.all_functions() @ self.F.T
        only = np.zeros_like(found)
        only[..., self.stored] = found[..., self.stored]
        return only

    def _modes(self) -> Bools:
        """Return which pairs conduct, shape (k, s, m)."""
        record = self.record
        flows: Bools = record.lam != 0.0
        if not record.roles.size:
            return flows
        roles = record.roles[:, np.newaxis, :]
        modes: Bools = np.where(roles == 0, flows, roles == 1)
        return modes

    def _stored(self, z: Floats, u: Floats, t: Floats) -> Floats:
        found: Floats = z @ self.E.T
        if self.system.smooth is not None and self.Q.size:
            found = found + function_values(self.system.smooth.tape, z, u, t) @ self.Q.T
        return found

    def all_functions(self) -> Floats:
        """Return the smooth functions at all places, shape (k, s, p)."""
        record, smooth = self.record, self.system.smooth
        k, s = record.time.shape
        if smooth is None:
            return np.zeros((k, s, 0))
        z, u = (v.reshape(k * s, -1) for v in (record.z, record.u))
        return function_values(smooth.tape, z, u, record.time.ravel()).reshape(k, s, -1)

    def functions(self, k: int, place: int) -> Floats:
        """Return the smooth functions at a place of a step, shape (p,)."""
        if self.system.smooth is None:
            return np.zeros(0)
        at, r = [place], self.record
        found: Floats = function_values(
            self.system.smooth.tape, r.z[k, at], r.u[k, at], r.time[k, at]
        )[0]
        return found

    def slopes(self, z: Floats, u: Floats, t: Floats) -> Slopes:
        """Return the equations linearised at points, shapes (k, n), (k, sources), (k,)."""
        (k, n), smooth = z.shape, self.system.smooth
        if smooth is None:
            C, G = (np.broadcast_to(matrix, (k, n, n)) for matrix in (self.E, self.flow))
            return Slopes(C, G, np.zeros((k, 0, n)), np.zeros((k, 0, u.shape[1])), np.zeros((k, 0)))
        by_unknown, by_source, by_time = all_slopes_of(smooth.tape, z, u, t)
        return Slopes(
            self.E + self.Q @ by_unknown,
            self.flow + self.F @ by_unknown,
            by_unknown,
            by_source,
            by_time,
        )

    def inverse(self, slopes: Slopes, active: Bools, a: Floats) -> Floats:
        """Return what implicit steps of lengths a (k,) make of right sides, (k, n + m, n + m).

        Those of the equations, then what the slacks of conducting pairs are short of.
        """
        k, n = slopes.C.shape[:2]
        m = active.shape[1]
        on = active[:, :, np.newaxis]
        matrix = np.zeros((k, n + m, n + m))
        matrix[:, :n, :n] = slopes.C / a[:, np.newaxis, np.newaxis] + slopes.G
        matrix[:, :n, n:] = self.A
        matrix[:, n:, :n] = np.where(on, -self.B, 0.0)
        matrix[:, n:, n:] = np.where(on, self.D, np.eye(m))
        # volts and amperes: rows, then columns, are scaled by their largest entries
        rows = np.abs(matrix).max(axis=2, keepdims=True)
        rows[rows == 0.0] = 1.0
        matrix /= rows
        columns = np.abs(matrix).max(axis=1, keepdims=True)
        columns[columns == 0.0] = 1.0
        matrix /= columns
        try:
            found = np.linalg.inv(matrix)
            size = np.abs(matrix).sum(axis=2).max(axis=1) * np.abs(found).sum(axis=2).max(axis=1)
            bad = np.flatnonzero(~(size < _SINGULAR))
        except np.linalg.LinAlgError:
            found, bad = np.zeros_like(matrix), np.arange(k)
        for j in bad:
            found[j] = np.linalg.pinv(matrix[j], rcond=1.0 / _SINGULAR)
        found /= np.swapaxes(columns, 1, 2) * np.swapaxes(rows, 1, 2)
        result: Floats = found
        return result

    def at_begin(self, steps: npt.NDArray[np.intp]) -> tuple[Slopes, Floats, Floats]:
        """Return slopes, lengths and inverses of instants at the begin of some steps."""
        r = self.record
        slopes = self.slopes(r.first[steps], r.first_u[steps], r.begin[steps])
        a = INSTANT * self.length[steps]
        return slopes, a, self.inverse(slopes, self.modes[steps, 1], a)

    def source_rates(self, k: int) -> Floats:
        """Return the rates of the sources at the places of a step, shape (s, sources).

        Of the polynomial through them: between two breakpoints sources are smooth.
        """
        r = self.record
        length = self.length[k]
        nodes, first, back = np.unique(self.parts[k], return_index=True, return_inverse=True)
        # barycentric differentiation
        gaps = nodes[:, np.newaxis] - nodes + np.eye(nodes.size)
        weight = 1.0 / np.prod(gaps, axis=1)
        D = weight / weight[:, np.newaxis] / gaps
        np.fill_diagonal(D, 0.0)
        np.fill_diagonal(D, -D.sum(axis=1))
        rates: Floats = (D @ r.u[k][first])[back.ravel()] / length
        return rates

    def motion(self, k: int) -> Floats:
        """Return the rates of unknowns and multipliers at the end of step k, shape (n + m,).

        Of two instants, one half as long, whose lengths are extrapolated to none.
        """
        r, n, both = self.record, self.system.n, [k, k]
        slopes = self.slopes(r.z[both, -1], r.u[both, -1], r.end[both])
        a = INSTANT * self.length[k] * np.array([1.0, 0.5])
        rates = self.source_rates(k)[-1]
        timed = slopes.by_time[0] + slopes.by_source[0] @ rates
        flows = self.system.S.dot(rates) - self.F @ timed
        kept = self.r[k, -1] - self.Q @ timed
        inverse = self.inverse(slopes, self.modes[both, -1], a)[:, :, :n]
        whole, half = (m @ (flows + kept / length) for m, length in zip(inverse, a, strict=True))
        return np.asarray(2.0 * half - whole)

    def guard(self, k: int) -> Guard | None:
        """Return the guard that reaches zero at the end of step k; None if none does.

        Then that is an instant of the sources.

        Raises
        ------
        NoDerivative
            If several guards reach zero there that move differently.
        """
        system, r, n = self.system, self.record, self.system.n
        before, after = self.modes[k, -1], self.modes[k + 1, 1]
        motion = self.motion(k)
        z, lam = r.z[k, -1], r.lam[k, -1]
        slack = system.q - self.B @ z + self.D @ lam
        switches = {switch.pair: (i, switch) for i, switch in enumerate(system.switches)}
        found: list[tuple[float, Guard]] = []
        changed = np.flatnonzero(before != after)
        for j in map(int, changed):
            row = np.zeros(n + system.m)
            place, switch = switches.get(j, (j, None))
            if switch is not None and not (switch.latching and before[j]):
                for i, factor in switch.control:
                    row[i] += factor
                closes = bool(after[j]) != switch.inverted
                value = row[:n] @ z - (switch.on_above if closes else switch.off_below)
                kind = "on" if closes else "off"
            elif before[j]:
                row[n + j], value, kind, place = 1.0, lam[j], "multiplier", j
            else:
                row[:n], row[n:], value = -self.B[j], self.D[j], slack[j]
                kind, place = "slack", j
            rate = float(row @ motion)
            if abs(value) <= AT_ZERO * self.period * abs(rate):
                found.append((abs(value / rate), Guard(row, rate, kind, place)))
        if not found:
            return None
        found.sort(key=lambda pair: pair[0])
        return found[0][1]
