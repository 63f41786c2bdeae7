"""Explanations of circuits with what the analyses know: methods, costs, what is left out."""

from __future__ import annotations

from ...circuit import Circuit, Island, MnaSystem
from ...circuit.blocks import Blocks
from ...circuit.dependencies import Skipped, needed
from ...circuit.explain import Explanation, Told, explain
from ...netlist.deck import TranCard
from ..request.cost_hints import cost_of
from ..request.measured_signals import measured_signals
from ..request.method import describe
from ..request.recorder import select
from ..request.settings import Settings
from ..transient.blocks import driven_by, split


def explained(circuit: Circuit, matrices: bool = False, everything: bool = False) -> Explanation:
    """Return what a circuit is, how it would be simulated, and what decides the cost.

    Parameters
    ----------
    circuit : Circuit
    matrices : bool
        Also derive the matrices of the complementarity form.
    everything : bool
        Also of what no saved signal depends on.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''clamp
    ... V1 a 0 SIN(0 1 50)
    ... R1 a b 1
    ... C1 b 0 1m
    ... D1 b 0 DM
    ... .model DM D
    ... .tran 0.1m 20m
    ... ''')
    >>> explained(circuit).islands[0].told.cost
    'd1 (exponential junction): steps instead of closed forms, typically 5 to 100 times slower'
    """
    skipped = Skipped()
    deck = circuit.deck
    transient = bool(deck.analyses) and all(isinstance(a, TranCard) for a in deck.analyses)
    if deck.saves and transient and not everything:
        names = [*select(circuit), *measured_signals(deck.measures)]
        warnings = circuit.warnings
        circuit, skipped = needed(circuit, names)
        circuit.warnings = warnings
    parts = Blocks(circuit)
    if any(isinstance(a, TranCard) for a in deck.analyses):
        parts = split(circuit, Settings.of(deck))

    def teller(circuit: Circuit, island: Island, mna: MnaSystem) -> Told:
        told = tell(circuit, island, mna)
        number = next(k for k, other in enumerate(circuit.islands) if other is island)
        inputs = [link for link in parts.links if link.target == number]
        return told._replace(method=f"{told.method}; {driven_by(inputs)}") if inputs else told

    return explain(parts.circuit, matrices, teller, skipped.elements)


def tell(circuit: Circuit, island: Island, mna: MnaSystem) -> Told:
    """Return how an island is solved, what decides its cost, and what could be written."""
    cost = cost_of(circuit, island, mna)
    return Told(describe(circuit, island, mna), cost.sentence, cost.hints)
