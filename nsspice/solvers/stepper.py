"""The base class of all engines: rows in blocks, jumps, events, failures."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..problems.csc import Floats
from ..problems.descriptor import DescriptorSystem

if TYPE_CHECKING:
    from .certificate import Certificate


class UnsolvedStep(Exception):
    """A step (or static problem) has no solution, or none was found.

    Parameters
    ----------
    time : float
        End of the step [s], or the swept value.
    residual : float
        Best residual reached.
    certificate : Certificate or None
        Proof that the laws contradict each other; None if none was found.
    worst_row : int or None
        The row that the best point of Newton's method violates most.
    point : ndarray, shape (n,), or None
        The unknowns of that point.
    restless : int or None
        The pair of a switch that finds no state: closed it opens, open it closes.
    """

    def __init__(
        self,
        time: float,
        residual: float,
        certificate: Certificate | None,
        worst_row: int | None = None,
        restless: int | None = None,
        point: Floats | None = None,
    ) -> None:
        self.time = time
        self.residual = residual
        self.certificate = certificate
        self.worst_row = worst_row
        self.restless = restless
        self.point = point
        if certificate is not None:
            text = f"no solution at {time!r}: its equations and inequalities contradict each other"
        else:
            text = f"no solution was found at {time!r} (residual {residual:.2g})"
        super().__init__(text)


def check_plan(start: float, stop: float, step: float, out_start: float, out_step: float) -> None:
    """Refuse a plan that goes nowhere.

    Raises
    ------
    ValueError
        If an instant is not finite, the end comes before the beginning, or a step is not positive.

    Examples
    --------
    >>> check_plan(0.0, 1.0, -0.1, 0.0, 0.1)
    Traceback (most recent call last):
    ...
    ValueError: step is -0.1: a positive time is needed
    """
    for name, instant in (("start", start), ("stop", stop), ("out_start", out_start)):
        if not math.isfinite(instant):
            raise ValueError(f"{name} is {instant}: a finite number is needed")
    if stop < start:
        raise ValueError(f"stop is {stop:g}: it must not come before start, {start:g}")
    for name, length in (("step", step), ("out_step", out_step)):
        if not length > 0.0:
            raise ValueError(f"{name} is {length:g}: a positive time is needed")


def restless(failure: Mapping[str, Any]) -> UnsolvedStep:
    """Return the failure of a switch that finds no state."""
    return UnsolvedStep(failure["time"], failure["residual"], None, restless=failure["restless"])


@dataclass(frozen=True, slots=True)
class Jump:
    """A jump of stored charges or fluxes, with the impulses that caused it.

    Parameters
    ----------
    time : float
        [s]
    before, after : ndarray, shape (n,)
        Unknowns on both sides.
    multipliers : ndarray, shape (m,)
        Impulse of each multiplier [A s, or V s].
    unknowns : ndarray, shape (n,)
        Impulse of each unknown; meaningful for branch currents [A s] and node voltages [V s] that
        have no storage of their own.
    functions : ndarray, shape (k,)
        Impulse of each smooth function [A s, or V s].
    sources : ndarray, shape (p,)
        Source values after the jump.
    length : float
        Of the short steps whose limit the jump is [s]; 0 for a closed form.
    span : float
        The impulses contain what ordinary values carry in this time [s]; 0 if they are a limit.
    """

    time: float
    before: Floats
    after: Floats
    multipliers: Floats
    unknowns: Floats
    functions: Floats
    sources: Floats
    length: float
    span: float


#: when [s], number of the switch, its gate before, its control, the multiplier of its pair, and
#: whether the instant was searched for
Turned = tuple[float, int, bool, float, float, bool]


#: what the core says where a source is known no further
_WAITING = 3


class Stepper(ABC):
    """A plan of rows through time, computed block by block by the compiled core.

    Parameters
    ----------
    system : DescriptorSystem
    core
        The compiled object.
    columns : int
        Numbers in a row: the time, then the outputs.
    """

    def __init__(self, system: DescriptorSystem, core: Any, columns: int) -> None:
        self.system = system
        self._core = core
        #: numbers in a row, the time included
        self.columns = columns
        self._buffer = np.empty((0, columns))
        #: what ``to_the_wait`` has met instead of a wait
        self._row = np.empty((1, columns))
        self._early: tuple[int, int] | None = None
        #: unknowns and multipliers of the DC solution with which the run begins, if it does
        self.dc_point: tuple[Floats, Floats] | None = None
        #: the static solution as a record, where it is not among those of the run
        self.dc_records: _core.Records | None = None
        #: the last call has ended at an instant beyond which a source is not known, or the run
        self.waits = self.done = False
        #: rows computed before the last failure
        self.pending = self._buffer

    @abstractmethod
    def start_dc(self, time: float = 0.0, guess: tuple[Floats, Floats] | None = None) -> Floats:
        """Start from the static solution at a time [s], near a guess, and return its unknowns."""

    def leave_dc(self) -> None:  # noqa: B027 - engines whose start has done so already
        """Let the ideal edges of sources at the start act on the static solution: charges stay."""

    @abstractmethod
    def start_charges(
        self,
        time: float,
        charges: Floats,
        step: float,
        guess: tuple[Floats, Floats] | None = None,
    ) -> Jump | None:
        """Start from stored charges and fluxes, shape (n,); return what the start had to move."""

    def plan(
        self, start: float, stop: float, step: float, out_start: float, out_step: float
    ) -> int:
        """Plan a run from ``start`` to ``stop`` with steps of at most ``step`` [s].

        Rows are at ``out_start + k out_step`` and at ``stop``.  The exact engine, which begins at
        0, takes steps only where no mode can be proved.

        Returns
        -------
        int
            Number of rows to come.

        Raises
        ------
        ValueError
            If an instant is not finite, or a step is not positive.
        """
        check_plan(start, stop, step, out_start, out_step)
        return self._plan(start, stop, step, out_start, out_step)

    @abstractmethod
    def _plan(
        self, start: float, stop: float, step: float, out_start: float, out_step: float
    ) -> int:
        """Plan a run; see :meth:`plan`."""

    @abstractmethod
    def follow(self, outputs: Sequence[int], start: float, stop: float) -> None:
        """Record some outputs between the rows, from ``start`` to ``stop`` [s]."""

    @abstractmethod
    def take_records(self) -> _core.Records:
        """Return the implicit steps recorded since the last call."""

    @abstractmethod
    def _diagnose(self, failure: Mapping[str, Any]) -> UnsolvedStep | None:
        """Ask for a proof of infeasibility; None if the suspect solution proves genuine."""

    def _first_jump(self) -> Jump | None:
        jumps = self.jumps
        return jumps[0] if jumps else None

    def advance(
        self, max_rows: int, budget: float = 0.1, into: Floats | None = None
    ) -> tuple[Floats, bool]:
        """Compute the next rows.

        Parameters
        ----------
        max_rows : int
            Upper bound of the rows returned.
        budget : float
            Time after which to come back with what is there [s].
        into : ndarray, shape (max_rows, 1 + outputs), optional
            Where the rows go; C-contiguous.

        Returns
        -------
        rows : ndarray, shape (k, 1 + outputs)
            Time first.  A view of ``into``, or of a buffer that the next call overwrites.
        done : bool
            True when the plan is finished.

        Raises
        ------
        UnsolvedStep
            If the laws have no solution; ``pending`` then holds the rows computed before it.
        """
        if into is not None:
            rows = into
        else:
            if self._buffer.shape[0] < max_rows:
                # kept: the first touch of fresh memory costs more than computing what goes there
                self._buffer = np.empty((max_rows, self.columns))
            rows = self._buffer[:max_rows]
        self.pending = rows[:0]
        filled = 0
        while True:
            if self._early is None:
                count, state = self._core.advance(rows[filled:], budget)
            else:
                (count, state), self._early = self._early, None
                rows[filled : filled + count] = self._row[:count]
            filled += count
            if state != 2:
                self.waits, self.done = state == _WAITING, state == 1
                return rows[:filled], state == 1
            self.pending = rows[:filled]
            failure = self._core.failure()
            assert failure is not None
            problem = self._diagnose(failure)
            if problem is not None:
                raise problem
            # a very large but genuine solution: the certificate found no contradiction
            self._core.accept_large()

    def to_the_wait(self) -> bool:
        """Advance to where a source is known no further; False if ``advance`` is to be called."""
        count, state = self._core.advance(self._row, 0.1)
        self.waits = state == _WAITING and count == 0
        self._early = None if self.waits else (count, state)
        return self.waits

    def at_wait(self, begin: bool = False) -> list[float] | None:
        """Return time and outputs where the run waits, just before, or at its begin.

        None at the begin of a run of the exact engine that begins with implicit steps.
        """
        row = self._core.sample(begin)
        return None if row is None else row.tolist()

    def show_all_points(self, start: float) -> None:
        """Add rows at all points of the engine from ``start`` [s] on, two where something jumps.

        Fixed steps have a point at each of their ends, the others where something switches or a
        source has a corner.
        """
        self._core.show_all_points(start)

    def watch_closely(self) -> None:
        """Keep also what only checks of rows and turning gates need; call it before the start."""
        self._core.watch_closely()

    def take_along(self, auditor: _core.Auditor) -> None:
        """Let the balance of energy of an auditor go with the run; call it before the start."""
        self._core.accompany(auditor)

    @property
    def balance(self) -> dict[str, float] | None:
        """The balance of energy over all steps up to now [J], None if none goes with the run.

        ``stored`` (jumps aside), ``delivered``, ``dissipated``, ``scheme``, the relative error
        ``drift`` of their sum, and the number of ``steps``.
        """
        return self._core.balance()  # type: ignore[no-any-return]

    @property
    def waiting(self) -> int:
        """Amount of records and rows that wait to be taken [numbers]."""
        return self._core.waiting()  # type: ignore[no-any-return]

    def take_sides(self) -> Floats:
        """Return the rows around jumps since the last call: before, after, before, after ..."""
        return self._core.take_sides().reshape(-1, self.columns)  # type: ignore[no-any-return]

    def take_pieces(self) -> Floats:
        """Return the pieces recorded since the last call, one in a row.

        Begin and length [s], then the values of one followed output after the other at the points
        of Chebyshev and Lobatto.
        """
        return self._core.take_pieces()  # type: ignore[no-any-return]

    @property
    def state(self) -> tuple[Floats, Floats]:
        """Present unknowns (n,) and multipliers (m,)."""
        return self._core.state()  # type: ignore[no-any-return]

    @property
    def beginning(self) -> tuple[Floats, Floats]:
        """Unknowns (n,) and multipliers (m,) just after a start."""
        return self.state

    @property
    def time(self) -> float:
        """Present time [s]."""
        return self._core.time()  # type: ignore[no-any-return]

    @property
    def jumps(self) -> list[Jump]:
        """Jumps so far, the first few thousand in full."""
        return [Jump(**j) for j in self._core.jumps()]

    @property
    def events(self) -> tuple[Floats, npt.NDArray[np.uintp], npt.NDArray[np.bool_]]:
        """Changes of pairs so far: times [s], pairs, True where they conduct from then on.

        The first 65536 are kept, the others counted in ``statistics``.
        """
        return self._core.events()  # type: ignore[no-any-return]

    @property
    def written(self) -> tuple[int, list[float], list[float], list[float]]:
        """Rows handed out, weighted sums of each column and of its sizes, and what they must be.

        The last follow from the quantities that rows are made of; the time is not among them.
        """
        return self._core.written()  # type: ignore[no-any-return]

    def take_references(self) -> Floats:
        """Return some rows, computed once more, since the last call, shape (k, columns)."""
        return np.empty((0, self.columns))

    @property
    def turns(self) -> list[Turned]:
        """Gates that have turned, the first few thousand.

        Of each: when [s], the number of the switch, its state before, where the control was, the
        multiplier of the pair, and whether the instant was searched for.
        """
        return self._core.turns()  # type: ignore[no-any-return]

    @property
    def chattering(self) -> tuple[list[tuple[int, int, float]], float]:
        """Switches that have turned while they were sampled, and the time between two looks [s].

        A switch without hysteresis that takes its own control back across the threshold would
        change without end; such a one looks at its control at fixed instants only.  Of each: its
        pair, how often it has turned at one, and the part of its scale by which its control had
        passed the threshold at most.
        """
        return self._core.chattering()  # type: ignore[no-any-return]

    @property
    def resting(self) -> list[tuple[int, float]]:
        """Pairs of the switches whose controls stay at thresholds, and since when first [s]."""
        return self._core.resting()  # type: ignore[no-any-return]

    @property
    def unbounded(self) -> tuple[int, float] | None:
        """The row of the first unknown that no step could follow, and when [s]."""
        return None

    @property
    def statistics(self) -> dict[str, float]:
        """Counters of the run and the worst residuals of all checks."""
        return self._core.statistics()  # type: ignore[no-any-return]
