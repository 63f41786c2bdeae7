"""Static problems as arrays: solved from a point, all solutions, followed along the time."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import _core
from ...errors import NumericalError
from ...problems.csc import Csc
from ...problems.piecewise import regular_at_kinks
from ...problems.regularity import CLAIM, Regularity, strong_regularity
from ...problems.tape import TapeBuilder
from ...problems.verdict import Verdict
from ...solvers.compiled import core_matrix, core_tape
from ...solvers.kinks import limits
from ...solvers.moreau import function_slopes, function_values
from ..terms.errors import unsolved, wrong
from .assembly import Assembly
from .point import Point

Floats = npt.NDArray[np.float64]

#: pairs up to which every mode of a problem is looked at
MODES = 14
_STARTS = 64
#: points closer than this, relative to the largest entry, are one solution
_SAME = 1e-7
#: of a linear system, per unit of its largest solution: n u for n = 64
_ZERO = 64.0 * 2.0**-53
#: a solution within this part of its largest entry is at a kink: what Newton's method leaves open
_AT_KINK = 1e-9
#: relative residual of a solution: a thousand times what rounding leaves of well scaled terms
_SOLVED = 1e-9


class Static:
    """An assembled static problem.

    Parameters
    ----------
    assembly : Assembly
    """

    def __init__(self, assembly: Assembly) -> None:
        self.assembly = assembly
        self.system = assembly.system

    def solve(self, start: Mapping[str, float] | None, time: float) -> tuple[Floats, Floats, float]:
        """Return unknowns, multipliers and residual of a solution, found from a point near it.

        Raises
        ------
        NumericalError
            NS6020 if there is none, or none was found.
        """
        begin = None if start is None else self.begin(start)
        times = np.array([time])
        out = self.core(times, self.assembly.data(times), begin=None)
        if begin is not None:
            # from the point first; where that leads nowhere, from nothing
            near = self._near(begin, time)
            if near is not None:
                return near
        if not out["reached"]:
            if begin is None:
                near = self._near(self.begin({}), time)
                if near is not None:
                    return near
            raise self._unsolved(time)
        n, m = self.system.n, self.system.m
        z, lam = out["z"].reshape(1, n)[0], out["l"].reshape(1, m)[0]
        return z, lam, float(out["residuals"][0])

    def _near(
        self, begin: tuple[Floats, Floats], time: float
    ) -> tuple[Floats, Floats, float] | None:
        """Return what Newton's method finds from a point, None where it leads nowhere."""
        times = np.array([time])
        out = self.core(times, self.assembly.data(times), begin=begin)
        if out["reached"] < 1 or not out["residuals"][0] < _SOLVED:
            return None
        n, m = self.system.n, self.system.m
        return (
            out["z"].reshape(1, n)[0],
            out["l"].reshape(1, m)[0],
            float(out["residuals"][0]),
        )

    def core(
        self,
        times: Floats,
        rows: Floats,
        *,
        begin: tuple[Floats, Floats] | None,
        tracking: tuple[bool, int | None] | None = None,
        rates: Floats | None = None,
        errors: Floats | None = None,
    ) -> dict[str, Any]:
        """Run the compiled solver over points; see :mod:`nsspice.solvers.generalized`."""
        system, smooth = self.system, self.system.smooth
        n = system.n
        functions: tuple[Any, ...]
        if smooth is None:
            none = Csc.zeros((n, 0))
            functions = (
                core_tape(TapeBuilder().finish()),
                core_matrix(none),
                core_matrix(none),
            )
        else:
            functions = (core_tape(smooth.tape), core_matrix(smooth.F), core_matrix(smooth.Q))
        return _core.solve_path(
            core_matrix(system.G),
            core_matrix(system.A),
            core_matrix(system.B),
            core_matrix(system.D),
            system.q,
            system.row_kind,
            functions,
            np.ascontiguousarray(times),
            np.ascontiguousarray(rows),
            rates,
            errors,
            tracking is not None,
            bool(tracking and tracking[0]),
            tracking[1] if tracking else None,
            begin,
        )

    def begin(self, start: Mapping[str, float]) -> tuple[Floats, Floats]:
        """Return unknowns with given values, and multipliers 0."""
        z = np.zeros(self.system.n)
        lam = np.zeros(self.system.m)
        for name, value in start.items():
            place = self.assembly.places.get(name)
            if place is None:
                raise wrong("NS6001", f"{name} has an initial value but is not an unknown", "")
            for j, _ in place.z:
                z[j] = value
            for j, _ in place.lam:
                lam[j] = value
        return z, lam

    def jacobian(self, z: Floats, time: float) -> Floats:
        """Return the derivatives of the smooth functions, shape (p, n)."""
        if self.system.smooth is None:
            return np.zeros((0, self.system.n))
        none = np.zeros((1, 0))
        slopes: Floats = function_slopes(self.system.smooth.tape, z[None], none, np.array([time]))[
            0
        ]
        return slopes

    def regularity(self, z: Floats, lam: Floats, time: float) -> Regularity:
        """Return the verdict on strong metric regularity at a solution."""
        system = self.system
        if system.smooth is not None:
            near = np.full(z.shape, _AT_KINK * float(np.max(np.abs(z), initial=0.0)))
            around = limits(system.smooth.tape, z, np.zeros(0), time, near)
            if around.jumps or not around.complete:
                text = "a function jumps there" if around.jumps else "too many kinks meet there"
                return Regularity(Verdict.undecided(CLAIM, text), np.inf)
            if len(around.directions):
                # those of signs, copies and slacks say what these are, and have no data
                own = [not n.startswith("sgn(") and "#" not in n for n in self.assembly.rows]
                return regular_at_kinks(system, around.kinks, z, lam, rows=np.array(own))
        return strong_regularity(system, self.jacobian(z, time), z, lam)

    def residual(self, z: Floats, lam: Floats, time: float) -> float:
        """Return how well equations, signs and products hold, relative to their terms."""
        system = self.system
        data = self.assembly.data(np.array([time]))[0]
        rows = system.G.dot(z) + system.A.dot(lam) - data
        size = system.G.abs().dot(np.abs(z)) + system.A.abs().dot(np.abs(lam)) + np.abs(data)
        if system.smooth is not None:
            values = function_values(
                system.smooth.tape, z[None], np.zeros((1, 0)), np.array([time])
            )[0]
            rows = rows + system.smooth.F.dot(values)
            size = size + system.smooth.F.abs().dot(np.abs(values))
        w = system.q - system.B.dot(z) + system.D.dot(lam)
        scale = np.abs(system.q) + system.B.abs().dot(np.abs(z)) + system.D.abs().dot(np.abs(lam))
        most = max(1e-300, float(np.max(size, initial=0.0)))
        worst = float(np.max(np.abs(rows) / np.maximum(size, 1e-6 * most), initial=0.0))
        if system.m:
            widest = max(float(np.max(scale)), 1e-300)
            strongest = max(float(np.max(np.abs(lam))), most)
            both = np.minimum(lam / strongest, w / widest)
            worst = max(worst, float(np.max(np.abs(both))))
        return worst

    def point(self, z: Floats, lam: Floats, time: float) -> Point:
        """Return a solution by names."""
        values, multipliers = {}, {}
        for name, place in self.assembly.places.items():
            if "#" in name:
                continue
            values[name] = sum(c * float(z[j]) for j, c in place.z) + sum(
                c * float(lam[j]) for j, c in place.lam
            )
        values["time"] = time
        for k, name in enumerate(self.assembly.pairs):
            multipliers[name] = float(lam[k])
        judge = partial(self.regularity, z, lam, time)
        return Point(values, multipliers, self.residual(z, lam, time), judge)

    def all_linear(self, time: float) -> list[tuple[Floats, Floats]]:
        """Return every isolated solution of a linear problem, mode by mode.

        Raises
        ------
        UsageError
            NS6005 with more than ``MODES`` pairs.
        """
        system, n, m = self.system, self.system.n, self.system.m
        if m > MODES:
            raise wrong(
                "NS6005",
                f"{m} pairs have {2**m:.2g} modes, which are too many to enumerate",
                "solve() finds one solution from a starting point",
            )
        G, A, B, D = (x.dense() for x in (system.G, system.A, system.B, system.D))
        data = self.assembly.data(np.array([time]))[0]
        candidates: list[tuple[Floats, Floats]] = []
        for active in itertools.product((False, True), repeat=m):
            on = np.flatnonzero(active)
            J = np.block([[G, A[:, on]], [B[on], -D[np.ix_(on, on)]]])
            right = np.concatenate([data, system.q[on]])
            try:
                x = np.linalg.solve(J, right)
            except np.linalg.LinAlgError:
                continue
            if not np.isfinite(x).all():
                continue
            z, lam = x[:n], np.zeros(m)
            lam[on] = x[n:]
            candidates.append((z, lam))
        # zero is what is rounding next to the values of all modes: a solution may be zero
        # altogether
        sizes = [
            max((float(np.max(np.abs(c[k]), initial=0.0)) for c in candidates), default=0.0)
            for k in (0, 1)
        ]
        found: list[tuple[Floats, Floats]] = []
        for candidate in candidates:
            z, lam = (
                np.where(np.abs(v) <= _ZERO * size, 0.0, v)
                for v, size in zip(candidate, sizes, strict=True)
            )
            if self.residual(z, lam, time) < _SOLVED:
                self._add(found, z, lam)
        return found

    def search(self, time: float, start: Mapping[str, float]) -> list[tuple[Floats, Floats]]:
        """Return the solutions found from many points; more may exist."""
        found: list[tuple[Floats, Floats]] = []
        base, lam0 = self.begin(start)
        random = np.random.default_rng(2015)
        scale = 1.0 + float(np.max(np.abs(base), initial=0.0))
        for k in range(_STARTS):
            spread = scale * 10.0 ** random.uniform(-2.0, 1.5)
            z = base if k == 0 else base + spread * random.standard_normal(base.size)
            near = self._near((z, lam0), time)
            if near is not None:
                self._add(found, near[0], near[1])
        if not found:
            try:
                z, lam, _ = self.solve(None, time)
                found.append((z, lam))
            except NumericalError:
                return []
        return found

    def _add(self, found: list[tuple[Floats, Floats]], z: Floats, lam: Floats) -> None:
        size = max(float(np.max(np.abs(z), initial=0.0)), 1e-300)
        for other, _ in found:
            if np.max(np.abs(other - z), initial=0.0) <= _SAME * size:
                return
        found.append((z, lam))

    def _unsolved(self, time: float) -> Exception:
        rows = [name for name in self.assembly.rows if "#" not in name]
        shown = ", ".join(rows[:4]) + (" ..." if len(rows) > 4 else "")
        return unsolved(
            f"no solution was found at t = {time:.9g} for the unknowns {shown}",
            "give a starting point near the solution, or call .verdict() to see whether one exists",
            time=time,
        )
