"""Exact integrals along runs of the mode-wise engine: Fourier coefficients, averages, powers.

Between two switchings every signal is a sum of exponentials, so that its Fourier coefficients are
closed forms; no row, window or transform is involved.  Averages of products are quadratures of
Gauss that are exact to rounding for such sums.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from ...circuit import Circuit, MnaSystem
from ...problems.descriptor import DescriptorSystem
from ...solvers.orbit import PeriodMap, State
from ..signals.signal_names import canonical

if TYPE_CHECKING:
    from .heat import Heating

Complexes = npt.NDArray[np.complex128]


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
class Integrals:
    """Integrals of the signals of a circuit over a window.

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

    @property
    def frequency(self) -> float:
        """One over the length of the window [Hz]."""
        return 1.0 / (self.window[1] - self.window[0])

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
        """Return an island's run with some outputs."""
        found = self._maps.get((home, names))
        if found is None:
            course = self.course(home)
            outputs = [course.mna.functional(name) for name in names]
            found = PeriodMap(course.system, course.stop, outputs)
            found.run(course.state)
            self._maps[home, names] = found
        return found

    def coefficients(self, names: Sequence[str], orders: Sequence[int]) -> dict[str, Complexes]:
        """Return Fourier coefficients ``1/T int e^(-i n w (t - t0)) y dt`` of signals.

        Parameters
        ----------
        names : sequence of str
            Voltages and currents.
        orders : sequence of int
            Multiples of the window's own frequency.
        """
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

    def mean(self, name: str) -> float:
        """Return the average of a signal; of a power ``p(r1)`` that of the product."""
        key = canonical(name)
        if key.startswith("p("):
            return self.powers([key[2:-1]])[0]
        return float(self.coefficients([key], [0])[key][0].real)

    def rms(self, name: str) -> float:
        """Return the root of the mean square of a voltage or current."""
        return math.sqrt(max(self.product(name, name), 0.0))

    def product(self, one: str, two: str) -> float:
        """Return the average of the product of two signals.

        Raises
        ------
        ValueError
            If they belong to different parts of the circuit.
        """
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

    def distortion(self, name: str, order: int = 1) -> float:
        """Return the total harmonic distortion and the harmonic of an order, all others counted.

        It is the root of the power of all harmonics but this one and the mean, over that of this
        one.
        """
        key = canonical(name)
        mean, first = self.coefficients([key], [0, order])[key]
        own = 2.0 * abs(first) ** 2
        rest = self.product(key, key) - abs(mean) ** 2 - own
        return math.sqrt(max(rest, 0.0) / own) if own > 0.0 else math.nan
