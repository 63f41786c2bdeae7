"""Small perturbations of a periodic orbit that was found by steps with error control.

Where a guard ends a mode, the last step ends with :math:`\\delta q + r\\, \\delta t` and the next
one begins so much later, with all of its stages, and ends when it did: no rates after the event are
needed.  Where charges jump, the perturbation is projected as they are.

A stimulus :math:`e^{st}` answers a quasi-periodic perturbation,
:math:`(e^{sT} - \\Phi)\\, \\delta q(0) = F(s)`; outputs are weighted with :math:`e^{-st}` by the
quadrature of the steps, moved instants included.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt

from ..problems.csc import Floats
from ..problems.descriptor import Functional
from .orbit import Complexes
from .step_maps import Maps, Stimuli, step_maps
from .tangent import Guard, Tangent

#: steps whose matrices are made together
_CHUNK = 128
#: numbers kept from one set of frequencies to the next
_KEPT = 1 << 24
#: condition from which on a perturbation counts as unbounded: steps know the period to 1e-8 at best
_UNBOUNDED = 1e9


class Outputs:
    """Functionals as matrices.

    Parameters
    ----------
    tangent : Tangent
    functionals : sequence of Functional
    count : int
        Stimuli, which are numbered as sources behind those of the system.
    """

    def __init__(self, tangent: Tangent, functionals: Sequence[Functional], count: int) -> None:
        self.tangent, o = tangent, len(functionals)
        self.count = o
        system, functions = tangent.system, tangent.F.shape[1]
        self.z, self.lam = np.zeros((o, system.n)), np.zeros((o, system.m))
        self.dz, self.f, self.df = (np.zeros((o, k)) for k in (system.n, functions, functions))
        self.u = np.zeros((o, len(system.waveforms) + count))
        for j, functional in enumerate(functionals):
            for key in ("z", "lam", "dz", "u", "f", "df"):
                for index, factor in getattr(functional, key):
                    getattr(self, key)[j, index] += factor
        #: whether rates are among them: those of a period are s times the quantities
        self.rated = bool(self.dz.any() or self.df.any())

    def values(self, k: int, place: int) -> tuple[Floats, Floats]:
        """Return outputs without rates, and of what rates are taken, on the orbit, shape (o,)."""
        r, f = self.tangent.record, self.tangent.functions(k, place)
        z, u = r.z[k, place], r.u[k, place]
        plain = self.z @ z + self.lam @ r.lam[k, place] + self.u[:, : u.size] @ u + self.f @ f
        return plain, self.dz @ z + self.df @ f


class Perturbed:
    """An orbit with stimuli and outputs.

    Parameters
    ----------
    tangent : Tangent
    stimuli : Stimuli
    outputs : sequence of Functional
    """

    def __init__(
        self, tangent: Tangent, stimuli: Stimuli, outputs: Sequence[Functional] = ()
    ) -> None:
        self.tangent, self.stimuli = tangent, stimuli
        self.outputs = Outputs(tangent, outputs, stimuli.count)
        self.r = tangent.stored.size
        # the first point of a step that continues another one is the last point of that
        self.weight = tangent.record.weight.copy()
        later = np.flatnonzero(tangent.continues)
        self.weight[later - 1, -1] += self.weight[later, 0]
        self.weight[later, 0] = 0.0
        jumping = np.flatnonzero(tangent.jumps)
        self._jumps = dict(zip(jumping.tolist(), self._projections(jumping), strict=True))
        self._known: dict[int, tuple[Maps, Floats, list[Floats]]] = {}
        self._guards: dict[int, Guard | None] = {}

    def responses(self, s: Complexes, multiples: Floats | None = None) -> Complexes:
        """Return Fourier components of the outputs, shape (w, b, outputs, stimuli).

        Parameters
        ----------
        s : ndarray of complex, shape (w,)
            Complex frequencies [1/s]; where the perturbation is not bounded the result is infinite.
        multiples : ndarray, shape (b,), optional
            Sidebands: multiples of the frequency of the orbit; (0,) by default.
        """
        course = _Course(self, s, np.zeros(1) if multiples is None else multiples)
        forced = course.paired(course.end[:, self.r :])
        found, size = np.zeros_like(course.of_stimuli), self.tangent.size[self.tangent.stored]
        size = np.where(size > 0.0, size, 1.0)[:, np.newaxis]
        # in parts of what is stored at most
        phi = course.end[:, : self.r] * size[:, 0] / size
        for j, at in enumerate(s):
            matrix = np.exp(at * self.tangent.period) * np.eye(self.r) - phi
            if self.r and not np.linalg.cond(matrix) < _UNBOUNDED:
                found[j] = np.inf
                continue
            start = size * np.linalg.solve(matrix, forced[..., j] / size)
            found[j] = course.of_stimuli[j] + course.of_start[j] @ start
        return np.asarray(found / self.tangent.period, dtype=np.complex128)

    def means(self) -> Floats:
        """Return the averages of the outputs over the orbit, shape (outputs,)."""
        total = np.zeros(self.outputs.count)
        for k, i in np.argwhere(self.weight != 0.0):
            total += self.weight[k, i] * self.outputs.values(k, i)[0]
        return total / self.tangent.period

    def guard(self, k: int) -> Guard | None:
        """See :meth:`~nsspice.solvers.tangent.Tangent.guard`."""
        if k not in self._guards:
            self._guards[k] = self.tangent.guard(k)
        return self._guards[k]

    def jump(self, k: int) -> Floats | None:
        """Return what a jump before a step makes of perturbations, shape (r, r)."""
        return self._jumps.get(k)

    def chunks(self) -> Iterator[tuple[npt.NDArray[np.intp], Maps, Floats, list[Floats]]]:
        """Iterate over steps, their matrices, and those of outputs (and of what is rated)."""
        total = self.tangent.record.begin.size
        for first in range(0, total, _CHUNK):
            steps = np.arange(first, min(first + _CHUNK, total))
            if first not in self._known:
                maps = step_maps(self.tangent, self.stimuli, steps)
                found = maps, maps.unknowns[:, -1], self._forms(maps)
                if total * (maps.unknowns[0].size + maps.functions[0].size) > _KEPT:
                    yield steps, *found
                    continue
                self._known[first] = found
            yield steps, *self._known[first]

    def _projections(self, steps: npt.NDArray[np.intp]) -> Floats:
        """Return what jumps before some steps make of perturbations, shape (k, r, r)."""
        stored, n = self.tangent.stored, self.tangent.system.n
        if not steps.size:
            return np.zeros((0, stored.size, stored.size))
        slopes, a, inverse = self.tangent.at_begin(steps)
        whole = slopes.C @ inverse[:, :n, :n] / a[:, np.newaxis, np.newaxis]
        found: Floats = whole[:, stored[:, np.newaxis], stored]
        return found

    def _forms(self, maps: Maps) -> list[Floats]:
        """Return the outputs as matrices, shape (k, s o, c), and those of which rates are taken."""
        outputs, n, r, p = self.outputs, self.tangent.system.n, self.r, self.stimuli.count
        if not outputs.count:
            return []
        x, f = maps.unknowns, maps.functions
        plain = outputs.z @ x[:, :, :n] + outputs.lam @ x[:, :, n:] + outputs.f @ f
        for i in range(x.shape[1]):
            first = 2 * r + 1 + i * p
            plain[:, i, :, first : first + p] += outputs.u[:, outputs.u.shape[1] - p :]
        found = [plain]
        if outputs.rated:
            found.append(outputs.dz @ x[:, :, :n] + outputs.df @ f)
        return [form.reshape(x.shape[0], -1, x.shape[3]) for form in found]


def monodromy(tangent: Tangent) -> Floats:
    """Return what a period makes of perturbations of what is stored at its begin, shape (r, r).

    Rows and columns are those of ``tangent.stored``.

    Raises
    ------
    NoDerivative
        If several guards reach zero at one instant that move differently.
    """
    none = Stimuli(np.zeros((tangent.system.n, 0)), {})
    course = _Course(Perturbed(tangent, none), np.zeros(0, complex), np.zeros(0))
    return course.end


class _Course:
    """What perturbations of the start, and stimuli, become over one period.

    Parameters
    ----------
    of : Perturbed
    s, multiples : ndarray, shapes (w,), (b,)
        See :meth:`Perturbed.responses`.
    """

    def __init__(self, of: Perturbed, s: Complexes, multiples: Floats) -> None:
        self.of, self.s, self.r = of, s, of.r
        #: exponents with which outputs are weighted, shape (w, b)
        self.at = s[:, np.newaxis] + 2j * np.pi * multiples / of.tangent.period
        shape = *self.at.shape, of.outputs.count
        self.of_start = np.zeros((*shape, self.r), complex)
        self.of_stimuli = np.zeros((*shape, of.stimuli.count), complex)
        self.columns = self.r + 2 * s.size * of.stimuli.count
        self.end = self._run()

    def paired(self, columns: Floats) -> Complexes:
        """Return columns of stimuli as complex numbers, shape (..., p, w)."""
        count = self.of.stimuli.count
        parts = columns.reshape(*columns.shape[:-1], count, 2, self.s.size)
        found: Complexes = parts[..., 0, :] + 1j * parts[..., 1, :]
        return found

    def _run(self) -> Floats:
        of, r, tangent = self.of, self.r, self.of.tangent
        state = np.zeros((2 * r, self.columns))
        state[:r, :r] = np.eye(r)
        shift: Floats | None = None
        own = 2 * r + 1
        for steps, maps, ends, forms in of.chunks():
            after, values = maps.after, self._values(steps)
            driven = after[:, :, own:] @ values
            states = np.zeros((steps.size, own, self.columns))
            for j, k in enumerate(steps.tolist()):
                jump = of.jump(k)
                if jump is not None:
                    held = self._held(k)
                    state[:r] = jump @ (state[:r] + held) - held
                states[j, :-1] = state
                if shift is not None:
                    states[j, -1] = shift
                state = after[j, :, :own] @ states[j]
                state[:, r:] += driven[j]
                shift = None
                if k + 1 < tangent.turns.size and tangent.turns[k + 1]:
                    guard = of.guard(k)
                    if guard is not None:
                        x = ends[j, :, :own] @ states[j]
                        x[:, r:] += ends[j, :, own:] @ values[j]
                        shift = guard.instant @ x
                        state[:r] += np.outer(tangent.r[k, -1, tangent.stored], shift)
                        self._move(k, -1, 1.0, 0.0, shift)
            self._integrate(steps, forms, states, values)
        return state[:r]

    def _held(self, k: int) -> Floats:
        """Return the sources of charge at the begin of a step, shape (r, columns)."""
        record, stimuli = self.of.tangent.record, self.of.stimuli
        held = np.zeros((self.r, self.columns))
        for j, (driver, stored) in enumerate(stimuli.drivers or ()):
            if stored and driver is not None:
                value = sum(factor * record.first[k, index] for index, factor in driver.z)
                # of the pair of columns of a stimulus the first one is the real part
                held[:, self.r + 2 * j] = stimuli.rows[self.of.tangent.stored, j] * value
        return held

    def _values(self, steps: npt.NDArray[np.intp]) -> Floats:
        """Return the stimuli at the places, shape (k, s p, columns)."""
        record, stimuli = self.of.tangent.record, self.of.stimuli
        t, p, w = record.time[steps], stimuli.count, self.s.size
        own = np.zeros((*t.shape, p, 2, w))
        if stimuli.drivers is None:
            waves = np.exp(self.s * t[..., np.newaxis])[:, :, np.newaxis]
            own[..., 0, :], own[..., 1, :] = waves.real, waves.imag
        else:
            z, lam, u = record.z[steps], record.lam[steps], record.u[steps]
            for j, (driver, _) in enumerate(stimuli.drivers):
                if driver is None:
                    own[:, :, j, 0] = 1.0
                    continue
                for values, terms in ((z, driver.z), (lam, driver.lam), (u, driver.u)):
                    for index, factor in terms:
                        own[:, :, j, 0] += factor * values[:, :, index, np.newaxis]
        spread = np.zeros((*t.shape, p, p, 2, w))
        for j in range(p):
            spread[:, :, j, j] = own[:, :, j]
        result: Floats = spread.reshape(steps.size, t.shape[1] * p, 2 * w * p)
        return result

    def _integrate(
        self,
        steps: npt.NDArray[np.intp],
        forms: Sequence[Floats],
        states: Floats,
        values: Floats,
    ) -> None:
        """Add the integrals of the outputs over some steps."""
        if not self.of.outputs.count:
            return
        record, r = self.of.tangent.record, self.r
        t, own = record.time[steps], 2 * r + 1
        waves = np.exp(-self.at * t[:, :, np.newaxis, np.newaxis])
        weight = self.of.weight[steps][:, :, np.newaxis, np.newaxis] * waves
        factors: list[float | Complexes] = [1.0, self.at]
        for form, factor in zip(forms, factors, strict=False):
            y = form[:, :, :own] @ states
            y[:, :, r:] += form[:, :, own:] @ values
            each = (weight * factor).reshape(t.size, *self.at.shape)
            y = y.reshape(t.size, -1, self.columns)
            self.of_start += np.einsum("jwb,jor->wbor", each, y[..., :r])
            driven = self.paired(y[..., r:])
            self.of_stimuli += np.einsum("jwb,jopw->wbop", each, driven)
        for j in np.flatnonzero(states[:, -1].any(axis=1)):
            k, shift = int(steps[j]), states[j, -1]
            length = self.of.tangent.length[k]
            # of the step itself: what the next one has left to its end does not move
            for i in np.flatnonzero(record.weight[k]):
                part = 1.0 - self.of.tangent.parts[k, i]
                own_weight = -float(record.weight[k, i])
                self._move(k, int(i), own_weight / length, own_weight * part, shift)

    def _move(self, k: int, place: int, plain: float, by_rate: float, shift: Floats) -> None:
        """Add what a shift of a place of a step brings: the outputs there, weighted."""
        if not self.of.outputs.count:
            return
        wave = np.exp(-self.at * self.of.tangent.record.time[k, place])
        weight = wave * (plain + by_rate * self.at)
        for nominal, factor in zip(self.of.outputs.values(k, place), (1.0, self.at), strict=True):
            if nominal.any():
                y, own = np.outer(nominal, shift), (weight * factor)[:, :, np.newaxis, np.newaxis]
                self.of_start += own * y[:, : self.r]
                moved = np.moveaxis(self.paired(y[:, self.r :]), 2, 0)
                self.of_stimuli += own * moved[:, np.newaxis]
