"""The certificate of one island: feeds what an engine recorded to the checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...circuit import MnaSystem
from ...errors import Diagnostic
from ...problems.csc import Csc, Floats
from ...problems.descriptor import DescriptorSystem
from ...problems.passivity import observing
from ...solvers.audit import Auditor
from ...solvers.compiled import shows_passive
from ...solvers.intervals import Recording
from ...solvers.moreau import Recorded
from ...solvers.stepper import Jump, Turned
from .certificate import Certificate
from .energy import Energy, Jumped, worse
from .free_currents import FreeCurrents
from .impulse_signs import impulse_error
from .impulses import delivered, followed, start_of, stored_functions
from .uniqueness import Watcher

if TYPE_CHECKING:
    from .expression_check import ExpressionCheck
    from .regularity import Judge

#: Numbers recorded at most if every step is: a few milliseconds of checking.
_ALL = 40_000
#: Otherwise one in this many steps is recorded, and those that change the mode: each of the first
#: thousand, later as many as cost little compared with the run.
_EVERY = 128
_WINDOW = 1
#: Part by which what is stored may change between two steps without a jump: as the root of its
#: energy, relative to the largest.  Engines take changes of a charge by 1e-9 of the largest for
#: none; in a capacitor of 1e-8 of the largest that is 1e-5 of this root.
UNREPORTED = 1e-5
#: what is looked at in all segments of the exact engine, and where the worst of each is
_SIGNS = {"complementarity": "worst_pair", "gates": "worst_gate", "sources": "worst_source"}


def sampling(steps: float, size: int) -> tuple[int, int]:
    """Return which steps to record, for a run of so many steps of a system of a size.

    Examples
    --------
    >>> sampling(1000, 10), sampling(1e7, 10)
    ((1, 1), (128, 1))
    """
    return (1 if steps * size <= _ALL else _EVERY), _WINDOW


def judge_of_points(mna: MnaSystem, system: DescriptorSystem) -> Judge | None:
    """Return what judges whether points without storage are unique: linear ones always are."""
    if system.m == 0 and system.smooth is None:
        return None
    from .regularity import Judge

    return Judge(mna, system)


class Examiner:
    """Checks the recorded steps of one island.

    Parameters
    ----------
    mna : MnaSystem
    H, Hs : Csc, optional
        Averaging terms of the scheme.
    system : DescriptorSystem, optional
        What was solved, if it is not the system of ``mna`` (the points of a sweep).
    frozen : float, optional
        The time that smooth functions see [s], if that of the records counts something else.
    step : float, optional
        Solver step [s]; None where nothing is stored.
    timed : bool
        The records are of instants, at which sources have the values of their waveforms.
    """

    def __init__(
        self,
        mna: MnaSystem,
        H: Csc | None = None,
        Hs: Csc | None = None,
        system: DescriptorSystem | None = None,
        frozen: float | None = None,
        step: float | None = None,
        timed: bool = False,
    ) -> None:
        self.mna, self.frozen = mna, frozen
        system = system or mna.system
        self.auditor = Auditor(system, H, Hs, timed)
        self._step = step
        self._free = FreeCurrents(system)
        # points of other schemes than the implicit one hold averages; without storage each record
        # is a solution at an instant, while the end of an implicit step is next to an event
        pointwise = step is None and mna.system.static
        self._expressions = _expressions(mna, frozen, H is not None, pointwise)
        self._active: Watcher | None = None
        passive = shows_passive(system)
        rest = None if passive else mna.without_lines()
        #: what smooth laws store is not a form of their unknowns: its energy is not known here
        self._passive = passive and system.smooth is None
        if not passive and (rest is None or not shows_passive(rest)):
            self._active = Watcher(system, H, step)

    def take(self, records: Recorded) -> None:
        """Check recorded steps."""
        if not len(records):
            return
        if self._active is not None:
            self._active.take(records)
        self._free.take(records.z, records.lam, records.roles)
        if self._expressions is not None:
            self._expressions.take_points(records)
        self.auditor.check(records, self.frozen)

    def take_intervals(self, intervals: Recording) -> None:
        """Check recorded intervals of continuous solutions."""
        last = np.s_[:, -1]
        roles = np.asarray(intervals.roles)
        self._free.take(intervals.z[last], intervals.lam[last], roles if roles.size else None)
        if self._expressions is not None:
            self._expressions.take_intervals(intervals)
        self.auditor.check_intervals(intervals)

    def certificate(
        self,
        steps: int,
        undetermined: int,
        jumps: Sequence[Jump] = (),
        start: tuple[Floats, float] | None = None,
        kept: bool = True,
        sums: Mapping[str, float] | None = None,
        turns: Sequence[Turned] = (),
        tolerance: float = 0.0,
        segments: Mapping[str, Any] | None = None,
    ) -> Certificate:
        """Return the verdict on a run.

        Parameters
        ----------
        steps, undetermined : int
            Accepted steps, and those from a mode that leaves something open.
        jumps : sequence of Jump
        start : (ndarray, float) or None
            Charges (n,) and energy [J] from which the run started.
        kept : bool
            False if there were more jumps than are kept.
        sums : mapping, optional
            Energies of all steps, from the stepper that was accompanied.
        turns : sequence of tuple
            Gates that have turned, as the stepper shows them.
        tolerance : float
            Of steps, to which they know the instants of turns.
        segments : mapping, optional
            What was found in all segments of the exact engine.
        """
        audit = self.auditor
        if turns:
            audit.check_turns(turns, tolerance)
        balance, jumped = 0.0, Jumped()
        # eigenvalues may decide: only jumps ask for it
        observed = observing(self.mna.system) if self._passive and jumps else None
        for number, jump in enumerate(jumps):
            charges, before = start_of(self.mna, jump, start if number == 0 else None)
            after = self.mna.system.E.dot(jump.after)
            reached_functions = stored_functions(self.mna, jump, jump.after)
            moved = after + reached_functions - charges
            sizes = np.abs(charges) + np.abs(reached_functions)
            reached = self.mna.system.stored_energy(jump.after)
            given = delivered(self.mna, jump)
            gave = None if observed is None else given + followed(observed, jump)
            error = audit.jump_error(moved, jump, sizes, gave)
            balance = error if worse(error, balance) else balance
            jumped.add(before, reached, given)
        signs = impulse_error(self.mna.system, jumps, sums["turned"] if sums else 0.0)
        balance = signs if worse(signs, balance) else balance
        found = audit.result()
        if segments is not None:
            for key, place in _SIGNS.items():
                if worse(segments[key], found.get(key, 0.0)):
                    found[key], found[place] = segments[key], segments[place]
        # what changes without a report is a jump that nobody accounts for
        balance = found["boundaries"] if worse(found["boundaries"], balance) else balance
        unreported = sums["unreported"] if sums else 0.0
        if worse(unreported, max(UNREPORTED, balance)):
            balance = unreported
        energy = None
        if sums is not None:
            energy = Energy.of_run(sums, jumped, (found["steps"], steps), kept)
        laws, worst = found["laws"], self._name(found["worst_row"])
        source = found.get("worst_source")
        if source is not None and worse(found["sources"], laws):
            laws, worst = found["sources"], self._source(source)
        gate = found.get("worst_gate")
        if gate is not None and worse(found["gates"], laws):
            laws, worst = found["gates"], f"the gate of {self.mna.pair_elements[gate]}"
        if self._expressions is not None:
            error, name = self._expressions.worst
            if worse(error, laws):
                laws, worst = error, name
        return Certificate(
            laws,
            found["complementarity"],
            found["checks"],
            undetermined or self._free.points,
            energy,
            balance,
            worst,
            self.several,
        )

    @property
    def several(self) -> tuple[str, ...]:
        """Set-valued elements of an island whose steps may have several solutions."""
        if self._active is None or not self._active.verdict().several:
            return ()
        switched = self.mna.system.switched
        names = (e for k, e in enumerate(self.mna.pair_elements) if k not in switched)
        return tuple(dict.fromkeys(names))

    def warnings(self) -> list[Diagnostic]:
        """Return what the user should know about an active island."""
        if self._active is None:
            return []
        found = self._active.verdict()
        out = []
        if several := self.several:
            out.append(
                Diagnostic(
                    "NS3050",
                    f"controlled sources feed back on {_list(several)}: a step may have several "
                    f"solutions; the one nearest to the previous step is chosen",
                    hint="choose with initial values (IC=, .ic), or for the DC solution with "
                    ".nodeset",
                    severity="warning",
                )
            )
        if self._step is not None and found.growth * self._step > 1.0:
            out.append(
                Diagnostic(
                    "NS3051",
                    f"a mode grows with {found.growth:.3g} 1/s, {found.growth * self._step:.3g} "
                    "times per step: the implicit step misses its growth and may converge to an "
                    "unstable equilibrium",
                    hint=f"use a step below {0.5 / found.growth:.1e} s",
                    severity="warning",
                )
            )
        return out

    def _source(self, column: int) -> str:
        """Return the source of a column: an element, or the node that it feeds."""
        S = self.mna.system.S
        row = int(S.indices[S.columns == column][0])
        element = self.mna.row_elements[row]
        return element if element is not None else f"the source at node {self.mna.row_nodes[row]}"

    def _name(self, row: int | None) -> str:
        """Return the law of a row: an element, or the current law of a node."""
        if row is None:
            return ""
        element = self.mna.row_elements[row]
        return element if element is not None else f"node {self.mna.row_nodes[row]}"


def _expressions(
    mna: MnaSystem, frozen: float | None, averaged: bool, pointwise: bool
) -> ExpressionCheck | None:
    """Return the check of the expressions of a deck; most have none."""
    layout = mna.layout
    if not (layout.readings or layout.stated or layout.compared):
        return None
    from .expression_check import ExpressionCheck

    return ExpressionCheck(mna, frozen, averaged, pointwise)


def _list(names: Sequence[str]) -> str:
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")
