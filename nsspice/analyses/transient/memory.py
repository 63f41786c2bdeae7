"""What controllers remember between two periods of a steady state."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..signals.curve import Floats


@dataclass(frozen=True, slots=True)
class Memory:
    """What controllers, converters and counters remember, just before an instant.

    Parameters
    ----------
    reads : tuple of float
        What is read at the instant.
    sources : dict of str to float
        Values of the sources [V or A].
    states : tuple of tuple of float
        Of the functions of the controllers.
    samples : tuple of tuple of float
        Which converters have taken, and nobody has got yet.
    pending : tuple of (float, int, int, float)
        What will be written: when [s], by which controller, to which of its targets, the value.
    counters : tuple of (float, float, float)
        What is written, what is compared with, and when the output has turned [s].
    outputs : tuple of bool or None
        Those of the counters.
    """

    reads: tuple[float, ...]
    sources: dict[str, float]
    states: tuple[tuple[float, ...], ...] = ()
    samples: tuple[tuple[float, ...], ...] = ()
    pending: tuple[tuple[float, int, int, float], ...] = ()
    counters: tuple[tuple[float, float, float], ...] = ()
    outputs: tuple[bool | None, ...] = ()

    @property
    def numbers(self) -> Floats:
        """All that may change continuously."""
        parts: list[Sequence[float]] = [self.reads, [*self.sources.values()], *self.states]
        parts += [*self.samples, [value for *_, value in self.pending], *self.counters]
        return np.array([v for part in parts for v in part], dtype=np.float64)

    @property
    def shape(self) -> tuple[object, ...]:
        """All that does not."""
        sizes = tuple(map(len, self.states)), tuple(map(len, self.samples))
        return sizes, tuple((k, j) for _, k, j, _ in self.pending), self.outputs

    def moved(self, numbers: Floats) -> Memory:
        """Return the memory with other numbers."""
        left = iter(numbers.tolist())

        def like(values: Sequence[float]) -> tuple[float, ...]:
            return tuple(next(left) for _ in values)

        reads = like(self.reads)
        sources = dict(zip(self.sources, like([*self.sources.values()]), strict=True))
        states = tuple(like(state) for state in self.states)
        samples = tuple(like(some) for some in self.samples)
        pending = tuple((t, k, j, next(left)) for t, k, j, _ in self.pending)
        counters = tuple((next(left), next(left), next(left)) for _ in self.counters)
        return replace(
            self,
            reads=reads,
            sources=sources,
            states=states,
            samples=samples,
            pending=pending,
            counters=counters,
        )
