"""Leaving an effect out of a deck: one parameter, one parasitic element, one junction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from ..circuit.line_settings import with_junctions
from ..errors import Span
from ..netlist.deck import Deck, Element, Model, Param

#: laws of diodes that a card calls for by any of these; without one it means a junction
SET_VALUED = ("ideal", "vfwd", "vrev", "ron", "rrev", "roff")


@dataclass(frozen=True, slots=True)
class Edit:
    """One effect, and how it is left out.

    Parameters
    ----------
    owner : str
        ``model dm`` or ``l1.rser``: whose effect it is.
    effect : str
        ``forward drop``, ``junction charge`` ...
    parameter : str
        ``vfwd=0.7``, as a table shows it.
    kind : {"parameter", "ideal", "straight", "switch", "open", "short", "lines"}
        A parameter of a model is removed; a junction becomes an ideal diode, or one with the drop
        and resistance of ``key``, a MOSFET a switch; an element becomes an open circuit, or a short
        circuit between its nodes; all junctions become broken lines as ``key`` says.
    target : str
        Name of the model or element.
    key : str
        The parameter of the model.
    span : Span
        Where it is in the deck.
    """

    owner: str
    effect: str
    parameter: str
    kind: Literal["parameter", "ideal", "straight", "switch", "open", "short", "lines"]
    target: str
    span: Span
    key: str = ""

    @property
    def name(self) -> str:
        """Return owner and effect in one."""
        return f"{self.owner}: {self.effect}"

    def apply(self, deck: Deck) -> Deck:
        """Return the deck without the effect; the one given is left as it is."""
        if self.kind == "lines":
            return with_junctions(deck, self.key)
        if self.kind in ("parameter", "ideal", "straight", "switch"):
            elements = [self._without(e) for e in deck.elements]
        else:
            gone = next((e for e in deck.elements if e.name == self.target), None)
            elements = [e for e in deck.elements if e.name != self.target]
            if gone is not None and self.kind == "short":
                kept, merged = gone.nodes
                if merged == "0":
                    kept, merged = merged, kept
                elements = [_renamed(e, merged, kept) for e in elements]
        return replace(deck, elements=elements)

    def _without(self, element: Element) -> Element:
        model = element.model
        if model is None or model.name != self.target:
            return element
        return replace(element, model=_changed(model, self))


def _changed(model: Model, edit: Edit) -> Model:
    """Return a model card without a parameter, or the card of an ideal diode."""
    ideal = {"ideal": Param("ideal", 1.0, model.span)}
    if edit.kind == "ideal":
        return replace(model, params=ideal)
    if edit.kind == "straight":
        named = (part.split("=") for part in edit.key.split())
        return replace(model, params={k: Param(k, float(v), model.span) for k, v in named})
    if edit.kind == "switch":
        return replace(model, params={**model.params, "switch": Param("switch", 1.0, model.span)})
    params = {k: p for k, p in model.params.items() if k != edit.key}
    was_set_valued = any(k in SET_VALUED for k in model.params)
    if model.type == "d" and was_set_valued and not any(k in SET_VALUED for k in params):
        params |= ideal  # without a word the card would become that of a junction
    return replace(model, params=params)


def _renamed(element: Element, old: str, new: str) -> Element:
    """Return an element with one node under another name."""
    if old not in element.nodes and old not in element.controls:
        return element
    nodes = tuple(new if n == old else n for n in element.nodes)
    controls = tuple(new if n == old else n for n in element.controls)
    return replace(element, nodes=nodes, controls=controls)


def without(deck: Deck, edits: frozenset[Edit] | list[Edit] | tuple[Edit, ...]) -> Deck:
    """Return a deck without some effects.

    Examples
    --------
    >>> from nsspice.netlist import parse_text
    >>> from nsspice.screening.candidates import candidates
    >>> from nsspice.circuit import build
    >>> deck = parse_text("demo\\nV1 a 0 1\\nD1 a b DM\\nR1 b 0 1\\n.model DM D(Vfwd=0.7)\\n.op\\n")
    >>> (edit,) = candidates(build(deck))
    >>> edit.name, dict(without(deck, [edit]).elements[1].model.params).keys()
    ('model dm: forward drop', dict_keys(['ideal']))
    """
    # short circuits last: they rename nodes that other edits do not mention
    for edit in sorted(edits, key=lambda e: (e.kind == "short", e.name)):
        deck = edit.apply(deck)
    return deck
