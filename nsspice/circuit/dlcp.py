"""The DLCP form: states, inputs and outputs as in the mathematics of complementarity systems.

    x' = A x + B u + F s + F1 s' + a,      y = C x + D u + G s + c,      0 <= u perp y >= 0

with the states x of the normal tree.  For a set-valued branch in the tree u is its slack (for an
ideal diode minus its voltage) and y its current; outside the tree it is the other way round.  Pairs
of switches take part in x, u, y alike, but are opened and closed by their control.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import Diagnostic, RegularityError
from ..problems.csc import Floats
from .mna import MnaSystem
from .normal_form import Reference, network_inputs, reference, storage_terms


@dataclass(frozen=True, slots=True)
class DlcpForm:
    """The matrices of the DLCP form.

    Parameters
    ----------
    A, B, C, D : ndarray
        Shapes (x, x), (x, m), (m, x), (m, m).
    F, G : ndarray
        Where the sources enter, shapes (x, p) and (m, p).
    F1 : ndarray, shape (x, p)
        Factor of the sources' derivatives; nonzero only if capacitors close a loop with sources or
        inductors a cut-set with them.
    a, c : ndarray
        Constants, from forward drops and breakdown voltages.
    E_x : ndarray, shape (x, x)
        Storage matrix: the energy is ``x' E_x x / 2``.
    states, inputs, outputs, sources : list of str
        ``v[c1]`` ``i[l1]``; ``-v[d1]`` ``w[d2]`` ``i[d3]``; the other quantity of each pair; the
        names of the elements that share each source.
    """

    A: Floats
    B: Floats
    C: Floats
    D: Floats
    F: Floats
    G: Floats
    F1: Floats
    a: Floats
    c: Floats
    E_x: Floats
    states: list[str]
    inputs: list[str]
    outputs: list[str]
    sources: list[str]

    def to_dict(self) -> dict[str, object]:
        """Return a JSON-ready mapping."""
        matrices = {
            name: getattr(self, name).tolist()
            for name in ("A", "B", "C", "D", "F", "G", "F1", "a", "c", "E_x")
        }
        return {
            "states": self.states,
            "inputs": self.inputs,
            "outputs": self.outputs,
            "sources": self.sources,
            **matrices,
        }


def dlcp_form(mna: MnaSystem) -> DlcpForm:
    """Return the DLCP form of an assembled island.

    Parameters
    ----------
    mna : MnaSystem

    Raises
    ------
    RegularityError
        NS2060 if the states do not determine the circuit, NS2061 if a state would depend on the
        derivative of a multiplier.
    """
    network = reference(mna)
    s = mna.system
    n, m, k, p = s.n, s.m, len(network.states), len(s.waveforms)
    right = network_inputs(network)
    solution = network.solver()(right)
    z, lam, rho = np.split(solution, [n, n + m])
    storage = storage_terms(network, z)
    scale = 1e-9 * np.abs(s.E.data).max(initial=0.0)
    for tied in (
        np.abs(storage.E_u).max(axis=0, initial=0.0),
        np.abs(storage.outputs).max(axis=1, initial=0.0),
    ):
        if tied.max(initial=0.0) > scale:
            raise _derivative(network, int(np.argmax(tied)))
    outputs = network.outputs(z, lam)
    outputs[:, -1] += np.where(network.in_tree, 0.0, s.q)
    right = np.hstack([rho, -storage.E_s])
    rates: Floats = np.asarray(np.linalg.solve(storage.E_x, right)) if k else right
    x, u, e = slice(0, k), slice(k, k + m), slice(k + m, k + m + p)
    return DlcpForm(
        A=_clean(rates[:, x]),
        B=_clean(rates[:, u]),
        C=_clean(outputs[:, x]),
        D=_clean(outputs[:, u]),
        F=_clean(rates[:, e]),
        G=_clean(outputs[:, e]),
        F1=_clean(rates[:, k + m + p + 1 :]),
        a=_clean(rates[:, k + m + p]),
        c=_clean(outputs[:, k + m + p]),
        E_x=_clean(storage.E_x),
        states=[state.name for state in network.states],
        inputs=[_pair_name(mna, j, bool(network.in_tree[j])) for j in range(m)],
        outputs=[_pair_name(mna, j, not network.in_tree[j]) for j in range(m)],
        sources=_source_names(mna, p),
    )


def _clean(matrix: Floats) -> Floats:
    """Return the matrix with rounding errors next to large entries of a row set to zero."""
    rows = np.abs(matrix)
    largest = (
        rows.max(axis=-1, keepdims=True, initial=0.0) if matrix.ndim > 1 else rows.max(initial=0.0)
    )
    return np.where(rows <= 1e-15 * largest, 0.0, matrix)


def _pair_name(mna: MnaSystem, pair: int, slack: bool) -> str:
    """Return the name of the slack or the current of a pair."""
    name = mna.pairs[pair]
    if not slack:
        return f"i[{name}]"
    plain = mna.system.q[pair] == 0.0 and not np.any(mna.system.D.indices == pair)
    return f"-v[{name}]" if plain else f"w[{name}]"


def _source_names(mna: MnaSystem, count: int) -> list[str]:
    """Return for each source column the elements that use it."""
    names: list[list[str]] = [[] for _ in range(count)]
    for element, column in mna.layout.columns.items():
        names[column].append(element)
    return ["=".join(group) for group in names]


def _derivative(network: Reference, pair: int) -> RegularityError:
    """Return the error for a storing element that a controlled source ties to a pair."""
    name = network.mna.pair_elements[pair]
    active = [d.name for d in network.mna.devices if d.letter in "efgh"]
    listed = f" through {', '.join(active[:6])}" if active else ""
    return RegularityError(
        Diagnostic(
            "NS2061",
            f"the circuit has no DLCP form: the voltage or current of {name} is differentiated "
            f"by a capacitor or an inductor{listed}",
            None,
            "simulate it as it is (the MNA system needs no such form), or add a resistor",
        )
    )
