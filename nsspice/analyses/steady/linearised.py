"""The equations about an operating point, and their solution at complex frequencies.

With the active pairs of the operating point held active, and smooth laws replaced by their slopes,

.. math::

    (G + F f_z + s (E + Q f_z))\\, z + A_a \\lambda_a = (S - F f_u - s Q f_u)\\, u, \\qquad
    -B_a z + D_a \\lambda_a = 0, \\qquad s = 2 \\pi i f .
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from ...circuit import Circuit, Island, MnaSystem
from ...devices.passive.resistor import Resistor
from ...devices.sources.delayed import Delayed
from ...errors import Diagnostic, NumericalError, Span, StepError, UsageError
from ...problems.csc import Csc
from ...problems.descriptor import DescriptorSystem, Functional
from ...solvers.moreau import MoreauStepper, function_slopes, function_values, source_slopes_of
from ...solvers.stepper import UnsolvedStep
from ..certificate.failure import named_failure
from ..request.request import Request
from ..signals.curve import Floats
from ..static.dc_start import start_dc, without_storage
from ..static.initial import guess_of, with_integrators
from .stimuli import Stimulated, stimulated

Complexes = npt.NDArray[np.complex128]

#: unknowns up to which the equations of all frequencies are solved at once as dense matrices
_DENSE = 150
#: frequencies solved at once
_BATCH = 64
#: of the larger of current and voltage: below, a pair is at the corner of its characteristic
_CORNER = 1e-12


@dataclass(frozen=True, slots=True)
class Point:
    """The operating point of one island, and the equations about it.

    Parameters
    ----------
    mna : MnaSystem
    stimulated : Stimulated
    z : ndarray, shape (n,)
    active : ndarray of int
        Pairs that conduct.
    slopes, source_slopes : ndarray, shapes (p, n), (p, s)
        Derivatives of the smooth functions by unknowns and sources.
    corners : tuple of str
        Elements that are at a corner of their characteristic.
    functions : ndarray, shape (p,)
        The smooth functions.
    """

    mna: MnaSystem
    stimulated: Stimulated
    z: Floats
    active: npt.NDArray[np.intp]
    slopes: Floats
    source_slopes: Floats
    corners: tuple[str, ...]
    functions: Floats

    @property
    def system(self) -> DescriptorSystem:
        """The system with its stimuli."""
        return self.stimulated.system

    def matrices(self) -> tuple[Csc, Csc]:
        """Return the matrices of values and of rates over ``[z; active multipliers]``."""
        system, k = self.system, len(self.active)
        n, size = system.n, system.n + len(self.active)
        place = np.full(system.m, -1, dtype=np.int64)
        place[self.active] = n + np.arange(k)
        value, rate = [_part(system.G)], [_part(system.E)]
        if system.smooth is not None:
            value.append(_product(system.smooth.F, self.slopes))
            rate.append(_product(system.smooth.Q, self.slopes))
        for matrix, of_rows, of_cols, sign in (
            (system.A, None, place, 1.0),
            (system.B, place, None, -1.0),
            (system.D, place, place, 1.0),
        ):
            rows = matrix.indices if of_rows is None else of_rows[matrix.indices]
            cols = matrix.columns if of_cols is None else of_cols[matrix.columns]
            kept = (rows >= 0) & (cols >= 0)
            value.append((rows[kept], cols[kept], sign * matrix.data[kept]))
        return _joined(size, value), _joined(size, rate)

    def delays(self) -> list[tuple[Csc, float]]:
        """Return the parts of the matrix of values that are late, and by how much [s]."""
        found = []
        size = self.system.n + len(self.active)
        for device in self.mna.devices:
            if isinstance(device, Delayed):
                row, terms = device.delayed_part(self.mna.layout)
                columns, factors = zip(*terms, strict=True) if terms else ((), ())
                rows = np.full(len(terms), row, dtype=np.int64)
                part = Csc.from_triplets((size, size), rows, np.array(columns, dtype=np.int64),
                                         np.array(factors, dtype=np.float64))  # fmt: skip
                found.append((part, device.delay))
        return found

    def row(self, signal: Functional) -> tuple[Floats, Floats]:
        """Return what a signal reads of ``[z; active multipliers]``, of values and of rates."""
        n, size = self.system.n, self.system.n + len(self.active)
        value, rate = np.zeros(size), np.zeros(size)
        place = {int(pair): n + k for k, pair in enumerate(self.active)}
        for out, of_unknowns, of_functions in (
            (value, signal.z, signal.f),
            (rate, signal.dz, signal.df),
        ):
            for j, factor in of_unknowns:
                out[j] += factor
            for f, factor in of_functions:
                out[:n] += factor * self.slopes[f]
        for pair, factor in signal.lam:
            if pair in place:
                value[place[pair]] += factor
        return value, rate

    def drive(self, weights: Mapping[str, complex]) -> tuple[Complexes, Complexes]:
        """Return the right side, and what multiplies s in it, of stimuli, shape (n + k,) each."""
        system = self.system
        u = self.sources(weights)
        size = system.n + len(self.active)
        value, rate = np.zeros(size, complex), np.zeros(size, complex)
        value[: system.n] = _times(system.S, u)
        if system.smooth is not None:
            f = self.source_slopes @ u
            value[: system.n] -= _times(system.smooth.F, f)
            rate[: system.n] -= _times(system.smooth.Q, f)
        return value, rate

    def sources(self, weights: Mapping[str, complex]) -> Complexes:
        """Return the stimuli of all sources, shape (s,)."""
        u = np.zeros(len(self.system.waveforms), complex)
        for name, column in self.stimulated.columns.items():
            u[column] = weights[name]
        return u

    def outputs(
        self, functionals: Sequence[Functional], s: Complexes, x: Complexes, u: Complexes
    ) -> Complexes:
        """Return signals, shape (k, outputs), of solutions x (k, n + active) at s (k,)."""
        n = self.system.n
        lam = np.zeros((s.size, self.system.m), complex)
        lam[:, self.active] = x[:, n:]
        f = x[:, :n] @ self.slopes.T + self.source_slopes @ u
        out = np.zeros((s.size, len(functionals)), complex)
        for j, functional in enumerate(functionals):
            for values, terms in ((x, functional.z), (lam, functional.lam), (f, functional.f)):
                for index, factor in terms:
                    out[:, j] += factor * values[:, index]
            for values, terms in ((x, functional.dz), (f, functional.df)):
                for index, factor in terms:
                    out[:, j] += factor * s * values[:, index]
            for index, factor in functional.u:
                out[:, j] += factor * u[index]
        return out


def _part(m: Csc) -> tuple[Any, Any, Any]:
    return m.indices, m.columns, m.data


def _product(m: Csc, slopes: Floats) -> tuple[Any, Any, Any]:
    """Return the entries of a sparse matrix times slopes."""
    rows, cols = (
        np.repeat(m.indices, slopes.shape[1]),
        np.tile(np.arange(slopes.shape[1]), m.data.size),
    )
    data = (m.data[:, None] * slopes[m.columns]).ravel()
    kept = data != 0.0
    return rows[kept], cols[kept], data[kept]


def _joined(size: int, parts: Sequence[tuple[Any, Any, Any]]) -> Csc:
    rows, cols, data = (np.concatenate([p[k] for p in parts]) for k in range(3))
    return Csc.from_triplets((size, size), rows.astype(np.int64), cols.astype(np.int64), data)


def _times(m: Csc, x: Complexes) -> Complexes:
    return m.dot(np.ascontiguousarray(x.real)) + 1j * m.dot(np.ascontiguousarray(x.imag))


def operating_point(
    circuit: Circuit,
    island: Island,
    stimuli: Mapping[str, complex],
    request: Request,
    alternating: bool = True,
) -> Point:
    """Return the DC solution of an island, and the equations about it.

    Unless what is asked for is not ``alternating``, resistors have their resistance ``ac=`` there.

    Raises
    ------
    NumericalError
        If there is none.
    """
    mna = island.assemble(request.temperature, request.values, analysis="dc")
    system = mna.system
    held = with_integrators(circuit, mna, system)
    stepper = MoreauStepper(held, ())
    try:
        start_dc(stepper, partial(without_storage, held), guess_of(circuit, mna))
    except UnsolvedStep as problem:
        raise named_failure(circuit, mna, problem, where="") from problem
    z, lam = stepper.state
    z = z[: system.n]
    slack = system.q - system.B.dot(z) + system.D.dot(lam)
    active = lam > slack
    size = np.maximum(np.abs(lam), np.abs(slack))
    scale = max(float(size.max(initial=0.0)), 1e-300)
    at_corner = size <= _CORNER * scale
    for switch, gate in zip(system.switches, stepper.gates, strict=True):
        closed = gate != switch.inverted
        if not switch.latching:
            active[switch.pair], at_corner[switch.pair] = closed, False
        elif not closed:
            active[switch.pair], at_corner[switch.pair] = False, False
    corners = dict.fromkeys(mna.pair_elements[j] for j in np.flatnonzero(at_corner))
    others = _resistances(island) if alternating else {}
    if others:
        values = {**request.values, **others}
        mna = island.assemble(request.temperature, values, analysis="dc")
        system = mna.system
    found = stimulated(mna, system, stimuli)
    p = 0 if system.smooth is None else system.smooth.F.shape[1]
    slopes, source_slopes = np.zeros((p, system.n)), np.zeros((p, len(found.system.waveforms)))
    functions = np.zeros(p)
    if system.smooth is not None:
        u = np.array([w.values[0] * w.scale for w in system.waveforms])
        point = z[np.newaxis], u[np.newaxis], np.zeros(1)
        functions = function_values(system.smooth.tape, *point)[0]
        slopes = function_slopes(system.smooth.tape, *point)[0]
        by_source = source_slopes_of(system.smooth.tape, *point)[0]
        for name, column in found.columns.items():
            # a law that reads the current of a source reads the source itself
            read = mna.layout.columns.get(name)
            if read is not None:
                source_slopes[:, column] = by_source[:, read]
    return Point(
        mna, found, z, np.flatnonzero(active), slopes, source_slopes, tuple(corners), functions
    )


def _resistances(island: Island) -> dict[str, float]:
    """Return the resistances that are others for small signals [Ohm].

    Raises
    ------
    UsageError
        NS4020 for one that is zero on one side only: the equations have other unknowns.
    """
    found = {}
    for device in island.devices:
        if isinstance(device, Resistor) and device.small_signal is not None:
            found[device.name] = device.small_signal
            if (device.small_signal == 0.0) != (device.value == 0.0):
                message = f"{device.name} is a short circuit at DC or for small signals only"
                hint = "give it a small resistance instead of zero"
                raise UsageError(Diagnostic("NS4020", message, device.span, hint))
    return found


def respond(
    point: Point, functionals: Sequence[Functional], s: Complexes, weights: Mapping[str, complex]
) -> Complexes:
    """Return responses of signals, shape (k, outputs), at complex frequencies s (k,) [1/s].

    Raises
    ------
    NumericalError
        NS3063 where the equations have no solution.
    """
    x = solutions(point, s, weights)
    return point.outputs(functionals, s, x, point.sources(weights))


def solutions(point: Point, s: Complexes, weights: Mapping[str, complex]) -> Complexes:
    """Return unknowns and active multipliers, shape (k, n + active), at complex frequencies."""
    value, rate = point.matrices()
    delays = point.delays()
    right, right_rate = point.drive(weights)
    size = right.size
    x = np.zeros((s.size, size), complex)
    if size <= _DENSE:
        G, E = value.dense(), rate.dense()
        for k in range(0, s.size, _BATCH):
            part = s[k : k + _BATCH]
            matrix = G + part[:, None, None] * E
            for late, delay in delays:
                matrix += np.expm1(-part * delay)[:, None, None] * late.dense()
            rhs = right + part[:, None] * right_rate
            x[k : k + _BATCH] = _solved(matrix, rhs, part)
    else:
        x = _sparse(value, rate, delays, right, right_rate, s)
    return x


def _solved(matrix: Complexes, rhs: Complexes, s: Complexes) -> Complexes:
    # rows of volts and of amperes: each is scaled by its largest entry
    scale = np.abs(matrix).max(axis=2, keepdims=True)
    scale[scale == 0.0] = 1.0
    try:
        found: Complexes = np.linalg.solve(matrix / scale, rhs[..., None] / scale)[..., 0]
    except np.linalg.LinAlgError:
        found = np.full_like(rhs, np.nan)
    for k in np.flatnonzero(~np.isfinite(found).all(axis=1)):
        # floating parts: the least solution, if there is one
        least = np.linalg.lstsq(matrix[k] / scale[k], rhs[k] / scale[k][:, 0], rcond=None)[0]
        rest = np.abs(matrix[k] @ least - rhs[k]).max(initial=0.0)
        if not rest <= 1e-9 * max(float(np.abs(rhs[k]).max(initial=0.0)), 1e-300):
            raise unbounded(float(s[k].imag) / (2.0 * math.pi))
        found[k] = least
    return found


def _sparse(
    value: Csc,
    rate: Csc,
    delays: Sequence[tuple[Csc, float]],
    right: Complexes,
    right_rate: Complexes,
    s: Complexes,
) -> Complexes:
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    def sparse(m: Csc) -> Any:
        return csc_matrix((m.data, m.indices, m.indptr), shape=m.shape)

    G, E = sparse(value), sparse(rate)
    late = [(sparse(part), delay) for part, delay in delays]
    x = np.empty((s.size, right.size), complex)
    for k, at in enumerate(s):
        try:
            matrix = G + at * E + sum(np.expm1(-at * delay) * part for part, delay in late)
            x[k] = splu(matrix.tocsc()).solve(right + at * right_rate)
        except RuntimeError:
            raise unbounded(float(at.imag) / (2.0 * math.pi)) from None
    return x


def unbounded(frequency: float, span: Span | None = None) -> NumericalError:
    """Return the error of a frequency at which a circuit responds without bound."""
    return StepError(
        Diagnostic(
            "NS3063",
            f"at {frequency:g} Hz the circuit has no response, or an unbounded one: a resonance "
            f"is undamped, or a part of the circuit floats",
            span,
            "use another frequency, or damp the resonance with a resistance",
        ),
        time=frequency,
        residual=float("nan"),
    )
