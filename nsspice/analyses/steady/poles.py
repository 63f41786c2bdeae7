"""``.pz``: poles and zeros of a transfer function about the operating point.

They are the roots of determinants of the matrices of the linearised circuit: for the poles with the
input driven by nothing (a current input is open, a voltage input is shorted), for the zeros with
the output held at zero by the input.  Natural frequencies that the input does not excite, or the
output does not show, are roots of both.
"""

from __future__ import annotations

import time as clock
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ...circuit import Circuit
from ...devices.sources.vsource import VoltageSource
from ...errors import Diagnostic, Span, UsageError
from ...netlist.deck import PzCard
from ...problems.descriptor import Functional
from ...problems.pencil import SingularPencil, roots
from ..request.request import Request
from ..request.row_sinks import hand_over
from ..request.sampled import refuse_sampled
from ..solution.solution import Solution
from .linearised import Complexes, Point, operating_point
from .stimuli import injection

Matrix = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Pz:
    """What is asked for.

    Parameters
    ----------
    input, output : (str, str)
        Nodes of the two ports.
    kind : str
        ``vol``: the input is a voltage; ``cur``: a current.
    wanted : str
        ``pol``, ``zer`` or ``pz``.
    span : Span or None
        Of the card.
    """

    input: tuple[str, str]
    output: tuple[str, str]
    kind: str = "vol"
    wanted: str = "pz"
    span: Span | None = None

    @classmethod
    def from_card(cls, card: PzCard) -> Pz:
        """Return the analysis of a card."""
        return cls(card.input, card.output, card.kind, card.wanted, card.span)


def run_pz(circuit: Circuit, analysis: Pz, request: Request) -> Solution:
    """Find poles and zeros.

    Returns
    -------
    Solution
        One row: ``sol["pole(1)"]``, ``sol["zero(1)"]`` ... [rad/s], complex, the smallest first.
    """
    refuse_sampled(circuit.deck, ".pz")
    begin = clock.perf_counter()
    border = _Border.of(circuit, analysis, request)
    table: dict[str, npt.NDArray[np.float64]] = {}
    for key, name, asked, matrices in (
        ("pole", "poles", "pol", border.poles),
        ("zero", "zeros", "zer", border.zeros),
    ):
        if analysis.wanted not in (asked, "pz"):
            continue
        try:
            found: Complexes = roots(*matrices()).clean()
        except SingularPencil:
            message = f".pz: the {name} are undetermined: the determinant is zero for every s"
            hint = "a part of the circuit floats, or the input does not reach the output"
            raise UsageError(Diagnostic("NS4034", message, analysis.span, hint)) from None
        for k, value in enumerate(found, start=1):
            table[f"re({key}({k}))"] = np.array([value.real])
            table[f"im({key}({k}))"] = np.array([value.imag])
    solution = Solution(
        "pz",
        circuit.deck.title,
        "",
        np.zeros(1),
        table,
        list(table),
        wall_time=clock.perf_counter() - begin,
    )
    hand_over(solution, request.sink)
    return solution


@dataclass(frozen=True, slots=True)
class _Border:
    """The matrices of an island with the rows and columns of its ports.

    Parameters
    ----------
    A, B : ndarray, shape (n, n)
        Of values and of rates.
    column, column_rate : ndarray, shape (n,)
        How the input enters the equations.
    rows : list of (ndarray, ndarray, float)
        What the voltages at input and output are: of values, of rates, and of the input itself.
    free : bool
        Whether the input is a voltage that no source of the deck holds.
    """

    A: Matrix
    B: Matrix
    column: Matrix
    column_rate: Matrix
    rows: list[tuple[Matrix, Matrix, float]]
    free: bool

    @classmethod
    def of(cls, circuit: Circuit, analysis: Pz, request: Request) -> _Border:
        """Return those of a circuit."""
        names = [_voltage(*analysis.input), _voltage(*analysis.output)]
        homes = {home for name in names for home, _, _ in circuit.parts(name)}
        if len(homes) != 1:
            message = f".pz: {names[1]} does not depend on {names[0]}"
            hint = "name two ports of one connected part of the circuit"
            raise UsageError(Diagnostic("NS4034", message, analysis.span, hint))
        island = circuit.islands[homes.pop()]
        source = next(
            (
                d.name
                for d in island.devices
                if isinstance(d, VoltageSource) and set(d.ends) == set(analysis.input)
            ),
            None,
        )
        if source is not None and analysis.kind == "cur":
            message = f".pz: {source} holds the voltage at the input: a current has no effect"
            hint = "write vol, or remove the source"
            raise UsageError(Diagnostic("NS4034", message, analysis.span, hint))
        ends = zip(analysis.input, (1.0, -1.0), strict=True)
        stimuli: dict[str, complex] = {injection(n): sign for n, sign in ends if n != "0"}
        if source is not None:
            stimuli = {source: 1.0}
        point = operating_point(circuit, island, stimuli, request)
        A, B = (m.dense() for m in point.matrices())
        column, rate = (m.real for m in point.drive(stimuli))
        weights = point.sources(stimuli).real
        rows = [_row(point, point.stimulated.functional(point.mna, n), weights) for n in names]
        return cls(A, B, column, rate, rows, source is None and analysis.kind == "vol")

    def poles(self) -> tuple[Matrix, Matrix]:
        """Return the pencil of the poles: a free voltage input is shorted."""
        return self._bordered(self.rows[0]) if self.free else (self.A, self.B)

    def zeros(self) -> tuple[Matrix, Matrix]:
        """Return the pencil of the zeros: the input holds the output at zero."""
        return self._bordered(self.rows[1])

    def _bordered(self, row: tuple[Matrix, Matrix, float]) -> tuple[Matrix, Matrix]:
        value, rate, own = row
        A = np.block([[self.A, -self.column[:, None]], [value[None], np.array([[own]])]])
        B = np.block([[self.B, -self.column_rate[:, None]], [rate[None], np.zeros((1, 1))]])
        return A, B


def _voltage(a: str, b: str) -> str:
    return f"v({a},{b})" if b != "0" and a != "0" else f"v({a if a != '0' else b})"


def _row(point: Point, output: Functional, weights: Matrix) -> tuple[Matrix, Matrix, float]:
    """Return an output as a row over ``[z; active multipliers]``, of values and of rates."""
    value, rate = point.row(output)
    own = sum(factor * float(weights[index]) for index, factor in output.u)
    for index, factor in output.f:
        own += factor * float(point.source_slopes[index] @ weights)
    return value, rate, own
