"""Measures of a deck as functions of its parameters, with derivatives, for optimisers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...circuit import Circuit
from ...errors import Diagnostic, UsageError
from ..gradients.variation import Parameter
from ..request.load import need_circuit, read_again
from ..request.request import Neighbour
from ..signals.curve import Floats
from .gradient import Gradient, evaluated


class Objective:
    """What an optimiser minimises: a measure, or the distance of several from their goals.

    Attributes
    ----------
    measures : list of str
    single : bool
        Whether it is one measure, without a goal.
    start : ndarray
        Values of the parameters in the deck.
    runs : int
        Points that were run, each with all derivatives.
    """

    def __init__(
        self, circuit: Circuit, measures: str | Mapping[str, float], parameters: Sequence[str]
    ) -> None:
        need_circuit(circuit)
        self._circuit = circuit
        self.single = isinstance(measures, str)
        self._goals = (
            None if isinstance(measures, str) else {k.lower(): v for k, v in measures.items()}
        )
        self.measures = [measures.lower()] if isinstance(measures, str) else list(self._goals or {})
        by = [Parameter.of(circuit, name) for name in parameters]
        if not by or not self.measures:
            message = "an objective needs measures and parameters"
            raise UsageError(Diagnostic("NS4005", message, hint="name at least one of each"))
        self._by = [(p.target.name, p.target.kind) for p in by]
        for name, kind in self._by:
            if kind not in ("param", "element"):
                message = f"{name} cannot be changed by an optimiser"
                hint = "write its value as a .param, and name that"
                raise UsageError(Diagnostic("NS4005", message, hint=hint))
        self.start: Floats = np.array([p.value for p in by])
        self.runs = 0
        self._last: tuple[bytes, Gradient] | None = None
        self._neighbour = Neighbour()

    def at(self, x: npt.ArrayLike) -> Gradient:
        """Return all measures and derivatives at values of the parameters; the last are kept."""
        point = np.asarray(x, dtype=np.float64)
        if self._last is None or self._last[0] != point.tobytes():
            given = dict(zip(self._by, point.tolist(), strict=True))
            params = {name: v for (name, kind), v in given.items() if kind == "param"}
            values = {name: v for (name, kind), v in given.items() if kind == "element"}
            circuit = read_again(self._circuit.deck, params) if params else self._circuit
            names = [name for name, _ in self._by]
            self.runs += 1
            found = evaluated(circuit, self.measures, names, values, self._neighbour)
            self._last = point.tobytes(), found
        return self._last[1]

    def values(self, x: npt.ArrayLike) -> Floats:
        """Return the measures, or their relative distances from the goals."""
        found = np.array(list(self.at(x).measures.values()))
        if self._goals is None:
            return found
        goals, sizes = self._scales()
        return np.asarray((found - goals) / sizes)

    def jacobian(self, x: npt.ArrayLike) -> Floats:
        """Return the derivatives of :meth:`values`, shape (measures, parameters)."""
        found = self.at(x).matrix()
        return found if self._goals is None else np.asarray(found / self._scales()[1][:, None])

    def _scales(self) -> tuple[Floats, Floats]:
        goals = np.array(list((self._goals or {}).values()))
        return goals, np.where(goals == 0.0, 1.0, np.abs(goals))

    def __call__(self, x: npt.ArrayLike) -> tuple[float, Floats]:
        """Return value and gradient, as ``scipy.optimize.minimize(..., jac=True)`` takes them."""
        values, jacobian = self.values(x), self.jacobian(x)
        if self._goals is None:
            return float(values[0]), np.asarray(jacobian[0])
        return 0.5 * float(values @ values), np.asarray(values @ jacobian)

    def to_jax(self) -> Callable[[Any], Any]:
        """Return :meth:`values` as a function of a JAX array, of a single measure its value.

        ``jax.grad``, ``jit`` and ``vmap`` apply to it and to what is made of it; runs happen on the
        host.  Without ``jax_enable_x64`` JAX rounds to seven digits.
        """
        from .autodiff import for_jax

        return for_jax(self)

    def to_torch(self) -> Callable[[Any], Any]:
        """Return :meth:`values` as a function of a PyTorch tensor, of a single measure its value.

        Its result can be differentiated by ``backward()``, on its own or within a model.
        """
        from .autodiff import for_torch

        return for_torch(self)


def objective(
    circuit: Circuit, measures: str | Mapping[str, float], parameters: Sequence[str]
) -> Objective:
    """Return a function of parameters with its gradient, for optimisers.

    Parameters
    ----------
    circuit : Circuit
        With ``.tran`` or ``.pss`` and ``.measure`` cards.
    measures : str, or mapping of str to float
        A measure, or goals of several: then half the sum of the squares of the relative distances.
    parameters : sequence of str
        ``.param`` names and elements.

    Returns
    -------
    Objective
        Called with values of the parameters it returns value and gradient; ``values`` and
        ``jacobian`` are for ``scipy.optimize.least_squares``.

    Raises
    ------
    UsageError
        NS4005 for what the deck does not have.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''RC
    ... V1 a 0 1
    ... R1 a b 1k
    ... C1 b 0 1u IC=0
    ... .tran 10u 1m uic
    ... .measure tran end find v(b) at=1m
    ... ''')
    >>> value, gradient = objective(circuit, "end", ["r1"])([2e3])
    >>> abs(value - 0.3934693402873666) < 1e-12, gradient.shape
    (True, (1,))
    """
    return Objective(circuit, measures, parameters)
