"""How the charges with which a transient begins depend on parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...circuit import Circuit, MnaSystem
from ...devices.sources.waveform import initial_value
from ...errors import Diagnostic, UsageError
from ...problems.descriptor import DescriptorSystem
from ..averages.integrable_run import first_state
from ..request.cards import Tran
from ..signals.curve import Floats
from ..static.initial import initial_voltages
from .sources import slope_by


class Beginning:
    """Derivatives by the charges at the beginning, carried on to parameters.

    Parameters
    ----------
    circuit : Circuit
    mna : MnaSystem
    analysis : Tran

    Raises
    ------
    UsageError
        NS4041 if the beginning is a DC solution whose dependence is not known.
    """

    def __init__(self, circuit: Circuit, mna: MnaSystem, analysis: Tran) -> None:
        self._mna, self._stop = mna, analysis.stop
        self._dc: tuple[Floats, Floats] | None = None
        if analysis.uic or mna.system.static:
            return
        if initial_voltages(circuit, mna):
            hint = "add uic to the .tran card"
            message = "the DC solution with nodes held by .ic is not differentiated"
            raise UsageError(Diagnostic("NS4041", message, hint=hint))
        first = first_state(circuit, mna, analysis)
        assert first.dc_point is not None
        self._dc = first.dc_point
        self._active = _active(mna.system, *first.dc_point, first.first_gates)

    def derivatives(self, charges: Floats, changes: Sequence[Mapping[Any, float]]) -> list[float]:
        """Return derivatives by each parameter.

        Parameters
        ----------
        charges : ndarray, shape (n,)
            Derivatives by the charges and fluxes.
        changes : sequence of mapping
            Derivatives of all numbers by each parameter.
        """
        if self._dc is None:
            return [
                sum(charges[key[1]] * d for key, d in change.items() if key[0] == "charge")
                for change in changes
            ]
        z, lam = self._dc
        system, active = self._mna.system, self._active
        E, G, A, B, D = (getattr(system, name).dense() for name in "EGABD")
        matrix = np.block([[G, A[:, active]], [-B[active], D[np.ix_(active, active)]]])
        right = np.concatenate([E.T @ charges, np.zeros(active.size)])
        # where charges alone connect nodes the DC solution is the least one
        y = np.linalg.lstsq(matrix.T, right, rcond=None)[0]
        rows, pairs = y[: system.n], np.zeros(system.m)
        pairs[active] = y[system.n :]
        u = np.array([initial_value(wave) for wave in system.waveforms])
        S = system.S.dense()
        found = []
        for change in changes:
            total = 0.0
            for key, d in change.items():
                match key:
                    case ("E", row, j):
                        total += charges[row] * z[j] * d
                    case ("G", row, j):
                        total -= rows[row] * z[j] * d
                    case ("A", row, pair):
                        total -= rows[row] * lam[pair] * d
                    case ("S", row, source):
                        total += rows[row] * u[source] * d
                    case ("B", pair, j):
                        total += pairs[pair] * z[j] * d
                    case ("D", pair, other):
                        total -= pairs[pair] * lam[other] * d
                    case ("q", pair):
                        total -= pairs[pair] * d
                    case ("scale", source):
                        wave = system.waveforms[source]
                        total += float(rows @ S[:, source]) * u[source] / wave.scale * d
                    case ("wave", source, place):
                        slopes = slope_by(system.waveforms[source], place, self._stop)
                        total += float(rows @ S[:, source]) * sum(map(initial_value, slopes)) * d
            found.append(float(total))
        return found


def _active(
    system: DescriptorSystem, z: Floats, lam: Floats, gates: list[bool]
) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return the pairs that conduct in a DC solution."""
    slack = system.q - system.B.dot(z) + system.D.dot(lam)
    active = lam > slack
    for switch, gate in zip(system.switches, gates, strict=True):
        closed = gate != switch.inverted
        active[switch.pair] = (active[switch.pair] and closed) if switch.latching else closed
    return np.flatnonzero(active)
