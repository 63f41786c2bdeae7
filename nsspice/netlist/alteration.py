"""``alter`` and ``altermod``: a deck with other values of some elements and models."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

from ..errors import Span
from .deck import Alteration, Deck, Element, Model, Param, Source
from .findings import Unreadable
from .text.script import Command

#: alter @r1[resistance] = 2k, alter r1 resistance = 2k, alter r1 = 2k
_FORM = re.compile(
    r"\w+\s+@?(?P<name>[^\s=\[\]]+)(?:\s*\[\s*(?P<inner>\w+)\s*\]|\s+(?P<key>[a-z]\w*))?"
    r"\s*(?:=|\s)\s*(?P<value>\S.*)",
    re.IGNORECASE,
)
#: ngspice puts the letter of an element before the path of its instances: r.x1.r1
_FLAT = re.compile(r"[a-z]\.(x.*)")
_OWN = {"r": "resistance", "c": "capacitance", "l": "inductance"}
_WAVES = ("sin", "pulse", "pwl", "exp", "sffm", "am")


def parts(line: Command) -> tuple[str, str, str]:
    """Return name, parameter and value of an ``alter`` or ``altermod``, as texts."""
    found = _FORM.fullmatch(line.text.strip())
    if found is None:
        hint = "write alter r1 = 2k, alter v1 dc = 5, alter @m1[w] = 10u or altermod mod vto = 1"
        raise Unreadable("NS1080", "alter needs a name and a value", line.whole(), hint)
    flat = _FLAT.fullmatch(found["name"])
    name = flat.group(1) if flat else found["name"]
    return name, (found["inner"] or found["key"] or "").lower(), found["value"].lstrip("= ")


def altered(deck: Deck, changes: Iterable[Alteration]) -> Deck:
    """Return a deck with other values.

    Parameters
    ----------
    deck : Deck
    changes : iterable of Alteration
        The later one counts.

    Examples
    --------
    >>> from nsspice.errors import Span
    >>> from nsspice.netlist import parse_text
    >>> deck = parse_text("divider\\nV1 a 0 1\\nR1 a 0 1k\\n.op")
    >>> change = Alteration("element", "r1", "", (2e3,), Span("x", 1, 1))
    >>> altered(deck, [change]).elements[1].value
    2000.0
    """
    elements = {element.name: element for element in deck.elements}
    temperature = deck.temperature
    for change in changes:
        if change.kind == "temp":
            temperature = change.values[0]
        elif change.kind == "element":
            elements[change.name] = _element(elements[change.name], change)
        elif change.kind == "model":
            for name, element in elements.items():
                if element.model is not None and element.model.name == change.name:
                    elements[name] = replace(element, model=_model(element.model, change))
    return replace(deck, elements=list(elements.values()), temperature=temperature)


def check(deck: Deck, change: Alteration) -> None:
    """Raise Unreadable if a change names nothing, or what it cannot change."""
    if change.kind == "element":
        found = next((e for e in deck.elements if e.name == change.name), None)
        if found is None:
            message = f"alter: there is no element {change.name[:60]}"
            raise Unreadable("NS1070", message, change.span, missing=change.name)
        _element(found, change)
    elif change.kind == "model" and all(
        e.model is None or e.model.name != change.name for e in deck.elements
    ):
        message = f"altermod: no element has the model {change.name[:60]}"
        raise Unreadable("NS1060", message, change.span, missing=change.name)


def _element(element: Element, change: Alteration) -> Element:
    """Return an element with another value or parameter."""
    key, values, span = change.key, change.values, change.span
    if element.source is not None:
        return replace(element, source=_source(element.source, change))
    if key in ("", _OWN.get(element.letter, "gain")) and element.letter in "rlcefghk":
        return replace(element, value=values[0])
    if not key:
        message = f"alter: {element.name} has no value of its own"
        raise Unreadable("NS1080", message, span, f"write alter @{element.name}[parameter] = ...")
    return replace(element, params={**element.params, key: Param(key, values[0], span)})


def _source(source: Source, change: Alteration) -> Source:
    """Return a source with another DC value, magnitude, phase or waveform."""
    key, values = change.key, change.values
    if key in ("", "dc"):
        return source._replace(dc=values[0])
    if key in ("ac", "acmag"):
        return source._replace(ac=(values[0], source.ac[1] if source.ac else 0.0))
    if key == "acphase":
        return source._replace(ac=(source.ac[0] if source.ac else 1.0, values[0]))
    if key in _WAVES:
        return source._replace(kind=key, values=values, options={})
    message = f"alter: a source has no parameter {key[:40]}"
    raise Unreadable("NS1014", message, change.span, "dc, acmag, acphase, or a waveform")


def _model(model: Model, change: Alteration) -> Model:
    """Return a model with another parameter."""
    param = Param(change.key, change.values[0], change.span)
    return replace(model, params={**model.params, change.key: param})


def temperature(value: float, span: Span) -> Alteration:
    """Return a change of the temperature [degrees Celsius]."""
    return Alteration("temp", "temp", "", (value,), span)
