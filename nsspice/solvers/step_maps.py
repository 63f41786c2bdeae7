"""Recorded steps as matrices, made for many steps together.

Each step is linear in what is stored at its begin, the rates there, the shift of its begin, and the
stimuli at its stages.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..problems.csc import Floats
from ..problems.descriptor import Functional
from .tangent import Slopes, Tangent


@dataclass(frozen=True, slots=True)
class Stimuli:
    """What perturbs an orbit.

    Parameters
    ----------
    rows : ndarray, shape (n, p)
        How each stimulus enters the equations.
    reads : mapping of int to int
        Stimuli that smooth functions read, too: the number of the source that they read.
    drivers : sequence of (Functional or None, bool), optional
        What each stimulus is along the orbit (None: 1), and whether its rate counts;
        :math:`e^{st}` if left out.
    """

    rows: Floats
    reads: Mapping[int, int]
    drivers: Sequence[tuple[Functional | None, bool]] | None = None

    @property
    def count(self) -> int:
        """Number of stimuli."""
        return int(self.rows.shape[1])


@dataclass(frozen=True, slots=True)
class Maps:
    """What k steps make of charges, rates, the shift, and stimuli at the places: c columns.

    Parameters
    ----------
    after : ndarray, shape (k, 2 r, c)
        Charges and rates at the end.
    unknowns, functions : ndarray, shapes (k, s, n + m, c), (k, s, p, c)
        At the places.
    """

    after: Floats
    unknowns: Floats
    functions: Floats


def step_maps(tangent: Tangent, stimuli: Stimuli, steps: npt.NDArray[np.intp]) -> Maps:
    """Return the matrices of some steps."""
    record, n, r = tangent.record, tangent.system.n, tangent.stored.size
    k, s = record.time[steps].shape
    c = 2 * r + 1 + s * stimuli.count
    maps = Maps(
        np.zeros((k, 2 * r, c)),
        np.zeros((k, s, n + tangent.system.m, c)),
        np.zeros((k, s, tangent.F.shape[1], c)),
    )
    inner = record.inner[steps]
    # the first place of a starting step repeats a stage, the last one that of a whole step
    starting, known = inner[:, 0].any(axis=1), tangent.continues[steps]
    whole = inner[:, -1, -1] == 0.0
    pattern = starting + 2 * known + 4 * whole
    for kind in np.unique(pattern):
        group = _Group(tangent, stimuli, maps, steps, np.flatnonzero(pattern == kind))
        group.fill(bool(kind & 1), bool(kind & 2), bool(kind & 4))
    return maps


class _Group:
    """Steps of one pattern among some steps; fills their matrices."""

    def __init__(
        self,
        tangent: Tangent,
        stimuli: Stimuli,
        maps: Maps,
        steps: npt.NDArray[np.intp],
        members: npt.NDArray[np.intp],
    ) -> None:
        self.maps, self.members, self.steps = maps, members, steps[members]
        self.tangent, self.stimuli, self.size = tangent, stimuli, tangent.stored.size
        self.c = maps.after.shape[2]
        record = self.tangent.record
        self.inner, self.time = record.inner[self.steps], record.time[self.steps]
        self.length, self.parts = tangent.length[self.steps], tangent.parts[self.steps]
        #: nominal rates and source rates, those for steps after an event alone
        self.r = self.tangent.r[self.steps][:, :, self.tangent.stored]
        sources = len(self.tangent.system.waveforms)
        self.motion = np.zeros((self.steps.size, self.time.shape[1], sources))
        for j in np.flatnonzero(self.tangent.turns[self.steps]):
            self.motion[j] = self.tangent.source_rates(int(self.steps[j]))
        self.rates: list[Floats] = []

    def fill(self, starting: bool, known: bool, whole: bool) -> None:
        """Compute place after place."""
        s, r, g = self.time.shape[1], self.size, self.steps.size
        if starting:
            self.rates.append(np.zeros((g, r, self.c)))  # of no weight
        elif known:
            given = np.zeros((g, r, self.c))
            given[:, :, r : 2 * r] = np.eye(r)
            self.rates.append(given)
        else:
            self._told()
        for i in range(1, s - 1 if whole else s):
            self._stage(i)
        if starting:
            self._repeat(0, 1)
        if whole:
            self.rates.append(self.rates[-1])
            self._repeat(s - 1, s - 2)
        end = self._base(s - 1, s)
        self.maps.after[self.members, :r] = end
        self.maps.after[self.members, r:] = self.rates[-1]

    def _repeat(self, place: int, of: int) -> None:
        for table in (self.maps.unknowns, self.maps.functions):
            table[self.members, place] = table[self.members, of]

    def _base(self, i: int, count: int) -> Floats:
        """Return what is stored from the first rates of place i on, with the shift of all."""
        r = self.size
        base = np.zeros((self.steps.size, r, self.c))
        base[:, :, :r] = np.eye(r)
        for j in range(count):
            base += self.inner[:, i, j, np.newaxis, np.newaxis] * self.rates[j]
        moved = np.einsum("kj,kjr->kr", self.inner[:, i], self.r)
        base[:, :, 2 * r] -= moved / self.length[:, np.newaxis]
        return base

    def _stage(self, i: int) -> None:
        record, tangent, stored = self.tangent.record, self.tangent, self.tangent.stored
        slopes = tangent.slopes(record.z[self.steps, i], record.u[self.steps, i], self.time[:, i])
        a = self.inner[:, i, i]
        n = tangent.system.n
        inverse = tangent.inverse(slopes, tangent.modes[self.steps, i], a)[:, :, :n]
        base = self._base(i, i)
        rhs, f, kept = self._forces(i, slopes, 1.0 - self.parts[:, i])
        base += kept[:, stored]
        held = (tangent.Q @ f)[:, stored]
        each = a[:, np.newaxis, np.newaxis]
        rhs[:, stored] += (base - held) / each
        x = inverse @ rhs
        self.rates.append((slopes.C[:, stored] @ x[:, :n] + held - base) / each)
        self._keep(i, x, f + slopes.by_unknown @ x[:, :n])

    def _told(self) -> None:
        """Rates at the begin from the structure of the network: those of an instant."""
        tangent, stored, n = self.tangent, self.tangent.stored, self.tangent.system.n
        slopes, a, inverse = tangent.at_begin(self.steps)
        base = np.zeros((self.steps.size, stored.size, self.c))
        base[:, :, : stored.size] = np.eye(stored.size)
        rhs, f, kept = self._forces(0, slopes, np.ones(self.steps.size))
        base += kept[:, stored] - (tangent.Q @ f)[:, stored]
        flows = rhs.copy()
        rhs[:, stored] += base / a[:, np.newaxis, np.newaxis]
        x = inverse[:, :, :n] @ rhs
        rate = flows - slopes.G @ x[:, :n] - tangent.A @ x[:, n:]
        self.rates.append(rate[:, stored])
        self._keep(0, x, f + slopes.by_unknown @ x[:, :n])

    def _forces(self, i: int, slopes: Slopes, part: Floats) -> tuple[Floats, Floats, Floats]:
        """Return right sides, smooth functions, and sources of charge, by stimuli and the shift."""
        tangent, stimuli, r = self.tangent, self.stimuli, self.size
        g, first = self.steps.size, 2 * r + 1 + i * stimuli.count
        rhs = np.zeros((g, tangent.system.n, self.c))
        kept, f = np.zeros_like(rhs), np.zeros((g, tangent.F.shape[1], self.c))
        for j in range(stimuli.count):
            stays = stimuli.drivers is not None and stimuli.drivers[j][1]
            (kept if stays else rhs)[:, :, first + j] = stimuli.rows[:, j]
            if j in stimuli.reads:
                f[:, :, first + j] = slopes.by_source[:, :, stimuli.reads[j]]
        motion = self.motion[:, i]
        timed = slopes.by_time + np.einsum("kpu,ku->kp", slopes.by_source, motion)
        f[:, :, 2 * r] = timed * part[:, np.newaxis]
        rhs[:, :, 2 * r] = motion @ tangent.system.S.dense().T * part[:, np.newaxis]
        return rhs - tangent.F @ f, f, kept

    def _keep(self, i: int, x: Floats, f: Floats) -> None:
        self.maps.unknowns[self.members, i] = x
        self.maps.functions[self.members, i] = f
