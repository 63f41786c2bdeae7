"""What measures take of the outputs of an island along its recorded steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...problems.descriptor import Waveform
from ...solvers.along_run import Goal
from ...solvers.perturbed import Outputs
from ...solvers.tangent import Tangent
from ..signals.curve import Floats
from .refusals import undone
from .sources import edges

#: of a run: instants that are one, where steps end at given instants and where events are found
_SAME, _FOUND = 1e-12, 1e-6


class Aims:
    """Functionals of one island, as :func:`~.goals.goal_of` returns them.

    Parameters
    ----------
    goals : sequence of mapping
    stop : float
        Length of the run [s].
    """

    def __init__(self, goals: Sequence[Mapping[str, Sequence[Any]]], stop: float) -> None:
        self._goals, self._stop = goals, stop

    def marks(self) -> list[float]:
        """Return the instants at which steps have to end [s]."""
        found: list[float] = []
        for goal in self._goals:
            for key in ("integrals", "products", "waves"):
                place = 2 if key == "products" else 1
                found += [t for item in goal[key] for t in item[place]]
            found += [item[1] for item in goal["values"] if item[2] == 0]
        return found

    def goal(
        self, tangent: Tangent, outputs: Outputs, waveforms: Sequence[Waveform], periodic: bool
    ) -> Goal:
        """Return the functionals along a run."""
        aimed = _Aimed(tangent, outputs, waveforms, self._stop, periodic, len(self._goals))
        for f, goal in enumerate(self._goals):
            for output, window, factor in goal["integrals"]:
                aimed.integral([output], window, factor, f)
            for one, other, window, factor in goal["products"]:
                aimed.integral([one, other], window, factor, f)
            for output, window, turn, phase, factor in goal["waves"]:
                aimed.integral([output], window, factor, f, (turn, phase))
            for output, time, side, factor in goal["values"]:
                aimed.value(output, time, side, factor, f)
        return Goal(aimed.places, aimed.begins, aimed.shifts, aimed.edges)


class _Aimed:
    """Fills the arrays of a goal."""

    def __init__(
        self,
        tangent: Tangent,
        outputs: Outputs,
        waveforms: Sequence[Waveform],
        stop: float,
        periodic: bool,
        count: int,
    ) -> None:
        self.tangent, self.outputs, self.stop, self.periodic = tangent, outputs, stop, periodic
        record = tangent.record
        k, s = record.time.shape
        f = tangent.all_functions()
        self.y = record.z @ outputs.z.T + record.lam @ outputs.lam.T + f @ outputs.f.T
        self.y += record.u @ outputs.u.T
        self.places = np.zeros((k, s, outputs.count, count))
        self.begins: dict[int, Floats] = {}
        self.shifts = np.zeros((k, count))
        times = [t for wave in waveforms for group in edges(wave, stop) for t in group.times]
        at = np.array(times)
        if periodic:
            at = np.where(at >= (1.0 - _SAME) * stop, at - stop, at)
        place = np.searchsorted(np.sort(at), record.begin - _SAME * stop)
        near = np.append(np.sort(at), np.inf)[place]
        self.edges = near <= record.begin + _SAME * stop

    def integral(
        self,
        factors: Sequence[int],
        window: Sequence[float],
        factor: float,
        f: int,
        wave: tuple[float, float] | None = None,
    ) -> None:
        """Add the integral of an output, or of a product of two, over a window [s]."""
        record, tangent = self.tangent.record, self.tangent
        low, high = window
        slack = _SAME * self.stop + 2.0**-50 * high
        inside = (record.begin >= low - slack) & (record.end <= high + slack)
        crossed = ~inside & (record.begin < high - slack) & (record.end > low + slack)
        if crossed.any():
            raise undone("a window does not end where a step does", "a measure")
        g, rate = np.ones_like(record.time), np.zeros_like(record.time)
        if wave is not None:
            turn, phase = wave
            g = np.cos(turn * record.time + phase)
            rate = -turn * np.sin(turn * record.time + phase)
        weight = np.where(inside[:, np.newaxis], record.weight, 0.0) * factor
        values = [self.y[:, :, place] for place in factors]
        for j, place in enumerate(factors):
            others = values[1 - j] if len(values) == 2 else 1.0
            self.places[:, :, place, f] += weight * g * others
        whole = values[0] * (values[1] if len(values) == 2 else 1.0)
        parts = 1.0 - tangent.parts
        own = weight * whole * (rate * parts - g / tangent.length[:, np.newaxis])
        self.shifts[:, f] += own.sum(axis=1)
        before = np.where(inside, factor * g[:, -1] * whole[:, -1], 0.0)
        self.shifts[1:, f] += before[:-1]
        if self.periodic:
            self.shifts[0, f] += before[-1]

    def value(self, output: int, time: float, side: int, factor: float, f: int) -> None:
        """Add the value of an output at an instant, or before or after an event."""
        tangent, record = self.tangent, self.tangent.record
        if side == 0:
            k = int(np.argmin(np.abs(record.end - time)))
            if time <= _SAME * self.stop:
                self.begins.setdefault(0, np.zeros(self.places.shape[2:]))[output, f] += factor
            elif abs(float(record.end[k]) - time) > 1e3 * _SAME * self.stop:
                raise undone(f"no step ends at {time:.9g} s", "a measure")
            else:
                self.places[k, -1, output, f] += factor
            return
        turning = np.flatnonzero(tangent.turns | tangent.jumps | self.edges)
        off = np.abs(record.begin[turning] - time)
        if not off.min(initial=np.inf) <= _FOUND * self.stop:
            raise undone(f"its extreme at {time:.9g} s is not found again", "a measure")
        k = int(turning[np.argmin(off)])
        if side > 0:
            self.begins.setdefault(k, np.zeros(self.places.shape[2:]))[output, f] += factor
            return
        self.places[k - 1, -1, output, f] += factor
        motion, o, n = tangent.motion(k - 1), self.outputs, tangent.system.n
        rate = o.z[output] @ motion[:n] + o.lam[output] @ motion[n:]
        u = tangent.source_rates(k - 1)[-1]
        rate += o.u[output] @ u
        if o.f[output].any():
            last = slice(k - 1, k)
            slopes = tangent.slopes(record.z[last, -1], record.u[last, -1], record.end[last])
            moved = slopes.by_unknown[0] @ motion[:n] + slopes.by_source[0] @ u + slopes.by_time[0]
            rate += o.f[output] @ moved
        self.shifts[k, f] += factor * float(rate)
