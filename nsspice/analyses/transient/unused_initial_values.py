"""Initial voltages with which a run does not begin: nothing stores them."""

from __future__ import annotations

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...errors import Diagnostic
from ..signals.curve import Floats
from ..static.initial import given_voltages

#: rounding of a voltage, as a share of the largest
_ROUNDING = 1e-6


def unkept(circuit: Circuit, mna: MnaSystem, point: Floats, uic: bool) -> list[Diagnostic]:
    """Return warnings about ``.ic`` and ``.nodeset`` of an island in which something is stored.

    Parameters
    ----------
    circuit : Circuit
    mna : MnaSystem
        Of the island.
    point : ndarray, shape (n,)
        The unknowns with which the run begins.
    uic : bool
        True if the run begins from initial values.
    """
    found = []
    if uic and (near := given_voltages(circuit.deck.nodesets, mna)):
        names = ", ".join(f"v({node})" for node in near)
        found.append(
            Diagnostic(
                "NS3054",
                f".nodeset of {names} has no effect: with uic no DC solution is computed, and "
                f"the run starts from the stored charges and fluxes",
                next(iter(near.values()))[1],
                "give capacitors there an IC=, or remove uic",
                severity="warning",
            )
        )
    scale = max(float(np.abs(point).max(initial=0.0)), 1e-300)
    for node, (value, span) in given_voltages(circuit.deck.initial, mna).items():
        begins = mna.voltage(node, point)
        if _stores(mna, node) or abs(begins - value) <= _ROUNDING * max(scale, abs(value)):
            continue
        found.append(
            Diagnostic(
                "NS3054",
                f".ic v({node})={value:g} is not kept: no capacitor at {node} stores it, and the "
                f"run starts with {begins:.6g} V",
                span,
                f"to start from another solution, put a small capacitor from {node} to ground",
                severity="warning",
            )
        )
    return found


def _stores(mna: MnaSystem, node: str) -> bool:
    """Return whether charge that is kept depends on the voltage of a node."""
    layout, smooth = mna.layout, mna.system.smooth
    index = layout.nodes[node]
    if mna.system.elements is not None and any(
        index in ends[:2] for ends in mna.system.elements.capacitors
    ):
        return True
    if smooth is None:
        return False
    # what enters the node: what passes its cut-set but not those of the nodes behind it
    behind = [k for name, k in layout.nodes.items() if k >= 0 and layout.before(name) == node]
    charges = smooth.Q.dense()
    return bool((charges[index] - charges[behind].sum(axis=0)).any())
