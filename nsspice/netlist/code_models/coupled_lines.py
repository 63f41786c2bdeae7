"""Coupled transmission lines ``P`` (CPL): each mode is a line of its own.

With V = T V' and I = T^-t I' both L and C become diagonal.  The resistance T^-1 R T^-t is diagonal,
too, where the modes do not depend on it: for equal resistances and symmetrical lines.  What is
off its diagonal is left out, and reported.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..elements.transmission import lossless
from .block import Block, wrong
from .lossy_lines import attenuated

Floats = npt.NDArray[np.float64]
#: of all modes, by choice of their units [Ohm]
_IMPEDANCE = 100.0
#: delays of which the squares differ by less are equal
_EQUAL = 1e-9
#: resistance between two modes, relative to the largest, that is rounding
_ROUNDING = 1e-12


def lines(block: Block) -> list[str]:
    """Return the modes of coupled lines, and the sources that couple them to the ports."""
    near, far = block.ports[:2]
    count = len(near)
    length = block.number("length", block.number("len", 0.0))
    r, inductance, g, c = (_matrix(block, key, count) * length for key in "rlgc")
    if not length > 0.0 or np.any(g):
        raise wrong(block, "coupled lines need a length, and have no conductance G")
    if count != len(far) or min(np.linalg.eigvalsh(m)[0] for m in (inductance, c)) <= 0.0:
        raise wrong(block, "L and C must be positive definite, and both ends have as many nodes")
    # symmetric modes: C = K K^t, K^t L K = U diag(squares of delays) U^t, T = K^-t U
    factor = np.linalg.cholesky(c)
    squares, modes = _modes(factor.T @ inductance @ factor, factor.T @ r @ factor)
    delays = np.sqrt(squares)
    # T^-1: C' = 1 and L' = diag(squares), and then in units where each mode has _IMPEDANCE
    to_modes = (factor @ modes).T * np.sqrt(_IMPEDANCE / delays)[:, np.newaxis]
    losses = to_modes @ r @ to_modes.T
    apart = float(np.abs(losses - np.diag(np.diag(losses))).max())
    made: list[str] = []
    if apart > _ROUNDING * max(float(np.abs(losses).max()), 1e-300):
        part = apart / float(np.diag(losses).max())
        made.append(f"* its modes exchange {part:.1%} of their resistance, which is left out")
    for k in range(count):
        for name, ports in (("n", near), ("f", far)):
            terms = " + ".join(
                f"{float(to_modes[k, j])!r}*v({port.plus},{port.minus})"
                for j, port in enumerate(ports)
            )
            # a source that carries the current of the mode, in
            made.append(f"Bm{name}{k} m{name}{k} 0 V={{{terms}}}")
        one, other = (f"mn{k}", "0"), (f"mf{k}", "0")
        loss, delay = float(losses[k, k]), float(delays[k])
        if loss > 0.0:
            made += attenuated(loss, _IMPEDANCE, delay, (one, other), f"m{k}x")
        else:
            made += lossless(_IMPEDANCE, delay, one, other, f"m{k}x")
    for name, ports in (("n", near), ("f", far)):
        for j, port in enumerate(ports):
            terms = " + ".join(f"{-float(to_modes[k, j])!r}*i(Bm{name}{k})" for k in range(count))
            made.append(f"Bp{name}{j} {port.plus} {port.minus} I={{{terms}}}")
    return made


def _modes(inductance: Floats, resistance: Floats) -> tuple[Floats, Floats]:
    """Return eigenvalues and eigenvectors of one matrix; of equal ones, those of the other, too.

    Where the delays are equal, in a homogeneous medium, any mixture of modes is one.
    """
    squares, modes = np.linalg.eigh(inductance)
    first = 0
    for k in range(1, squares.size + 1):
        if k == squares.size or squares[k] - squares[k - 1] > _EQUAL * squares[k]:
            part = modes[:, first:k]
            modes[:, first:k] = part @ np.linalg.eigh(part.T @ resistance @ part)[1]
            first = k
    return squares, modes


def _matrix(block: Block, key: str, count: int) -> Floats:
    """Return a symmetric matrix of its upper triangle, row by row."""
    numbers = block.numbers(key) or [0.0] * (count * (count + 1) // 2)
    matrix = np.zeros((count, count))
    rows, columns = np.triu_indices(count)
    if len(numbers) != rows.size:
        message = f"{key.upper()} has {len(numbers)} numbers, {rows.size} are needed: the upper"
        raise wrong(block, f"{message} triangle of a matrix for {count} lines")
    matrix[rows, columns] = matrix[columns, rows] = numbers
    return matrix
