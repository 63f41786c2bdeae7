"""Random values of parameters and elements: ngspice's and LTspice's functions for Monte Carlo."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping

_Draw = Callable[[random.Random, list[float]], float]


def _uniform(rng: random.Random, width: float) -> float:
    return rng.uniform(-width, width)


#: by name and number of arguments; a deviation is a part of the nominal value, or absolute (a...)
DRAWS: dict[tuple[str, int], _Draw] = {
    ("agauss", 3): lambda rng, a: a[0] + a[1] / a[2] * rng.gauss(0.0, 1.0),
    ("gauss", 3): lambda rng, a: a[0] * (1.0 + a[1] / a[2] * rng.gauss(0.0, 1.0)),
    ("aunif", 2): lambda rng, a: a[0] + _uniform(rng, a[1]),
    ("unif", 2): lambda rng, a: a[0] * (1.0 + _uniform(rng, a[1])),
    ("limit", 2): lambda rng, a: a[0] + rng.choice((-1.0, 1.0)) * a[1],
    ("mc", 2): lambda rng, a: a[0] * (1.0 + _uniform(rng, a[1])),
    ("flat", 1): lambda rng, a: _uniform(rng, a[0]),
    ("gauss", 1): lambda rng, a: a[0] * rng.gauss(0.0, 1.0),
}
NAMES = frozenset(name for name, _ in DRAWS)


class Draws:
    """The random numbers of one reading of a deck.

    Parameters
    ----------
    seed : int
    given : mapping of str to float
        Values of parameters from outside: each point of a ``.step`` draws new ones, as in LTspice.
    """

    def __init__(self, seed: int, given: Mapping[str, float]) -> None:
        self._random = random.Random(f"{seed} {sorted(given.items())}")
        self.used = False

    def draw(self, name: str, arguments: list[float]) -> float | None:
        """Return the value of a function, None if it is none of these.

        Examples
        --------
        >>> 900.0 <= Draws(0, {}).draw("unif", [1e3, 0.1]) <= 1100.0
        True
        """
        function = DRAWS.get((name, len(arguments)))
        if function is None:
            return None
        self.used = True
        return function(self._random, arguments)
