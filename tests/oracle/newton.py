"""Solutions of static systems with smooth laws by enumeration of modes and a plain damped Newton.

Independent of the core: the tape is interpreted in Python, each mode of the pairs is one smooth
system, and a point counts as a solution if it also satisfies the inequalities of its mode.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from nsspice.problems.descriptor import DescriptorSystem, Functional

from .tapes import run


class Static:
    """``G z + F f(z, u, t) + A lam = S u``, ``w = q - B z + D lam``, as dense arrays."""

    def __init__(self, system: DescriptorSystem) -> None:
        self.system = system
        self.G, self.A, self.B = system.G.dense(), system.A.dense(), system.B.dense()
        self.D, self.S, self.q = system.D.dense(), system.S.dense(), system.q
        self.n, self.m = system.n, system.m
        self.F = system.smooth.F.dense() if system.smooth else np.zeros((self.n, 0))

    def functions(self, z: np.ndarray, u: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        """Return f and its Jacobian."""
        if self.system.smooth is None:
            return np.zeros(0), np.zeros((0, self.n))
        return run(self.system.smooth.tape, z, u, t)

    def mode(
        self,
        active: Sequence[bool],
        u: np.ndarray,
        t: float,
        guess: np.ndarray,
        tolerance: float = 1e-13,
    ) -> np.ndarray | None:
        """Return (z, lam) of one mode, None if Newton's method does not get there."""
        on = np.array(active, dtype=bool)
        x = guess.copy()

        def residual(point: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            z, lam = point[: self.n], point[self.n :]
            f, df = self.functions(z, u, t)
            top = self.G @ z + self.F @ f + self.A @ lam - self.S @ u
            slack = self.q - self.B @ z + self.D @ lam
            low = np.where(on, slack, lam)
            pick = on[:, None]
            left, right = np.where(pick, -self.B, 0.0), np.where(pick, self.D, np.eye(self.m))
            jacobian = np.block([[self.G + self.F @ df, self.A], [left, right]])
            return np.concatenate([top, low]), jacobian

        value, jacobian = residual(x)
        for _ in range(400):
            # rows of 1e-12 S beside rows of 1: scale them before solving
            scale = np.maximum(np.abs(jacobian).max(axis=1), 1e-300)
            try:
                step = np.linalg.solve(jacobian / scale[:, None], -value / scale)
            except np.linalg.LinAlgError:
                return None
            size = 1.0
            while size > 1e-9:
                new = x + size * step
                there, slope = residual(new)
                finite = np.all(np.isfinite(there)) and np.all(np.isfinite(slope))
                if finite and np.abs(there / scale).max() <= (1 - 1e-4 * size) * max(
                    np.abs(value / scale).max(), tolerance
                ):
                    break
                size /= 2
            else:
                return None
            moved = np.abs(new - x).max()
            x, value, jacobian = new, there, slope
            if moved <= tolerance * max(1.0, np.abs(x).max()):
                return x
        return None

    def solutions(
        self, u: Sequence[float] = (), t: float = 0.0, guesses: Sequence[np.ndarray] = ()
    ) -> Iterator[np.ndarray]:
        """Yield every different (z, lam) that Newton finds from the guesses, over all modes."""
        found: list[np.ndarray] = []
        source = np.asarray(u, dtype=float)
        for active in product((False, True), repeat=self.m):
            for guess in guesses or (np.zeros(self.n + self.m),):
                x = self.mode(active, source, t, np.asarray(guess, dtype=float))
                if x is None:
                    continue
                slack = self.q - self.B @ x[: self.n] + self.D @ x[self.n :]
                if min(x[self.n :].min(initial=0.0), slack.min(initial=0.0)) < -1e-9:
                    continue
                if all(np.abs(x - other).max() > 1e-7 for other in found):
                    found.append(x)
                    yield x

    def output(self, functional: Functional, x: np.ndarray, u: Sequence[float] = ()) -> float:
        """Return a static output at a point."""
        z, lam = x[: self.n], x[self.n :]
        source = np.asarray(u, dtype=float)
        total = sum(c * z[j] for j, c in functional.z) + sum(c * lam[j] for j, c in functional.lam)
        total += sum(c * source[j] for j, c in functional.u)
        if functional.f:
            f = self.functions(z, source, 0.0)[0]
            total += sum(c * f[j] for j, c in functional.f)
        return float(total)
