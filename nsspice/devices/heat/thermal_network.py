"""Thermal networks from junction to a fixed temperature, Foster's or Cauer's form.

Both are a sum of first-order terms, of which Foster's form lists resistances and time constants:

.. math::

    Z(t) = \\sum_k R_k (1 - e^{-t/\\tau_k}) .

A Cauer ladder (capacities to the fixed temperature, resistances in a row from the junction on) is
the linear system :math:`C T' = -G T + p e_1`.  With :math:`S = C^{-1/2} G C^{-1/2}` symmetric and
positive, :math:`S = Q \\Lambda Q^T`, it is :math:`\\tau_k = 1/\\lambda_k` and
:math:`R_k = Q_{1k}^2 / (C_1 \\lambda_k)`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...netlist.deck import Grid, Param
from ...netlist.findings import Findings

_HINTS = {
    "foster": "write Foster=table(r=0.1 0.3 tau=1m 50m): K/W and s for each term",
    "cauer": "write Cauer=table(r=0.1 0.3 c=10m 0.2): K/W and J/K, starting at the junction",
}


@dataclass(frozen=True, slots=True)
class ThermalNetwork:
    """A thermal impedance in Foster's form.

    Parameters
    ----------
    resistances : tuple of float
        [K/W]
    times : tuple of float
        Time constants [s].
    """

    resistances: tuple[float, ...]
    times: tuple[float, ...]

    @property
    def resistance(self) -> float:
        """Of the whole network [K/W]."""
        return math.fsum(self.resistances)


def thermal_network(
    param: Param, owner: str, findings: Findings | None = None
) -> ThermalNetwork | None:
    """Return the network of ``foster`` or ``cauer``, or None after reporting what is wrong.

    Parameters
    ----------
    param : Param
    owner : str
        ``model m``, for messages.
    findings : Findings, optional
    """
    second = "tau" if param.name == "foster" else "c"
    lists = param.value.lists if isinstance(param.value, Grid) else {}
    r, other = lists.get("r", ()), lists.get(second, ())
    fits = len(r) == len(other) > 0 and lists.keys() == {"r", second}
    if fits and all(0.0 < x < math.inf for x in (*r, *other)):
        return ThermalNetwork(r, other) if param.name == "foster" else _foster(r, other)
    if findings is not None:
        message = f"{param.name} of {owner} needs as many positive values r as {second}"
        findings.error("NS2005", message, param.span, _HINTS[param.name])
    return None


def _foster(r: tuple[float, ...], c: tuple[float, ...]) -> ThermalNetwork:
    """Return a ladder as a sum of first-order terms."""
    import numpy as np

    G = np.diag([1.0 / x for x in r])
    for k in range(len(r) - 1):
        G[k, k + 1] = G[k + 1, k] = -1.0 / r[k]
        G[k + 1, k + 1] += 1.0 / r[k]
    root = np.sqrt(np.array(c))
    rates, vectors = np.linalg.eigh(G / np.outer(root, root))
    parts = vectors[0] ** 2 / (c[0] * rates)
    return ThermalNetwork(tuple(map(float, parts)), tuple(map(float, 1.0 / rates)))
