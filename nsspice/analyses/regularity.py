"""The verdict on DC solutions: the only one, locally the only one, one of several, or not known."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ..circuit import MnaSystem
from ..circuit.regularity import dc_uniqueness, function_elements, largest_sources
from ..errors import Diagnostic
from ..problems.csc import Floats
from ..problems.descriptor import DescriptorSystem
from ..problems.regularity import Regularity, strong_regularity
from ..solvers.moreau import MoreauStepper, Recorded, function_slopes
from ..solvers.stepper import UnsolvedStep

_ROWS = 150  # unknowns and pairs up to which single points are judged
_POINTS = 100  # points judged at most
_STARTS = 24  # random points from which further solutions are sought
_MODES = 5  # pairs up to which every mode is a start
#: slopes beyond this are those of poles; the tape writes 1e150 for an infinite one
_STEEP = 1e100
_SAME = 1e-6  # solutions closer than this, relative to the largest, are one
_ROUNDING = 24.0 * 2.0**-53  # of a law with one equation, relative to the sizes of its terms


@dataclass(frozen=True, slots=True)
class Verdict:
    """What is known about a DC solution.

    Parameters
    ----------
    kind : str
        ``unique`` (proved, whatever the sources do), ``locally unique`` (strongly metrically
        regular: it moves continuously with the sources, others may exist), ``several`` (others
        were found), ``not known``.
    reason : str
    elements : tuple of str
        Elements that stand in the way of a proof.
    modulus : float or None
        Largest change of an unknown per unit of a law's right-hand side, at the worst point.
    place : str
        Which unknown, and which law: ``v(b) by the currents at node b``.
    solutions : tuple of dict
        Unknowns by name of every solution found, the one shown first, if there are several.
    points : int
        Points at which regularity was judged.
    """

    kind: str
    reason: str
    elements: tuple[str, ...] = ()
    modulus: float | None = None
    place: str = ""
    solutions: tuple[dict[str, float], ...] = ()
    points: int = 0

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
    _verdict: Verdict | None = None

    @staticmethod
    def wanted(system: DescriptorSystem) -> bool:
        """Return whether there is something to judge: a linear system speaks for itself."""
        return system.m > 0 or system.smooth is not None

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

    def _worst(self) -> Regularity | None:
        """Return the least regular of the points, None without any."""
        worst, system = None, self.system
        for z, u, lam, roles in self._kept:
            jacobians = np.zeros((len(z), 0, system.n))
            if system.smooth is not None:
                jacobians = function_slopes(system.smooth.tape, z, u, np.zeros(len(z)))
            found = strong_regularity(system, jacobians, z, lam, roles)
            if worst is None or found.badness > worst.badness:
                worst = found
        return worst

    def verdict(self) -> Verdict:
        """Return what is known."""
        if self._verdict is None:
            self._verdict = self._judged()
        return self._verdict

    def later(self) -> Callable[[], Verdict] | Verdict:
        """Return what finds the verdict; of a large system the verdict, not to keep it alive."""
        return self.verdict() if self._large else self.verdict

    @property
    def _large(self) -> bool:
        return self.system.n + self.system.m > _ROWS

    def _judged(self) -> Verdict:
        """Return what is known without a search for further solutions."""
        found, worst = dc_uniqueness(self.mna), self._worst()
        modulus, place = None, ""
        if worst is not None and worst.strong:
            modulus, place = worst.modulus, self._place(worst)
        if found.unique:
            return Verdict("unique", found.reason, (), modulus, place, (), self._points)
        if worst is not None and worst.strong:
            reason = f"strongly regular; uniqueness is not proved, {found.reason}"
            elements = found.elements
            return Verdict("locally unique", reason, elements, modulus, place, (), self._points)
        reason = found.reason
        if worst is not None and worst.strong is False:
            between = tuple(dict.fromkeys(self.mna.pair_elements[k] for k in worst.between))
            reason = "the linearised laws are not regular at the solution"
            return Verdict("not known", reason, between or found.elements, points=self._points)
        return Verdict("not known", reason, found.elements, points=self._points)

    def _place(self, found: Regularity) -> str:
        element = self.mna.row_elements[found.row]
        law = f"the law of {element}" if element else f"the currents at {self._node(found.row)}"
        return f"{self.mna.unknowns[found.unknown]} by {law}"

    def _upright(self, z: Floats) -> tuple[str, ...]:
        """Return the elements whose laws have no finite slope at a point.

        Beside an infinite one (``asin(x)`` at 1) any residual is small, and where a law has no
        limit (``atan2(x, y)`` at the origin) rounding of its arguments makes another value of it:
        what else satisfies the laws there is not known.
        """
        if self.system.smooth is None or not self._kept:
            return ()
        u = self._kept[0][1][:1]
        slopes = function_slopes(self.system.smooth.tape, z[None], u, np.zeros(1))[0]
        functions = np.flatnonzero(~np.all(np.abs(slopes) < _STEEP, axis=1))
        names = [name for k in functions for name in function_elements(self.mna, int(k))]
        return tuple(dict.fromkeys(names)) or ("a law",) * bool(functions.size)

    def _node(self, row: int) -> str:
        return f"node {self.mna.row_nodes[row]}"

    def search(self, stepper: MoreauStepper) -> Verdict | None:
        """Seek further solutions beside the one operating point of a stepper, if need be.

        Returns
        -------
        Verdict or None
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
            self._verdict = Verdict("not known", reason, upright, points=self._points)
            return None
        others = _search(system, z, lam, largest_sources(self.mna))
        others = [point for point in others if not self._upright(point)]
        if not others:
            return None
        names = self.mna.unknowns
        solutions = tuple(
            dict(zip(names, map(float, point), strict=False)) for point in (z, *others)
        )
        self._verdict = Verdict(
            "several",
            f"{len(solutions)} solutions were found, and there may be more",
            verdict.elements,
            verdict.modulus,
            verdict.place,
            solutions,
            verdict.points,
        )
        return self._verdict


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


def several_warning(verdict: Verdict) -> Diagnostic:
    """Return the warning that an operating point is one of several."""
    shown, *others = verdict.solutions
    apart = {
        name: max(abs(shown[name] - other[name]) for other in others)
        for name in shown
        if name.startswith("v(")
    }
    name = max(apart, key=lambda n: apart[n], default="")
    values = ", ".join(f"{s[name]:.6g} V" for s in verdict.solutions) if name else ""
    message = f"the circuit has several operating points, {len(verdict.solutions)} were found"
    if values:
        message += f": {name} = {values}; the first is shown"
    names = f" near another one of {name}" if name else ""
    return Diagnostic(
        "NS3005",
        message,
        None,
        f"choose with .nodeset{names}, or start a transient from initial values",
        severity="warning",
    )
