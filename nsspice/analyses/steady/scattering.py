"""``.sp``: scattering parameters between the ports of a circuit, about the operating point.

A port is a V with ``portnum``: an ideal source in series with its impedance.  With the source j at
1 V and the others at zero, ``S_ij = 2 v_i sqrt(z_j / z_i)`` less 1 for i = j (power waves of real
impedances).

References: K. Kurokawa, "Power waves and the scattering matrix", IEEE Trans. MTT 13 (1965) 194,
doi:10.1109/TMTT.1965.1125964.
"""

from __future__ import annotations

import time as clock
from dataclasses import dataclass

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, Span, UsageError
from ...netlist.deck import SpCard
from ...netlist.elements.parasitics import port_impedance
from ..request.request import Request
from ..request.row_sinks import hand_over
from ..request.sampled import refuse_sampled
from ..signals.curve import Floats
from ..solution.solution import Solution
from .linearised import Complexes, operating_point, respond


@dataclass(frozen=True, slots=True)
class Sp:
    """What is asked for.

    Parameters
    ----------
    frequencies : ndarray, shape (k,)
        [Hz]
    span : Span or None
        Of the card.
    """

    frequencies: Floats
    span: Span | None = None

    @classmethod
    def from_card(cls, card: SpCard) -> Sp:
        """Return the analysis of a card."""
        return cls(np.array(card.frequencies), card.span)


@dataclass(frozen=True, slots=True)
class Port:
    """One port.

    Parameters
    ----------
    source : str
    voltage : str
        The signal between its terminals.
    impedance : float
        [Ohm]
    """

    source: str
    voltage: str
    impedance: float


def ports_of(circuit: Circuit, span: Span | None = None) -> list[Port]:
    """Return the ports in the order of their numbers.

    Raises
    ------
    UsageError
        NS4035 if there are none, or their numbers are not 1, 2, 3 ...
    """
    elements = {e.name: e for e in circuit.deck.elements}
    found: dict[object, list[Port]] = {}
    for element in elements.values():
        number = element.params.get("portnum")
        if element.letter != "v" or number is None:
            continue
        outside = elements[f"{element.name}.rser"].nodes[0]
        ends = [outside, element.nodes[1]]
        nodes = ",".join(ends if "0" not in ends else [n for n in ends if n != "0"])
        port = Port(element.name, f"v({nodes})", port_impedance(element))
        found.setdefault(number.value, []).append(port)
    count = sum(len(same) for same in found.values())
    if not found or set(found) != set(range(1, count + 1)):
        message = ".sp: the ports of a circuit are numbered 1, 2, 3 ..., each number once"
        hint = "write V1 in 0 portnum 1 z0 50"
        raise UsageError(Diagnostic("NS4035", message, span, hint))
    return [found[k][0] for k in range(1, count + 1)]


def run_sp(circuit: Circuit, analysis: Sp, request: Request) -> Solution:
    """Find the scattering parameters.

    Returns
    -------
    Solution
        Over ``frequency`` [Hz]: ``sol["s_2_1"]``, complex, and ``sol.ports``, their impedances.
    """
    refuse_sampled(circuit.deck, ".sp", delays=True)
    begin = clock.perf_counter()
    ports = ports_of(circuit, analysis.span)
    s: Complexes = (2j * np.pi * analysis.frequencies).astype(np.complex128)
    waves = np.zeros((len(ports), len(ports), s.size), complex)
    for island in circuit.islands:
        names = {device.name for device in island.devices}
        here = [k for k, port in enumerate(ports) if port.source in names]
        if not here:
            continue
        silent: dict[str, complex] = {ports[k].source: 0.0 for k in here}
        point = operating_point(circuit, island, silent, request)
        seen = [point.stimulated.functional(point.mna, ports[k].voltage) for k in here]
        for j in here:
            found = respond(point, seen, s, silent | {ports[j].source: 1.0})
            for i, response in zip(here, found.T, strict=True):
                ratio = ports[j].impedance / ports[i].impedance
                waves[i, j] = 2.0 * response * np.sqrt(ratio) - (1.0 if i == j else 0.0)
    table = {}
    for i, j in np.ndindex(len(ports), len(ports)):
        name = f"s_{i + 1}_{j + 1}"
        table[f"re({name})"], table[f"im({name})"] = (
            waves[i, j].real.copy(),
            waves[i, j].imag.copy(),
        )
    solution = Solution(
        "sp",
        circuit.deck.title,
        "frequency",
        analysis.frequencies,
        table,
        list(table),
        ports=tuple(port.impedance for port in ports),
        wall_time=clock.perf_counter() - begin,
    )
    hand_over(solution, request.sink)
    return solution
