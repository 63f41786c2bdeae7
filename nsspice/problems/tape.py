"""Smooth functions as straight-line programs, which the compiled core evaluates and differentiates.

A tape is a list of instructions; instruction i computes register i from earlier registers, from
unknowns z, source values u(t) and the time.  The core evaluates the functions and, instruction by
instruction, their derivatives with respect to z: no Python and no text at run time (Griewank and
Walther, *Evaluating Derivatives*, SIAM 2008, ch. 2-4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .csc import Floats

#: Instructions in the order of their codes, with the number of register arguments.  ``constant``
#: takes the index of a constant; ``unknown``, ``source`` the index of z and u.  ``junction`` is
#: ``Is expm1(v / nVt)`` with the constants ``Is, nVt``; ``depletion`` is the charge of a junction
#: with the constants ``CJ0, VJ, M, FC``; ``table`` is a piecewise-linear function, constant beyond
#: its ends, of the constants ``count, x1, y1, x2, y2, ...``; ``staircase`` has constants of the
#: same form and takes each y on [x, next x), zero outside.  ``softplus`` is ``k ln(1 + exp(x/k))``
#: with the constant k; ``gate_drain`` the charge of a capacitance that falls from Cmax to Cmin as
#: that of a VDMOS does, constants ``Cmin, Cmax, a``; ``body`` is ``sqrt(phi - v)`` with the
#: constant phi, along its tangent down to zero for positive v.  Rounding and comparisons have the
#: derivative 0; at a kink the derivative of the side to the right holds.
OPS: dict[str, int] = {
    "constant": 0,
    "unknown": 0,
    "source": 0,
    "time": 0,
    "neg": 1,
    "inv": 1,
    "not": 1,
    "abs": 1,
    "sqrt": 1,
    "exp": 1,
    "expm1": 1,
    "ln": 1,
    "log1p": 1,
    "log10": 1,
    "sin": 1,
    "cos": 1,
    "tan": 1,
    "asin": 1,
    "acos": 1,
    "atan": 1,
    "sinh": 1,
    "cosh": 1,
    "tanh": 1,
    "asinh": 1,
    "acosh": 1,
    "atanh": 1,
    "floor": 1,
    "ceil": 1,
    "nint": 1,
    "int": 1,
    "sgn": 1,
    "u": 1,
    "u2": 1,
    "uramp": 1,
    "buf": 1,
    "square": 1,
    "add": 2,
    "sub": 2,
    "mul": 2,
    "div": 2,
    "pow": 2,
    "pwr": 2,
    "min": 2,
    "max": 2,
    "atan2": 2,
    "hypot": 2,
    "lt": 2,
    "le": 2,
    "gt": 2,
    "ge": 2,
    "eq": 2,
    "ne": 2,
    "and": 2,
    "or": 2,
    "if": 3,
    "junction": 1,
    "depletion": 1,
    "table": 1,
    "staircase": 1,
    "softplus": 1,
    "gate_drain": 1,
    "body": 1,
}
CODES: dict[str, int] = {name: code for code, name in enumerate(OPS)}
#: these carry constants: their second argument is the index of the first one
WITH_CONSTANTS = frozenset(
    {"junction", "depletion", "table", "staircase", "softplus", "gate_drain", "body"}
)


@dataclass(frozen=True, slots=True)
class Tape:
    """A compiled set of p functions of z, u and t.

    Parameters
    ----------
    ops : ndarray of uint8, shape (k,)
        Codes of the instructions, see ``OPS``.
    args : ndarray of int32, shape (k, 3)
        Registers or indices; 0 where an instruction takes fewer.
    constants : ndarray, shape (c,)
    outputs : ndarray of int32, shape (p,)
        Register of each function.
    """

    ops: npt.NDArray[np.uint8]
    args: npt.NDArray[np.int32]
    constants: Floats
    outputs: npt.NDArray[np.int32]

    @property
    def timed(self) -> bool:
        """True if a function depends on the time itself."""
        return bool(np.any(self.ops == CODES["time"]))


class TapeBuilder:
    """Writes a tape; equal instructions are written once.

    Examples
    --------
    The function ``exp(z0 - z1)``:

    >>> builder = TapeBuilder()
    >>> difference = builder.op("sub", builder.unknown(0), builder.unknown(1))
    >>> builder.output(builder.op("exp", difference))
    0
    >>> builder.finish().outputs.tolist()
    [3]
    """

    def __init__(self) -> None:
        self._known: dict[tuple[int, ...], int] = {}
        self._code: list[tuple[int, int, int, int]] = []
        self._constants: list[float] = []
        self._places: dict[tuple[str, ...], int] = {}
        self._outputs: list[int] = []

    def constant(self, value: float) -> int:
        """Return the register of a constant."""
        return self._write("constant", self._place((value,)))

    def unknown(self, index: int) -> int:
        """Return the register of ``z[index]``; index -1 (ground) is the constant 0."""
        return self._write("unknown", index) if index >= 0 else self.constant(0.0)

    def source(self, index: int) -> int:
        """Return the register of the source value ``u[index]``."""
        return self._write("source", index)

    def time(self) -> int:
        """Return the register of the time [s]."""
        return self._write("time")

    def op(self, name: str, *registers: int, constants: tuple[float, ...] = ()) -> int:
        """Return the register of an instruction of ``OPS``.

        Parameters
        ----------
        name : str
        registers : int
            Arguments.
        constants : tuple of float
            For the instructions that take them.

        Raises
        ------
        ValueError
            If the number of arguments is wrong.
        """
        carries = name in WITH_CONSTANTS
        if len(registers) != OPS[name] or carries != bool(constants):
            raise ValueError(f"instruction {name} with {len(registers)} registers, {constants}")
        return self._write(name, *registers, *([self._place(constants)] if carries else []))

    def total(self, plus: Sequence[int], minus: Sequence[int]) -> int:
        """Return the register of a sum of unknowns.

        Nothing else shares the instructions of a longer one: elements whose instructions are apart
        are evaluated apart.

        Parameters
        ----------
        plus, minus : sequence of int
            Registers that are added and subtracted.
        """
        write = self.op if len(plus) + len(minus) <= 2 else self._append
        if not plus and not minus:
            return self.constant(0.0)
        found, *more = plus or (write("neg", minus[0]),)
        for register in more:
            found = write("add", found, register)
        for register in minus if plus else minus[1:]:
            found = write("sub", found, register)
        return found

    def output(self, register: int) -> int:
        """Make a register a function of the tape; return the number of the function."""
        self._outputs.append(register)
        return len(self._outputs) - 1

    def finish(self) -> Tape:
        """Return the tape."""
        code = np.array(self._code, dtype=np.int32).reshape(-1, 4)
        return Tape(
            ops=code[:, 0].astype(np.uint8),
            args=np.ascontiguousarray(code[:, 1:]),
            constants=np.array(self._constants, dtype=np.float64),
            outputs=np.array(self._outputs, dtype=np.int32),
        )

    def _write(self, name: str, *args: int) -> int:
        key = (CODES[name], *args)
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._append(name, *args)
        return found

    def _append(self, name: str, *args: int) -> int:
        a, b, c = (*args, 0, 0, 0)[:3]
        self._code.append((CODES[name], a, b, c))
        return len(self._code) - 1

    def _place(self, values: tuple[float, ...]) -> int:
        # repr distinguishes 0.0 from -0.0, which compare equal
        key = tuple(repr(v) for v in values)
        found = self._places.get(key)
        if found is None:
            found = self._places[key] = len(self._constants)
            self._constants.extend(values)
        return found
