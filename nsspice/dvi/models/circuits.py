"""Circuits as differential linear complementarity problems."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...circuit.dlcp import dlcp_form
from ...errors import RegularityError
from ..terms.errors import wrong
from ..terms.expression import Expr, as_expr, cos, sin, t
from .dlcp import DLCP

if TYPE_CHECKING:
    from ...circuit import Circuit
    from ...problems.descriptor import Waveform


def from_circuit(circuit: Circuit, *, uic: bool = True) -> DLCP:
    """Return the differential linear complementarity problem of a circuit.

    ``x' = A x + B u + F s + F1 s' + a``, ``y = C x + D u + G s + c`` with capacitor voltages and
    inductor currents x, as ``nsspice explain --matrices`` shows them.

    Parameters
    ----------
    circuit : Circuit
        One island, linear except for its diodes, with DC and sine sources.
    uic : bool
        Start from the initial values of the elements (0 by default); a problem with states has no
        other start.

    Raises
    ------
    UsageError
        NS6005 for smooth laws, switches, several islands or other sources.

    Examples
    --------
    >>> import nsspice
    >>> deck = nsspice.read('''half-wave
    ... V1 a 0 SIN(0 10 50)
    ... D1 a b
    ... R1 b 0 1
    ... L1 b 0 1 IC=2
    ... ''')
    >>> problem = from_circuit(deck)
    >>> problem.A.shape, problem.D.shape
    ((1, 1), (1, 1))
    """
    if len(circuit.islands) != 1:
        raise wrong(
            "NS6005", f"the circuit has {len(circuit.islands)} independent parts", "split it"
        )
    if not uic:
        raise wrong(
            "NS6005", "a problem with states starts from its states", "run the circuit itself"
        )
    island = circuit.islands[0]
    mna = island.assemble()
    system = mna.system
    if system.smooth is not None or system.switches:
        raise wrong(
            "NS6005",
            "the circuit contains smooth nonlinear laws or switches, which a DLCP cannot have",
            "nsspice.tran runs it",
        )
    try:
        form = dlcp_form(mna)
    except RegularityError as error:
        raise wrong(
            "NS6005", f"the circuit has no DLCP form: {error.diagnostics[0].message}", ""
        ) from error
    signals = [_expression(w) for w in system.waveforms]
    values = np.array([s for s, _ in signals], dtype=object)
    rates = np.array([r for _, r in signals], dtype=object)
    n, m, p = len(form.states), len(form.inputs), len(signals)
    F, F1 = form.F.reshape(n, p), form.F1.reshape(n, p)
    G = form.G.reshape(m, p)
    right = [as_expr(float(a)) for a in form.a.ravel()]
    slack = [as_expr(float(c)) for c in form.c.ravel()]
    for out, matrix, by in ((right, F, values), (right, F1, rates), (slack, G, values)):
        for i, j in zip(*np.nonzero(matrix), strict=True):
            out[i] = out[i] + float(matrix[i, j]) * by[j]
    x0 = [_initial(mna, name) for name in form.states]
    problem = DLCP(
        form.A.reshape(n, n), form.B.reshape(n, m), form.C.reshape(m, n), form.D.reshape(m, m),
        np.array(right, dtype=object) if n else 0.0, np.array(slack, dtype=object) if m else 0.0,
        x0=x0, name=circuit.deck.title,
    )  # fmt: skip
    problem.labels = {"states": list(form.states), "u": list(form.inputs), "y": list(form.outputs)}
    return problem


def _expression(waveform: Waveform) -> tuple[Expr, Expr]:
    """Return a source and its rate as expressions of the time."""
    v, scale = waveform.values, waveform.scale
    if waveform.kind == "dc":
        return as_expr(scale * v[0]), as_expr(0.0)
    if waveform.kind == "sin" and v[3] == 0.0 and v[4] == 0.0:
        rate, phase = 2.0 * np.pi * v[2], np.radians(v[5])
        angle = rate * t + phase
        return scale * (v[0] + v[1] * sin(angle)), scale * v[1] * rate * cos(angle)
    raise wrong(
        "NS6005", f"a {waveform.kind} source is not a sine of time from the start",
        "DC and SIN without delay and damping can be written as expressions",
    )  # fmt: skip


def _initial(mna: Any, name: str) -> float:
    """Return the initial value of a state: of a capacitor or an inductor."""
    element = name[name.index("[") + 1 : -1]
    for store in (*mna.capacitors, *mna.inductors):
        if store.name == element:
            return float(store.ic or 0.0)
    raise wrong("NS6005", f"the state {name} is not an element with an initial value", "")
