"""What people want to see first of a circuit: outputs, inductor currents, gates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ...circuit import Circuit
from ..request.measured_signals import measured_signals

#: so many voltages or currents are shown without a choice
_FEW = 3
#: of many that nothing marks, the first ones, among which a picture chooses those that vary
_FIRST = 12


@dataclass(frozen=True, slots=True)
class View:
    """The signals of a picture for which nobody asked for certain signals.

    Parameters
    ----------
    shown : tuple of str
        Voltages and currents.
    gates : tuple of str
        Voltages that control switches and thyristors.
    """

    shown: tuple[str, ...]
    gates: tuple[str, ...]


def view_of(circuit: Circuit, kind: str, columns: Sequence[str]) -> View:
    """Return what a picture shows: outputs, what is measured, inductor currents, gates.

    Parameters
    ----------
    circuit : Circuit
    kind : str
        The analysis, whose measures count.
    columns : sequence of str
        The default signals.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''boost converter
    ... V1 in 0 12
    ... L1 in sw 100u
    ... S1 sw 0 g 0 m
    ... D1 sw out
    ... C1 out 0 10u
    ... R1 out 0 10
    ... Vg g 0 PULSE(0 1 0 0 0 5u 10u)
    ... .model m SW(VT=0.5)
    ... ''')
    >>> view_of(circuit, "tran", circuit.default_signals())
    View(shown=('v(in)', 'v(sw)', 'v(out)', 'i(l1)'), gates=('v(g)',))
    """
    controls = [d.controls for d in circuit.devices if d.letter in ("s", "d")]
    nodes = dict.fromkeys(n for pair in controls for n in pair if n != "0")
    ends = {n for d in circuit.devices if d.letter not in ("v", "b", "e") for n in d.nodes}
    gates = [f"v({n})" for n in nodes if n not in ends and f"v({n})" in columns]
    cards = [m for m in circuit.deck.measures if m.analysis == kind]
    # a signal, not a part of a product or of a threshold
    alone = [m for m in cards if m.expression is not None and m.expression.node.op == "var"]
    measured = measured_signals(alone)
    voltages = [n for n in columns if n.startswith("v(") and n not in gates]
    currents = [n for n in columns if n.startswith("i(")]
    if len(voltages) > _FEW:
        outputs = [n for n in voltages if "out" in n]
        outputs += [n for n in measured if n.startswith("v(") and n not in (*outputs, *gates)]
        loads = [] if outputs else _loads(circuit)
        voltages = outputs or loads or voltages[:_FIRST]
    wanted = [n for n in currents if n.startswith("i(l") or n in measured]
    drivers = {f"i({d.name})" for d in circuit.devices if set(d.nodes) <= {"0", *nodes}}
    currents = wanted or [n for n in currents if n not in drivers][:_FIRST]
    return View((*voltages, *currents), tuple(gates))


def _loads(circuit: Circuit) -> list[str]:
    """Return the voltages of resistors that have a capacitor in parallel: outputs of converters."""
    smoothed = {frozenset(d.nodes[:2]) for d in circuit.devices if d.letter == "c"}
    ends = [d.nodes[:2] for d in circuit.devices if d.letter == "r"]
    found = [pair for pair in ends if frozenset(pair) in smoothed and len(set(pair)) == 2]
    names = [f"v({','.join(n for n in pair if n != '0')})" for pair in found]
    return list(dict.fromkeys(names))[:_FEW]
