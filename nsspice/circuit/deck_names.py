"""Names that the cards of a deck use: nodes of .ic, signals of .save, swept elements."""

from __future__ import annotations

from collections.abc import Iterable

from ..devices import Findings, did_you_mean
from ..errors import Span
from ..netlist.deck import DcCard, Deck, Measure
from ..netlist.expression import Expression
from .signals import parse_signal

_SWEPT = "rvi"


def check_names(deck: Deck, nodes: Iterable[str], findings: Findings) -> None:
    """Report every card that names a node, element or signal that does not exist.

    Parameters
    ----------
    deck : Deck
    nodes : iterable of str
        All nodes but ground.
    findings : Findings
    """
    known_nodes = {*nodes, "0"}
    elements = {e.name: e.letter for e in deck.elements}
    for card, table in ((".ic", deck.initial), (".nodeset", deck.nodesets)):
        for node, param in table.items():
            signal = parse_signal(node)
            if signal is not None and signal.kind == "i":
                _need(signal.names[0], elements, card, "element", param.span, findings)
            else:
                name = signal.names[0] if signal is not None else node
                _need(name, known_nodes, card, "node", param.span, findings)
    for save in deck.saves:
        _check_signal(save.name, known_nodes, elements, "the output list", save.span, findings)
    for measure in deck.measures:
        for name in _variables(measure):
            owner = f".measure {measure.name}"
            _check_signal(name, known_nodes, elements, owner, measure.span, findings)
    sweeps = [(".dc", s) for a in deck.analyses if isinstance(a, DcCard) for s in a.sweeps]
    sweeps += [(".step", s) for s in deck.steps]
    for card, sweep in sweeps:
        if sweep.kind != "element":
            continue
        _need(sweep.name, elements, card, "element", sweep.span, findings)
        letter = elements.get(sweep.name, "r")
        if letter not in (_SWEPT if card == ".dc" else _SWEPT + "lc"):
            findings.error(
                "NS2014",
                f"{card} cannot sweep {sweep.name}",
                sweep.span,
                "sweep a V or I source, a resistor or temp",
            )


def _variables(measure: Measure) -> set[str]:
    """Return the signals that a .measure card reads."""
    parts: list[Expression | None] = [measure.expression]
    for condition in (measure.first, measure.second):
        if condition is not None:
            parts += [condition.signal, condition.other]
    return {name for part in parts if part is not None for name in part.variables()}


def _check_signal(
    name: str,
    nodes: set[str],
    elements: dict[str, str],
    owner: str,
    span: Span,
    findings: Findings,
) -> None:
    """Report a signal whose node or element does not exist; other words are not judged here."""
    signal = parse_signal(name)
    if signal is None:
        return
    for part in signal.names:
        if signal.kind == "v":
            _need(part, nodes, owner, "node", span, findings)
        else:
            _need(part, elements, owner, "element", span, findings)


def _need(
    name: str, known: Iterable[str], owner: str, what: str, span: Span, findings: Findings
) -> None:
    """Report a name that is not known."""
    if name not in known:
        findings.error(
            "NS2012",
            f"{owner} names {what} {name}, which does not exist",
            span,
            did_you_mean(name, known),
        )
