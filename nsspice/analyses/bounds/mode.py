"""The state equations of one mode: which pairs conduct, and what the sources do.

States x are the unknowns whose rates occur (voltages of capacitors, currents of inductors).  All
else is linear in ``w = (x, 1, t, integrals)``, which obeys ``w' = A w``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...problems.descriptor import Functional
from ...problems.taylor import Models, Unbounded
from ..gradients.carried import Lost
from .arrays import Arrays, model_of
from .elimination import Solved, solve
from .sources import line_of


class Mode:
    """One mode of an island.

    Parameters
    ----------
    arrays : Arrays
    active : sequence of int
        Pairs that conduct.
    at : float
        An instant at which the sources are on the lines meant [s].

    Attributes
    ----------
    matrix : Models, shape (w, w)
        A of ``w' = A w``.
    conditions : Models, shape (k, w)
        Rows that vanish on the states of this mode; their rates vanish by themselves.

    Raises
    ------
    Lost, Unbounded
        If its equations cannot be solved for all of the box.
    """

    def __init__(self, arrays: Arrays, active: Sequence[int], at: float) -> None:
        self._arrays = arrays
        home = arrays.home
        self.active = list(active)
        stored = ~arrays.E.nothing
        self.states = np.flatnonzero(stored.any(axis=0)).tolist()
        dynamic = np.flatnonzero(stored.any(axis=1)).tolist()
        if len(dynamic) != len(self.states):
            raise Lost("stores whose voltages or currents depend on each other")
        n = arrays.G.shape[0]
        x = len(self.states)
        self.width = x + 2 + len(arrays.outputs)
        self._place = {j: k for k, j in enumerate(self.states)}
        rest = [j for j in range(n) if j not in self._place]
        self._rest = {j: k for k, j in enumerate(rest)}
        algebraic = [i for i in range(n) if i not in dynamic]
        self._sources = Models.constant(home, np.zeros((len(arrays.waveforms), self.width)))
        for k, wave in enumerate(arrays.waveforms):
            value, slope = line_of(wave, at)
            self._sources[k, x] = model_of(home, value)
            self._sources[k, x + 1] = model_of(home, slope)
        act = self.active
        # KCL and branch rows, then w = q - B z + D lam = 0 of conducting pairs
        unknowns = len(rest) + len(act)
        matrix = Models.constant(home, np.zeros((unknowns, unknowns)))
        right = Models.constant(home, np.zeros((unknowns, self.width)))
        top = len(algebraic)
        if top != len(rest):
            raise Lost("rates in equations without a store")
        matrix[:top, :top] = arrays.G[algebraic][:, rest]
        matrix[:top, top:] = arrays.A[algebraic][:, act]
        matrix[top:, :top] = arrays.B[act][:, rest]
        matrix[top:, top:] = -arrays.D[act][:, act]
        driven = arrays.S @ self._sources
        right[:top] = driven[algebraic]
        right[:top, :x] = right[:top, :x] - arrays.G[algebraic][:, self.states]
        right[top:, :x] = -arrays.B[act][:, self.states]
        right[top:, x] = arrays.q[act]
        solved = Solved(matrix, right)
        storage = arrays.E[dynamic][:, self.states]
        by_w = driven[dynamic]
        by_w[:, :x] = by_w[:, :x] - arrays.G[dynamic][:, self.states]
        by_y = Models.constant(home, np.zeros((x, unknowns)))
        by_y[:, :top] = -arrays.G[dynamic][:, rest]
        by_y[:, top:] = -arrays.A[dynamic][:, act]
        known = solved.known
        rate = by_w + by_y[:, known] @ solved.by_right[known]
        self._y = solved.by_right
        self.conditions = solved.conditions
        if solved.free:
            # conditions on the states stay true: their rates determine what is left
            onto = by_y[:, known] @ solved.by_free[known] + by_y[:, solved.free]
            on_states = solve(storage, onto)
            rate = solve(storage, rate)
            rows = solved.conditions[:, :x]
            drift = rows @ rate
            drift[:, x] = drift[:, x] + solved.conditions[:, x + 1]
            left = solve(rows @ on_states, -drift)
            self._y = self._y + solved.by_free @ left
            for k, column in enumerate(solved.free):
                self._y[column] = left[k]
            rate = rate + on_states @ left
            self._fix(rate, rows)
        else:
            rate = solve(storage, rate)
        self.matrix = Models.constant(home, np.zeros((self.width, self.width)))
        self.matrix[:x] = rate
        self.matrix[x + 1, x] = Models.constant(home, 1.0)
        for k, output in enumerate(arrays.outputs):
            self.matrix[x + 2 + k] = self.row(output)

    def _fix(self, rate: Models, rows: Models) -> None:
        """Write down rates that vanish as such: rounding must not spoil a constant."""
        for k in range(rows.shape[0]):
            places = np.flatnonzero(~self.conditions[k].nothing)
            if places.size == 1:
                rate[int(places[0])] = Models.constant(rate.home, np.zeros(self.width))

    @property
    def regular(self) -> bool:
        """Whether the states are independent in this mode."""
        return self.conditions.shape[0] == 0

    def _unknown(self, j: int) -> Models:
        if j in self._place:
            row = Models.constant(self._arrays.home, np.zeros(self.width))
            row[self._place[j]] = Models.constant(self._arrays.home, 1.0)
            return row
        return self._y[self._rest[j]]

    def multiplier(self, pair: int) -> Models:
        """Return the multiplier of a pair as a row on w."""
        if pair not in self.active:
            return Models.constant(self._arrays.home, np.zeros(self.width))
        return self._y[len(self._rest) + self.active.index(pair)]

    def slack(self, pair: int) -> Models:
        """Return the slack of a pair as a row on w."""
        arrays = self._arrays
        row = Models.constant(arrays.home, np.zeros(self.width))
        row[len(self.states)] = arrays.q[pair]
        for j in np.flatnonzero(~arrays.B[pair].nothing).tolist():
            row = row - self._unknown(j) * arrays.B[pair, j][None]
        for other in np.flatnonzero(~arrays.D[pair].nothing).tolist():
            row = row + self.multiplier(other) * arrays.D[pair, other][None]
        return row

    def combination(self, terms: Sequence[tuple[int, float]], minus: float = 0.0) -> Models:
        """Return a combination of unknowns, less a constant, as a row on w."""
        home = self._arrays.home
        row = Models.constant(home, np.zeros(self.width))
        row[len(self.states)] = -model_of(home, minus)
        for j, factor in terms:
            row = row + self._unknown(j) * model_of(home, factor)[None]
        return row

    def row(self, output: Functional) -> Models:
        """Return an output as a row on w.

        Raises
        ------
        Lost
            If it is made of more than unknowns, multipliers, sources and rates of states.
        """
        if output.f or output.df:
            raise Lost("a signal of a smooth function")
        home = self._arrays.home
        row = self.combination(output.z)
        for pair, factor in output.lam:
            row = row + self.multiplier(pair) * model_of(home, factor)[None]
        for k, factor in output.u:
            row = row + self._sources[k] * model_of(home, factor)[None]
        for j, factor in output.dz:
            if j not in self._place:
                raise Lost("a signal depends on the rate of a quantity that is not a state")
            row = row + self.matrix[self._place[j]] * model_of(home, factor)[None]
        return row

    def guards(self) -> list[tuple[tuple[str, int], Models]]:
        """Return what must not be negative in this mode: kind and number, row on w."""
        found: list[tuple[tuple[str, int], Models]] = []
        switched = {s.pair for s in self._arrays.switches}
        for pair in range(self._arrays.q.shape[0]):
            if pair not in switched:
                active = pair in self.active
                row = self.multiplier(pair) if active else self.slack(pair)
                found.append((("pair", pair), row))
        for k, switch in enumerate(self._arrays.switches):
            if switch.latching:
                raise Lost("thyristors have no enclosure")
            above = (switch.pair in self.active) != switch.inverted
            row = self.combination(switch.control, switch.off_below if above else switch.on_above)
            found.append((("switch", k), row if above else -row))
        return found


__all__ = ["Mode", "Unbounded"]
