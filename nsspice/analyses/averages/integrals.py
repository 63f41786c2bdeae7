"""Exact integrals along runs of the mode-wise engine: Fourier coefficients, averages, powers.

Between two switchings every signal is a sum of exponentials, so that its Fourier coefficients are
closed forms; no row, window or transform is involved.  Averages of products are quadratures of
Gauss that are exact to rounding for such sums.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...errors import NumericalError
from ...problems.descriptor import DescriptorSystem
from ...solvers.modewise import NotModewise
from ...solvers.orbit import NoDerivative, NoOrbit, PeriodMap, State
from ...solvers.stepper import UnsolvedStep
from ..signals.signal_names import canonical
from .window_integrals import Complexes, NoClosedForm, WindowIntegrals

if TYPE_CHECKING:
    from .heat import Heating


@dataclass(frozen=True, slots=True)
class Course:
    """One island's run: from a state at time 0 to an end, in which a window counts.

    Parameters
    ----------
    mna : MnaSystem
    system : DescriptorSystem
    state : State
    stop : float or None
        End [s]; None if a trigger ends it.
    """

    mna: MnaSystem
    system: DescriptorSystem
    state: State
    stop: float | None


@dataclass(slots=True)
class Integrals(WindowIntegrals):
    """Integrals of the signals of a circuit over a window, from closed forms.

    Parameters
    ----------
    circuit : Circuit
    course_of : callable
        Returns the course of an island by number; called when it is first needed.
    window : (float, float)
        [s]; of a periodic steady state one period.
    periodic : bool
        The window's end leads back to its beginning.
    temperature : float
        Of the surroundings [C].
    heat : dict or None
        What heats the elements, once it has been computed.
    driven : frozenset of int
        Numbers of the blocks that others drive, which have no closed forms.
    """

    circuit: Circuit
    course_of: Callable[[int], Course]
    window: tuple[float, float]
    periodic: bool = False
    temperature: float = 27.0
    heat: dict[str, Heating] | None = None
    driven: frozenset[int] = frozenset()
    _courses: dict[int, Course] = field(default_factory=dict)
    _maps: dict[tuple[int, tuple[str, ...]], PeriodMap] = field(default_factory=dict)

    def over(self, window: tuple[float, float]) -> Integrals:
        """Return the integrals over another window [s] of the same run."""
        return Integrals(
            self.circuit,
            self.course_of,
            window,
            False,
            self.temperature,
            None,
            self.driven,
            self._courses,
            self._maps,
        )

    def course(self, home: int) -> Course:
        """Return the course of an island."""
        if home not in self._courses:
            self._courses[home] = self.course_of(home)
        return self._courses[home]

    def map_of(self, home: int, names: tuple[str, ...]) -> PeriodMap:
        """Return an island's run with some outputs.

        Raises
        ------
        NoClosedForm
            If the exact engine does not run it from begin to end.
        """
        found = self._maps.get((home, names))
        if found is None:
            try:
                course = self.course(home)
                outputs = [course.mna.functional(name) for name in names]
                found = PeriodMap(course.system, course.stop, outputs)
                found.run(course.state)
            except NoDerivative as problem:
                raise NoClosedForm("the run needed implicit steps") from problem
            except (NotModewise, NoOrbit, UnsolvedStep, NumericalError) as problem:
                raise NoClosedForm(str(problem)) from problem
            self._maps[home, names] = found
        return found

    def coefficients(self, names: Sequence[str], orders: Sequence[int]) -> dict[str, Complexes]:
        """Return Fourier coefficients of signals."""
        keys = [canonical(name) for name in names]
        parts = {key: self.circuit.parts(key) for key in keys}
        found = {key: np.zeros(len(orders), complex) for key in keys}
        wanted = np.array(orders, dtype=np.float64)
        for home in range(len(self.circuit.islands)):
            local = tuple(dict.fromkeys(n for t in parts.values() for h, n, _ in t if h == home))
            if not local:
                continue
            flat = self.map_of(home, local).core.coefficients(wanted, *self.window)
            table = (flat[::2] + 1j * flat[1::2]).reshape(len(local), wanted.size)
            for key, terms in parts.items():
                for h, part, factor in terms:
                    if h == home:
                        found[key] += factor * table[local.index(part)]
        return found

    def product(self, one: str, two: str) -> float:
        """Return the average of the product of two signals."""
        terms = [self.circuit.parts(canonical(name)) for name in (one, two)]
        homes = {home for part in terms for home, _, _ in part}
        if not homes:
            return 0.0
        if len(homes) > 1:
            raise ValueError(f"{one} and {two} belong to different parts of the circuit")
        (home,) = homes
        names = tuple(dict.fromkeys(n for part in terms for _, n, _ in part))
        pairs = [(names.index(a), names.index(b)) for _, a, _ in terms[0] for _, b, _ in terms[1]]
        factors = [f * g for _, _, f in terms[0] for _, _, g in terms[1]]
        values = self.map_of(home, names).core.products(pairs, *self.window)
        return float(np.dot(factors, values))

    def powers(self, elements: Sequence[str]) -> list[float]:
        """Return the average powers [W] that elements take."""
        total = []
        homes: dict[int, list[int]] = {}
        for k, name in enumerate(elements):
            homes.setdefault(self.circuit.element_island[name], []).append(k)
            total.append(0.0)
        for home, members in homes.items():
            products = [
                (k, f"v({a},{b})" if b != "0" else f"v({a})", f"i({current})")
                for k in members
                for current, a, b in self.circuit.device(elements[k]).powers
            ]
            names = tuple(dict.fromkeys(n for _, v, i in products for n in (v, i)))
            pairs = [(names.index(v), names.index(i)) for _, v, i in products]
            if not pairs:
                continue
            values = self.map_of(home, names).core.products(pairs, *self.window)
            for (k, _, _), value in zip(products, values, strict=True):
                total[k] += float(value)
        return total
