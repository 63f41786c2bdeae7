"""The analyses as small data objects."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ...errors import Diagnostic, Span, UsageError
from ...netlist.deck import DcCard, OpCard, Sweep, TranCard
from ..signals.curve import Floats
from .arguments import finite

#: output points of a run whose rows nobody reads
_FEW = 64.0


@dataclass(frozen=True, slots=True)
class Op:
    """The DC solution."""

    @classmethod
    def from_card(cls, card: OpCard) -> Op:
        """Return the analysis of a card."""
        return cls()


@dataclass(frozen=True, slots=True)
class Dc:
    """DC solutions over swept values, the first sweep running fastest.

    Parameters
    ----------
    sweeps : tuple of Sweep
    """

    sweeps: tuple[Sweep, ...]

    @classmethod
    def from_card(cls, card: DcCard) -> Dc:
        """Return the analysis of a card."""
        return cls(card.sweeps)

    @property
    def grid(self) -> list[Floats]:
        """Value of each sweep at every point, shape (number of points,) each."""
        axes = np.meshgrid(*(s.values for s in reversed(self.sweeps)), indexing="ij")
        return [np.asarray(a, dtype=np.float64).ravel() for a in reversed(axes)]


@dataclass(frozen=True, slots=True)
class Tran:
    """Waveforms over time, from 0 to ``stop``.

    Parameters
    ----------
    stop : float
        End [s].
    row_step : float or None
        Distance of the output rows [s]; a thousandth of the shown time if left out.
    start : float
        First output row [s]; the computation begins at 0 all the same.
    max_step : float or None
        Upper bound of the solver step [s].
    uic : bool
        Start from the initial values of the elements instead of the DC solution.

    Examples
    --------
    >>> Tran(stop=1e-3, row_step=1e-5).solver_step()
    1e-05
    >>> round(Tran(stop=1e-3, row_step=1e-4).solver_step(3e-5) * 1e6, 9)
    25.0
    """

    stop: float
    row_step: float | None = None
    start: float = 0.0
    max_step: float | None = None
    uic: bool = False

    def __post_init__(self) -> None:
        times = (
            self.stop,
            self.start,
            1.0 if self.row_step is None else self.row_step,
            1.0 if self.max_step is None else self.max_step,
        )
        for time in times:
            if not finite(time):
                raise _times(f"the times of a transient must be finite numbers, not {time!r}")
        if self.stop <= 0.0 or not 0.0 <= self.start < self.stop:
            raise _times(
                f"a transient needs 0 <= start < stop, not {self.start:g} and {self.stop:g}"
            )
        if min(times[2:]) <= 0.0:
            raise _times(f"the steps of a transient must be positive, not {min(times[2:]):g}")

    @classmethod
    def from_card(cls, card: TranCard) -> Tran:
        """Return the analysis of a card."""
        return cls(card.tstop, card.tstep or None, card.tstart, card.tmax or None, card.uic)

    def bounded(self, max_step: float | None) -> Tran:
        """Return the analysis with no longer steps than these [s], if they are given.

        Examples
        --------
        >>> Tran(1e-3, max_step=1e-6).bounded(1e-5).max_step, Tran(1e-3).bounded(1e-5).max_step
        (1e-06, 1e-05)
        """
        longest = [step for step in (self.max_step, max_step) if step is not None]
        return replace(self, max_step=min(longest)) if longest else self

    def thinned(self) -> Tran:
        """Return the analysis with few output points."""
        distance = max(self.row_distance, (self.stop - self.start) / _FEW)
        return replace(self, row_step=distance)

    @property
    def row_distance(self) -> float:
        """Distance of the output rows [s]."""
        return self.row_step or (self.stop - self.start) / 1000.0

    def solver_step(self, step: float | None = None) -> float:
        """Return the solver step [s]: what is asked for, cut so that it divides the row distance.

        Without a request it is ``tmax`` if given, else SPICE's
        ``min(tstep, (tstop - tstart) / 50)``.
        """
        self._check_length(step)
        rows = self.row_distance
        wanted = step or self.max_step or min(rows, (self.stop - self.start) / 50.0)
        return rows / max(1, math.ceil(rows / wanted * (1.0 - 1e-12)))

    def longest_step(self, step: float | None = None, timed: bool = False) -> float:
        """Return the longest step of a run with step control [s].

        That is what is asked for, else ``tmax`` if given, else a fiftieth of the shown time.  How
        fast laws of the time are (``timed``) cannot be seen in them: then at most the distance of
        the rows.
        """
        self._check_length(step)
        usual = (self.stop - self.start) / 50.0
        return step or self.max_step or (min(usual, self.row_distance) if timed else usual)

    def _check_length(self, step: float | None) -> None:
        """Refuse steps by which the time would not move."""
        wanted = step or self.max_step
        least = 2.0 * float(np.finfo(float).eps) * self.stop
        if wanted is not None and wanted < least:
            raise UsageError(
                Diagnostic(
                    "NS4005",
                    f"steps of {wanted:g} s do not move a time of {self.stop:g} s: they are "
                    f"below its rounding",
                    hint=f"use steps of {1e-6 * self.stop:g} s or more",
                )
            )

    @property
    def row_count(self) -> int:
        """Number of output rows."""
        whole, rest = self._whole
        return whole + 1 + rest

    def rows(self, first: int = 0, last: int | None = None) -> Floats:
        """Return the times of the rows ``first`` to ``last``, the latter not included.

        Rows are at ``start + k row_step`` and at ``stop``.

        Examples
        --------
        >>> Tran(stop=1.0, row_step=0.4).rows().tolist()
        [0.0, 0.4, 0.8, 1.0]
        """
        _, rest = self._whole
        last = self.row_count if last is None else min(last, self.row_count)
        k = np.arange(first, last, dtype=np.float64)
        times: Floats = self.start + k * self.row_distance
        if rest and last == self.row_count:
            times[-1] = self.stop
        return times

    @property
    def _whole(self) -> tuple[int, bool]:
        """How often the row distance fits, and whether something is left before the stop."""
        step = self.row_distance
        whole = math.floor((self.stop - self.start) / step * (1.0 + 1e-12))
        return whole, self.stop - (self.start + whole * step) > 1e-9 * step


def _times(message: str, span: Span | None = None) -> UsageError:
    return UsageError(
        Diagnostic("NS4005", message, span, "as in .tran tstep tstop [tstart [tmax]]")
    )
