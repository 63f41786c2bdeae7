"""Changes of set-valued elements during a run, kept as arrays and shown as objects."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, slots=True)
class Event:
    """A change of state of one or more set-valued elements.

    Parameters
    ----------
    time : float
        [s]
    element : str
        Name of the element, with the branch for elements of several pairs: ``z1.fwd``.
    change : str
        ``"on"`` (begins to conduct) or ``"off"``.
    """

    time: float
    element: str
    change: str


class Events(Sequence[Event]):
    """Events in the order of time.

    A run may have ten thousand of them, and to create an object for each takes a noticeable part of
    its time: they are created when they are first read.

    Parameters
    ----------
    times : ndarray, shape (k,)
        [s], in order
    numbers : ndarray of int, shape (k,)
        Positions in ``names``.
    on : ndarray of bool, shape (k,)
    names : sequence of str

    Examples
    --------
    >>> numbers, on = np.array([0, 1]), np.array([True, False])
    >>> events = Events(np.array([1.0, 2.0]), numbers, on, ("d1", "d2"))
    >>> [(e.time, e.element, e.change) for e in events]
    [(1.0, 'd1', 'on'), (2.0, 'd2', 'off')]
    """

    def __init__(
        self,
        times: npt.NDArray[np.float64],
        numbers: npt.NDArray[np.unsignedinteger],
        on: npt.NDArray[np.bool_],
        names: Sequence[str],
    ) -> None:
        self.times, self.numbers, self.on, self.names = times, numbers, on, names

    @classmethod
    def merged(cls, parts: Iterable[Events]) -> Events:
        """Return the events of several islands as one list."""
        parts = [part for part in parts if len(part)]
        if len(parts) == 1:
            return parts[0]
        if not parts:
            none = np.zeros(0)
            return cls(none, none.astype(np.uintp), none.astype(bool), ())
        offsets = np.cumsum([0, *(len(part.names) for part in parts)]).astype(np.uintp)
        times = np.concatenate([part.times for part in parts])
        numbers = [part.numbers + k for part, k in zip(parts, offsets, strict=False)]
        order = np.argsort(times, kind="stable")
        return cls(
            times[order],
            np.concatenate(numbers)[order],
            np.concatenate([part.on for part in parts])[order],
            [name for part in parts for name in part.names],
        )

    def __len__(self) -> int:
        return self.times.size

    @overload
    def __getitem__(self, k: int) -> Event: ...
    @overload
    def __getitem__(self, k: slice) -> list[Event]: ...
    def __getitem__(self, k: int | slice) -> Event | list[Event]:
        if isinstance(k, slice):
            return [self[j] for j in range(*k.indices(len(self)))]
        name = self.names[int(self.numbers[k])]
        return Event(float(self.times[k]), name, "on" if self.on[k] else "off")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]  # equal to lists, which have no hash

    def __repr__(self) -> str:
        return repr(list(self))
