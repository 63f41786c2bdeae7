"""What decides the cost of a run, in a sentence, and what could be written differently.

With closed forms between events a run costs what its events and output points cost; with steps it
costs what the fastest law demands.  One smooth nonlinear element decides for steps, for the whole
part of the circuit that it is connected with.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

from ...circuit import Circuit, Island, MnaSystem
from ...devices.device import Device
from ...devices.signals import shown
from ...netlist.deck import TranCard
from ...netlist.expressions.expression import Expression
from ...netlist.expressions.node import Node
from ...problems.descriptor import Waveform
from .cards import Tran
from .method import POINTS, choose, choose_static
from .periodic_sources import period_of
from .settings import Settings

_NAMED = 4  # elements of a kind in one sentence
#: Elements by letter: what stays in closed forms in their place.
_INSTEAD = {
    "d": "a diode given by its forward drop and resistance, D(Vfwd=0.7 Ron=10m), has closed forms",
    "m": ".options mosfet=switch reads MOSFETs as switches, which have closed forms",
    "q": "a transistor that only switches can be an S with Ron, which has closed forms",
}
_STEPS = "steps instead of closed forms, typically 5 to 100 times slower"
_NEWTON = "Newton's method at each point instead of one solve"


class Cost(NamedTuple):
    """What decides the cost of one island.

    Parameters
    ----------
    sentence : str
    elements : tuple of str
        That force the method, or whose events decide; empty if it is the output points.
    hints : tuple of str
        What could be written differently.
    """

    sentence: str
    elements: tuple[str, ...] = ()
    hints: tuple[str, ...] = ()


def cost_of(
    circuit: Circuit,
    island: Island,
    mna: MnaSystem,
    method: str | None = None,
    note: str = "",
    analysis: Tran | None = None,
) -> Cost:
    """Return what decides the cost of an island.

    Parameters
    ----------
    circuit : Circuit
    island : Island
    mna : MnaSystem
    method : str, optional
        Which has been used; by default the one that would be.
    note : str
        Why it is not another one.
    analysis : Tran, optional
        The transient that has been run; by default the first one of the deck.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''chopper
    ... V1 a 0 PULSE(0 1 0 1n 1n 5u 10u)
    ... R1 a b 1
    ... C1 b 0 1
    ... .tran 1u 1m
    ... ''')
    >>> cost_of(circuit, circuit.islands[0], circuit.islands[0].assemble()).sentence
    'v1: 400 breakpoints in 0.001 s, each starts a new closed form'
    """
    system, settings = mna.system, Settings.of(circuit.deck)
    if method is None:
        if system.static:
            method, note = choose_static(system, settings)
        else:
            method, note = choose(island.problem_class, system, settings)
    smooth = [device for device in island.devices if device.smooth]
    if smooth and system.smooth is not None:
        how = _NEWTON if method == POINTS or system.static else _STEPS
        causes, hints = _causes(smooth)
        return Cost(f"{causes}: {how}", tuple(d.name for d in smooth), hints)
    cards = [card for card in circuit.deck.analyses if isinstance(card, TranCard)]
    if analysis is None and cards:
        analysis = Tran.from_card(cards[0])
    if analysis is None:
        return Cost("one solve for each point of the analysis")
    if method == POINTS:
        return Cost(f"{analysis.row_count} output points, each a solve", (), _note(note))
    if method != "modewise":
        asked = settings.method == method or settings.stepped
        why = f"requested by the deck ({method})" if asked else note or "its kind of problem"
        return Cost(f"steps ({method}): {why}")
    return _events(mna, analysis)


def sentence(
    circuit: Circuit, island: Island, mna: MnaSystem, method: str, note: str, analysis: Tran
) -> str:
    """Return what has decided the cost of a run; see :func:`cost_of`."""
    return cost_of(circuit, island, mna, method, note, analysis).sentence


def _note(note: str) -> tuple[str, ...]:
    return (note,) if note else ()


def _events(mna: MnaSystem, analysis: Tran) -> Cost:
    """Return what ends the closed forms of the mode-wise engine most often."""
    counts: dict[str, float] = {}
    S = mna.system.S
    for k, waveform in enumerate(mna.system.waveforms):
        number = breakpoints(waveform, analysis.stop)
        rows = S.indices[S.columns == k]
        if number and rows.size:
            row = int(rows[0])
            name = mna.row_elements[row] or f"the source at {mna.row_nodes[row]}"
            counts[name] = max(counts.get(name, 0.0), number)
    most = max(counts, key=lambda name: counts[name], default="")
    edges = counts.get(most, 0.0)
    pairs = list(dict.fromkeys(mna.pair_elements))
    turning = f", and the commutations of {_list(pairs)}" if pairs else ""
    if edges > max(10.0, analysis.row_count / 10.0):
        sentence = f"{most}: {edges:.0f} breakpoints in {analysis.stop:g} s"
        return Cost(f"{sentence}, each starts a new closed form{turning}", (most,))
    rows_text = f"{analysis.row_count} output points"
    if edges > 2.0:
        return Cost(f"{rows_text}, {edges:.0f} breakpoints of {most}{turning}", (most,))
    if pairs:
        return Cost(f"{rows_text}{turning}", tuple(pairs))
    return Cost(f"{rows_text}: one closed form from one end to the other")


def breakpoints(waveform: Waveform, stop: float) -> float:
    """Return how many breakpoints a source has until an instant [s].

    Examples
    --------
    >>> breakpoints(Waveform("pulse", (0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 2.0, float("inf"))), 20.0)
    20.0
    """
    values = waveform.values
    if waveform.kind == "pulse":
        each = sum(1.0 if duration == 0.0 else 2.0 for duration in values[3:5])
        period = values[6]
        periods = min(stop / period, values[7]) if math.isfinite(period) and period > 0.0 else 1.0
        return each * periods
    if waveform.kind == "pwl":
        repeats = period_of(waveform)
        return len(values) / 2.0 * (stop / repeats if repeats else 1.0)
    return 0.0


def _causes(smooth: Sequence[Device]) -> tuple[str, tuple[str, ...]]:
    """Return the smooth elements with what makes them so, and what to write instead."""
    groups: dict[str, list[str]] = {}
    hints: dict[str, None] = {}
    for device in smooth:
        cause, hint = _cause(device)
        groups.setdefault(cause, []).append(device.name)
        if hint:
            hints[hint] = None
    texts = [f"{_list(names)} ({cause})" for cause, names in groups.items()]
    more = f" and {len(texts) - 3} more kinds" if len(texts) > 3 else ""
    return "; ".join(texts[:3]) + more, tuple(hints)


def _cause(device: Device) -> tuple[str, str]:
    """Return what makes an element smooth, and what to write instead."""
    from ...devices.expressions.behavioural import Reading

    if isinstance(device, Reading):
        node = _obstacle(device.expression)
        text = shown(Expression(node), 40)[1:-1]
        return text, _rewritten(node)
    kinds = [e.name for e in device.effects]
    # charges and currents that bend; values and coefficients say nothing
    telling = [k for k in kinds if any(w in k for w in ("exponential", "smooth", "charge", "flux"))]
    return ", ".join(telling[:3] or kinds[:1] or [device.KIND]), _INSTEAD.get(device.letter, "")


@lru_cache(maxsize=1024)  # each run asks for the same expressions
def _obstacle(expression: Expression) -> Node:
    from ...devices.expressions.piecewise import obstacle

    return obstacle(expression.node)


def _rewritten(node: Node) -> str:
    """Return what to write instead of a nonlinear part of an expression."""
    text = shown(Expression(node), 40)[1:-1]
    name = str(node.value) if node.op == "call" else node.op
    if name == "tanh":
        return (
            f"limit({shown(Expression(node.args[0]), 30)[1:-1]},-1,1) instead of {text} has "
            f"closed forms"
        )
    if name in ("asin", "acos") and node.args[0].op == "call":
        return (
            f"{text} has closed forms if its argument is linear in time; so has a triangle, "
            "PULSE(-1 1 0 {T/2} {T/2} 0 {T})"
        )
    if name == "mul":
        return (
            f"if a factor of {text} is only 0 or 1, if(factor>0.5, other, 0) has closed forms; a "
            f"product on which no saved signal depends is not simulated"
        )
    if name in ("exp", "ln", "sqrt", "atan", "pow", "sinh", "square", "pwr", "hypot"):
        return f"a table of a few points instead of {text} has closed forms"
    return ""


def _list(names: Sequence[str]) -> str:
    if len(names) > _NAMED:
        return f"{', '.join(names[: _NAMED - 1])} and {len(names) - _NAMED + 1} more"
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))
