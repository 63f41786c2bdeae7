"""Systems with voltages against ground as unknowns, as in textbooks."""

from __future__ import annotations

import numpy as np

from nsspice.circuit import MnaSystem
from nsspice.circuit.mna import assemble

from .closed_forms import Floats


def in_node_voltages(mna: MnaSystem) -> MnaSystem:
    """Return the same island with voltages against ground as unknowns."""
    nodes = [node for node in mna.row_nodes if node is not None]
    return assemble(mna.devices, nodes, mna.layout.conditions, {})


def potentials_of(mna: MnaSystem) -> Floats:
    """Return the matrix that takes unknowns to voltages against ground and currents."""
    out = np.eye(mna.system.n)
    for node, row in mna.layout.nodes.items():
        for index, sign in mna.layout.voltage(node, "0"):
            out[row, index] = sign
    return out
