"""What a transient has recorded between its rows, and signals as functions of time made of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, UsageError
from ..request.recorder import Recorder
from ..signals.signal_function import Floats, Motion, Pieces, aligned
from ..signals.signal_names import canonical


@dataclass(frozen=True, slots=True)
class Recording:
    """Pieces of what some islands have recorded between two instants.

    Parameters
    ----------
    circuit : Circuit
    names : sequence of tuple of str
        Of each island: its recorded quantities.
    pieces : sequence of Pieces or None
        Of each island, None where nothing was recorded.
    start, stop : float
        From when to when signals are recorded [s].
    """

    circuit: Circuit
    names: Sequence[tuple[str, ...]]
    pieces: Sequence[Pieces | None]
    start: float
    stop: float

    def holds(self, names: Sequence[str], start: float, stop: float) -> bool:
        """Return whether signals are recorded over a window."""
        if not self.start <= start <= stop <= self.stop:
            return False
        local = Recorder(self.circuit, list(names)).local
        return all(set(need) <= set(have) for need, have in zip(local, self.names, strict=True))

    def motion(self, names: Sequence[str], start: float, stop: float) -> Motion:
        """Return signals over a window as functions of time."""
        recorder = Recorder(self.circuit, list(names))
        parts = []
        for need, have, pieces in zip(recorder.local, self.names, self.pieces, strict=True):
            if need and pieces is not None:
                near = pieces.within(start, stop)
                rows = [have.index(name) for name in need]
                parts.append(Pieces(near.begin, near.length, near.values[rows]))
        if not parts:  # nothing but the ground
            parts = [Pieces(np.array([start]), np.array([stop - start]), np.zeros((0, 1, 2)))]
        return Motion(aligned(parts), _Combined(recorder, tuple(names)))


@dataclass(frozen=True, slots=True)
class _Combined:
    """Makes signals of recorded quantities."""

    recorder: Recorder
    names: tuple[str, ...]

    def __call__(self, columns: Floats) -> Mapping[str, Floats]:
        rows = columns.reshape(columns.shape[0], int(np.prod(columns.shape[1:]))).T
        found = self.recorder.signals(rows).T.reshape(len(self.names), *columns.shape[1:])
        return dict(zip(self.names, found, strict=True))


class Again(Protocol):
    """Runs a transient once more."""

    def __call__(self, names: Sequence[str], start: float, stop: float) -> Recording:
        """Record signals over a window [s]."""

    def circuit(self) -> Circuit:
        """Return the circuit that was run."""

    def integrals(self) -> Any:
        """Return the integrals of its signals in closed form."""


def recorded(
    recording: Recording | None,
    again: Again,
    names: Sequence[str],
    window: tuple[float, float],
    run: tuple[float, float],
) -> Recording:
    """Return a recording that holds signals over a window: the one that is there, or a new one.

    Parameters
    ----------
    recording : Recording or None
        What is there.
    again : callable
        Makes another.
    names : sequence of str
    window, run : (float, float)
        From when to when signals are needed, and have been computed [s].

    Raises
    ------
    UsageError
        NS4028 if more happens in the window than can be kept.
    """
    for wide in (None, run, window):
        if wide is not None:
            recording = again(names, *wide)
        if recording is not None and recording.holds(names, *window):
            return recording
    raise UsageError(
        Diagnostic(
            "NS4028",
            f"too much happens from {window[0]:g} s to {window[1]:g} s to be kept",
            hint="ask for a shorter window, with start= and stop=, or from= and to=",
        )
    )


def named(names: Sequence[str]) -> list[str]:
    """Return canonical names, each once.

    Examples
    --------
    >>> named(["V(A)", "v(a)", "i(R1)"])
    ['v(a)', 'i(r1)']
    """
    return list(dict.fromkeys(map(canonical, names)))
