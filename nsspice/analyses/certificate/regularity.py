"""The verdict on DC solutions: the only one, locally the only one, one of several, or not known."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ...circuit import MnaSystem
from ...circuit.regularity import dc_uniqueness
from ...errors import Diagnostic
from ...problems.csc import Floats
from ...problems.descriptor import DescriptorSystem
from ...problems.feedback import undecided_switches
from ...problems.isolation import isolated
from ...problems.passivity import passive
from ...problems.piecewise import regular_at_kinks
from ...problems.regularity import Regularity, index_sets, strong_regularity
from ...problems.tape import Tape
from ...problems.verdict import Verdict
from ...solvers.intervals import Recording
from ...solvers.kinks import limits
from ...solvers.moreau import MoreauStepper, Recorded, function_slopes
from ...solvers.stepper import UnsolvedStep
from .switch_states import MOST, operating_points

_ROWS = 150  # unknowns and pairs up to which single points are judged
_POINTS = 100  # points judged at most
_STARTS = 24  # random points from which further solutions are sought
_MODES = 5  # pairs up to which every mode is a start
#: slopes beyond this are those of poles; the tape writes 1e150 for an infinite one
_STEEP = 1e100
_AT_KINK = 1e-9  # of the largest voltage or current: what Newton's method leaves open
_SAME = 1e-6  # solutions closer than this, relative to the largest, are one
_ALONE = (
    "for these values of the sources: all laws are monotone, and nothing is free at the solution"
)
_STATES = "for these values of the sources: every other state contradicts what controls it"
_FREE = "some quantities are free: a whole line of solutions"
_ROUNDING = 24.0 * 2.0**-53  # of a law with one equation, relative to the sizes of its terms


@dataclass(frozen=True, slots=True)
class SolutionVerdict:
    """What is known about a DC solution.

    Parameters
    ----------
    kind : str
        ``unique`` (proved, for any values of the sources or for those here), ``locally unique``
        (strongly metrically regular: it moves continuously with the sources, others may exist),
        ``several`` (others were found, or some quantity is free), ``not known``.
    reason : str
    elements : tuple of str
        Elements that prevent a proof.
    modulus : float or None
        Largest change of an unknown per unit of a law's right-hand side, at the worst point.
    place : str
        Which unknown, and which law: ``v(b) by the currents at node b``.
    solutions : tuple of dict
        Unknowns by name of every solution found, the one shown first, if there are several.
    points : int
        Points at which regularity was judged.
    uniqueness, regularity : Verdict or None
        What was proved of the circuit, and of the least regular of the points.
    """

    kind: str
    reason: str
    elements: tuple[str, ...] = ()
    modulus: float | None = None
    place: str = ""
    solutions: tuple[dict[str, float], ...] = ()
    points: int = 0
    uniqueness: Verdict | None = None
    regularity: Verdict | None = None

    def __str__(self) -> str:
        text = f"{self.kind}: {self.reason}"
        if self.elements:
            text += f" ({', '.join(self.elements)})"
        if self.modulus is not None and self.modulus > 0.0 and self.place:
            text += f"; most sensitive: {self.place}, {self.modulus:.3g} per unit"
        return text

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        return {
            "kind": self.kind,
            "reason": self.reason,
            "elements": list(self.elements),
            "modulus": self.modulus,
            "place": self.place,
            "solutions": [dict(s) for s in self.solutions],
            "points": self.points,
            "uniqueness": self.uniqueness.to_dict() if self.uniqueness is not None else None,
            "regularity": self.regularity.to_dict() if self.regularity is not None else None,
        }


@dataclass(slots=True)
class Judge:
    """Collects points of one island's static problem, and judges them when asked to.

    Parameters
    ----------
    mna : MnaSystem
    system : DescriptorSystem
        The static system that was solved.
    """

    mna: MnaSystem
    system: DescriptorSystem
    _points: int = 0
    #: of some records: unknowns, sources, multipliers, roles
    _kept: list[tuple[Floats, Floats, Floats, npt.NDArray[np.uint8] | None]] = field(
        default_factory=list
    )
    _verdict: SolutionVerdict | None = None

    def take(self, records: Recorded) -> None:
        """Keep some of the recorded points."""
        left = _POINTS - self._points
        count = len(records)
        if self._large or left <= 0 or count == 0:
            return
        left = min(left, count)
        chosen = np.arange(left) * (count - 1) // max(left - 1, 1)
        roles = None if records.roles is None else records.roles[chosen]
        self._points += left
        self._kept.append((records.z[chosen], records.u[chosen], records.lam[chosen], roles))

    def take_intervals(self, intervals: Recording) -> None:
        """Keep some points of recorded intervals."""
        left = _POINTS - self._points
        time = np.asarray(intervals.time)
        if self._large or left <= 0 or not time.size:
            return
        left, points = min(left, time.size), time.shape[1]
        k = np.arange(left) * (time.size - 1) // max(left - 1, 1)
        z, u, lam = (
            np.reshape(v, (time.size, -1))[k] for v in (intervals.z, intervals.u, intervals.lam)
        )
        roles = np.asarray(intervals.roles)
        self._points += k.size
        self._kept.append((z, u, lam, roles[k // points] if roles.size else None))

    def _worst(self) -> Regularity | None:
        """Return the least regular of the points, None without any."""
        worst, system = None, self.system
        for z, u, lam, roles in self._kept:
            if system.smooth is None:
                found = strong_regularity(system, np.zeros((len(z), 0, system.n)), z, lam, roles)
            else:
                found = self._with_kinks(system.smooth.tape, z, u, lam, roles)
            if worst is None or found.badness > worst.badness:
                worst = found
        return worst

    def _with_kinks(
        self,
        tape: Tape,
        z: Floats,
        u: Floats,
        lam: Floats,
        roles: npt.NDArray[np.uint8] | None,
    ) -> Regularity:
        """Judge points with the slopes on all sides of the kinks of functions."""
        sides = [limits(tape, z[k], u[k], 0.0, self._near(z[k])) for k in range(len(z))]
        for side in sides:
            if side.jumps or not side.complete:
                names = [name for k in side.jumps for name in self.mna.function_elements(k)]
                text = f"a law jumps at the solution ({', '.join(names)})"
                if not side.complete:
                    text = "too many kinks meet at the solution"
                return Regularity(Verdict.undecided("strongly regular", text), float("inf"))
        found = []
        smooth = [k for k, side in enumerate(sides) if not len(side.directions)]
        if smooth:
            slopes = np.concatenate([sides[k].jacobians for k in smooth])
            kept = None if roles is None else roles[smooth]
            found.append(strong_regularity(self.system, slopes, z[smooth], lam[smooth], kept))
        for k, side in enumerate(sides):
            if len(side.directions):
                kept = None if roles is None else roles[k]
                found.append(regular_at_kinks(self.system, side.kinks, z[k], lam[k], kept))
        return max(found, key=lambda one: one.badness)

    def _near(self, z: Floats) -> Floats:
        """Return within which distances voltages and currents count as the same."""
        kinds = self.system.row_kind
        sizes = [float(np.abs(z[kinds == kind]).max(initial=0.0)) for kind in (0, 1)]
        return np.where(kinds == 0, sizes[0], sizes[1]) * _AT_KINK

    def verdict(self) -> SolutionVerdict:
        """Return what is known."""
        if self._verdict is None:
            self._verdict = self._judged()
        return self._verdict

    def later(self) -> Callable[[], SolutionVerdict] | SolutionVerdict:
        """Return what finds the verdict; of a large system the verdict, not to keep it alive."""
        return self.verdict() if self._large else self.verdict

    @property
    def _large(self) -> bool:
        return self.system.n + self.system.m > _ROWS

    def _judged(self) -> SolutionVerdict:
        """Return what is known without a search for further solutions."""
        proof, worst = dc_uniqueness(self.mna), self._worst()
        verdict = SolutionVerdict(
            "not known",
            proof.reason,
            proof.elements,
            points=self._points,
            uniqueness=proof.verdict,
            regularity=None if worst is None else worst.verdict,
        )
        regular = worst is not None and worst.strong is True
        if worst is not None and regular:
            verdict = replace(verdict, modulus=worst.modulus, place=self._place(worst))
        if proof.unique:
            return replace(verdict, kind="unique")
        beside = self._beside()
        if beside is not None and beside:
            return replace(verdict, kind="unique", reason=_ALONE, elements=())
        if regular:
            reason = f"strongly regular; uniqueness is not proved, {proof.reason}"
            return replace(verdict, kind="locally unique", reason=reason)
        if beside is not None and beside.holds is False and beside.witness is not None:
            free = self._elements(beside.witness.rows) or proof.elements
            return replace(verdict, kind="several", reason=_FREE, elements=free)
        if worst is not None and worst.verdict.decided:
            reason = f"not regular at the solution: {worst.verdict.reason}"
            between = self._elements(worst.between) or proof.elements
            return replace(verdict, reason=reason, elements=between)
        if worst is not None:
            return replace(verdict, reason=worst.verdict.reason)
        return verdict

    def _elements(self, pairs: Sequence[int]) -> tuple[str, ...]:
        return tuple(dict.fromkeys(self.mna.pair_elements[k] for k in pairs))

    def _beside(self) -> Verdict | None:
        """Return whether all points are the only solutions; None for systems of another kind."""
        system = self.system
        if system.smooth is not None or not passive(system) or not self._kept:
            return None
        if self._undecided:
            return None  # in another state there may be another solution
        open_: Verdict | None = None
        for z, _, lam, roles in self._kept:
            for verdict, _ in isolation_of(self.system, z, lam, roles):
                if verdict.holds is False:
                    return verdict
                open_ = verdict if verdict.holds is None or open_ is None else open_
        return open_

    @property
    def _undecided(self) -> tuple[int, ...]:
        """The switches whose state the rest does not decide."""
        return tuple(undecided_switches(self.system))

    def undetermined(self, records: Recorded, counted: int) -> int:
        """Return at how many of the recorded points something is free, of those counted as such.

        The core counts modes that leave something free, regardless of the inequalities: in a
        rectifier at rest all diodes neither conduct nor block, and they alone hold the output.
        """
        system = self.system
        if not counted or system.smooth is not None or self._large or not passive(system):
            return counted
        found = isolation_of(system, records.z, records.lam, records.roles)
        free = sum(count for verdict, count in found if not verdict)
        return counted if free > 0 and len(records) < counted else min(free, counted)

    def _place(self, found: Regularity) -> str:
        element = self.mna.row_elements[found.row]
        law = f"the law of {element}" if element else f"the currents at {self._node(found.row)}"
        return f"{self.mna.unknowns[found.unknown]} by {law}"

    def _upright(self, z: Floats) -> tuple[str, ...]:
        """Return the elements whose laws have no finite slope at a point.

        Next to an infinite one (``asin(x)`` at 1) any residual is small, and where a law has no
        limit (``atan2(x, y)`` at the origin) rounding of its arguments makes another value of it:
        what else satisfies the laws there is not known.
        """
        if self.system.smooth is None or not self._kept:
            return ()
        u = self._kept[0][1][:1]
        slopes = function_slopes(self.system.smooth.tape, z[None], u, np.zeros(1))[0]
        functions = np.flatnonzero(~np.all(np.abs(slopes) < _STEEP, axis=1))
        names = [name for k in functions for name in self.mna.function_elements(int(k))]
        return tuple(dict.fromkeys(names)) or ("a law",) * bool(functions.size)

    def _node(self, row: int) -> str:
        return f"node {self.mna.row_nodes[row]}"

    def search(self, stepper: MoreauStepper) -> SolutionVerdict | None:
        """Seek further solutions next to the one operating point of a stepper, if necessary.

        Returns
        -------
        SolutionVerdict or None
            None if no others were found; ``verdict`` then returns what is known.
        """
        verdict = self.verdict()
        system = self.system
        if verdict.kind == "unique" or self._large:
            return None
        z, lam = stepper.state
        upright = self._upright(z)
        if upright:
            reason = "no finite slope at the solution, or no limit of the values around it"
            self._verdict = replace(verdict, kind="not known", reason=reason, elements=upright)
            return None
        if 0 < len(self._undecided) <= MOST:
            points = operating_points(system, self._undecided)
            if points.all and len(points.found) == 1 and _same(points.found[0][0], z, system):
                elements = self._elements(self._undecided)
                self._verdict = replace(verdict, kind="unique", reason=_STATES, elements=elements)
                return None
            others = [point for point, _ in points.found if not _same(point, z, system)]
            told = points.all and len(others) + 1 == len(points.found)
        else:
            others, told = [], False
        others += [
            point
            for point in _search(system, z, lam, self.mna.largest_source)
            if not any(_same(point, other, system) for other in others)
        ]
        others = [point for point in others if not self._upright(point)]
        if not others:
            return None
        more = "and there may be more"
        solutions = tuple(self.mna.values(point) for point in (z, *others))
        self._verdict = replace(
            verdict,
            kind="several",
            reason=f"{len(solutions)} solutions were found, {'all of them' if told else more}",
            solutions=solutions,
        )
        return self._verdict


def isolation_of(
    system: DescriptorSystem,
    z: Floats,
    lam: Floats,
    roles: npt.NDArray[np.uint8] | None,
) -> list[tuple[Verdict, int]]:
    """Return whether other solutions are near some points, once for each mode, with its count."""
    on, off = index_sets(system, z, lam, roles)
    modes: dict[bytes, list[int]] = {}
    for k in range(len(z)):
        modes.setdefault(on[k].tobytes() + off[k].tobytes(), []).append(k)
    return [
        (isolated(system, z[k[0]], lam[k[0]], None if roles is None else roles[k[0]]), len(k))
        for k in modes.values()
    ]


def _search(system: DescriptorSystem, z: Floats, lam: Floats, size: float) -> list[Floats]:
    """Return solutions other than z, from all modes (if few) and from scattered points."""
    n, m = system.n, system.m
    rng = np.random.default_rng(1)  # the same starts in every run
    reach = 2.0 * max(size, float(np.abs(z).max(initial=0.0)))
    current = max(1.0, 10.0 * float(np.abs(lam).max(initial=0.0)))
    starts: list[tuple[Floats, Floats]] = []
    if m <= _MODES:
        for mode in itertools.product((0.0, current), repeat=m):
            starts.append((z, np.array(mode)))
    for _ in range(_STARTS):
        on = np.where(rng.random(m) < 0.5, current, 0.0)
        starts.append((rng.uniform(-reach, reach, n), on))
    stepper = MoreauStepper(system, [])
    stepper.freeze_time(0.0)
    found: list[Floats] = []
    for guess in starts:
        try:
            stepper.start_dc(0.0, guess)
        except UnsolvedStep:
            continue
        point = stepper.state[0]
        if not any(_same(point, other, system) for other in (z, *found)):
            found.append(np.array(point))
    return found


def _same(a: Floats, b: Floats, system: DescriptorSystem) -> bool:
    """Return whether two points are one up to rounding: voltages and currents each on their own.

    Rounding of voltages drives currents through conductances, which are more than the leakage of a
    circuit at rest; that of currents makes voltages in the same way.
    """
    kinds, sizes = system.row_kind, np.maximum(np.abs(a), np.abs(b))
    links = np.abs(system.G.dense())
    for kind in (0, 1):
        mine, others = kinds == kind, kinds == 1 - kind
        size = float(sizes[mine].max(initial=0.0))
        driven = links[np.ix_(others, others)] @ sizes[others]
        slack = _SAME * size + _ROUNDING * system.n * float(driven.max(initial=0.0))
        if np.abs(a[mine] - b[mine]).max(initial=0.0) > slack:
            return False
    return True


def several_warning(verdict: SolutionVerdict) -> Diagnostic:
    """Return the warning that an operating point is one of several."""
    shown, *others = verdict.solutions
    apart = {
        name: max(abs(value - other[name]) for other in others) for name, value in shown.items()
    }
    # a voltage if one differs: that is what .nodeset takes
    voltages = [n for n in apart if n.startswith("v(") and apart[n] > _SAME * abs(shown[n])]
    name = max(voltages or apart, key=lambda n: apart[n], default="")
    unit = "V" if name.startswith("v(") else "A"
    values = ", ".join(f"{s[name]:.6g} {unit}" for s in verdict.solutions) if name else ""
    message = f"the circuit has several operating points, {len(verdict.solutions)} were found"
    if values:
        message += f": {name} = {values}; the first is shown"
    names = f" near another one of {name}" if voltages else ""
    return Diagnostic(
        "NS3005",
        message,
        None,
        f"choose with .nodeset{names}, or start a transient from initial values",
        severity="warning",
    )
