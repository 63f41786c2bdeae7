"""What names of sweeps and gradients change: parameters, elements, temperature, models."""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

from ...circuit import Circuit
from ...devices import CurrentSource, VoltageSource
from ...devices.passive.passive import Passive
from ...errors import Diagnostic, UsageError, suggest
from ...netlist.deck import Deck, Model, Param
from .values import check_value, valued

_MODEL = re.compile(r"([^()\s]+)\(([^()\s]+)\)")
_UNITS = {"r": "Ohm", "c": "F", "l": "H", "v": "V", "i": "A"}


class Target(NamedTuple):
    """What one name of a sweep changes.

    Parameters
    ----------
    name : str
        As it was given, lower case.
    kind : str
        ``param``, ``element``, ``temp`` or ``model``.
    model, key : str
        Model card and its parameter, of a ``model``.
    unit : str
        Of the value, empty if it is not known.
    """

    name: str
    kind: Literal["param", "element", "temp", "model"]
    model: str = ""
    key: str = ""
    unit: str = ""


def target_of(circuit: Circuit, name: str) -> Target:
    """Return what a name changes.

    Parameters
    ----------
    circuit : Circuit
    name : str
        A ``.param``, an element with a number as its value, ``temp``, or ``model(parameter)``.

    Raises
    ------
    UsageError
        NS4005 for a model that no element uses, NS4007 for an element that has no value.
    NetlistError
        NS2012 if there is neither a parameter nor an element of this name.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read("rc\\n.param k=1\\nD1 a 0 d\\nR1 a 0 {k}\\n.model d D(Ron=1)\\n")
    >>> [target_of(circuit, n).kind for n in ("k", "r1", "temp", "d(ron)")]
    ['param', 'element', 'temp', 'model']
    """
    key = name.lower().replace(" ", "")
    if key in circuit.deck.parameters:
        return Target(key, "param")
    if key in ("temp", "temper"):
        return Target(key, "temp", unit="°C")
    found = _MODEL.fullmatch(key)
    if found is not None:
        used = _models(circuit.deck)
        if found[1] not in used:
            hint = suggest(found[1], used) or f"models in use: {', '.join(used) or 'none'}"
            message = f"no element uses a model {found[1]}"
            raise UsageError(Diagnostic("NS4005", message, hint=hint))
        return Target(key, "model", found[1], found[2])
    device = valued(circuit, key)
    return Target(key, "element", unit=_UNITS.get(device.letter, ""))


def nominal(circuit: Circuit, target: Target) -> float:
    """Return the deck's own value of what is swept.

    Raises
    ------
    UsageError
        NS4005 for a model parameter that the card does not give.
    """
    if target.kind == "param":
        return circuit.deck.parameters[target.name]
    if target.kind == "temp":
        return circuit.deck.temperature
    if target.kind == "model":
        given = _models(circuit.deck)[target.model].params.get(target.key)
        if given is None or not isinstance(given.value, int | float):
            message = f"model {target.model} gives no number for {target.key}"
            hint = "a tolerance needs a nominal value: give Uniform(low, high)"
            raise UsageError(Diagnostic("NS4005", message, hint=hint))
        return float(given.value)
    device = circuit.device(target.name)
    if isinstance(device, Passive):
        return device.value
    assert isinstance(device, VoltageSource | CurrentSource)
    return device.source.dc or 0.0


def check(circuit: Circuit, targets: Sequence[Target], row: Sequence[float]) -> None:
    """Refuse values that an element line could not have.

    Raises
    ------
    UsageError
        NS4005
    """
    for target, value in zip(targets, row, strict=True):
        if target.kind == "element":
            check_value(circuit.device(target.name), value)


def with_model_values(deck: Deck, values: Mapping[tuple[str, str], float]) -> Deck:
    """Return a deck whose model cards have other values of some parameters.

    Parameters
    ----------
    deck : Deck
    values : mapping of (str, str) to float
        By model and parameter.
    """
    changed: dict[int, Model] = {}  # elements of one card keep sharing one

    def of(model: Model) -> Model:
        known = changed.get(id(model))
        if known is None:
            items = values.items()
            own = {k: Param(k, v, model.span) for (name, k), v in items if name == model.name}
            known = replace(model, params={**model.params, **own}) if own else model
            changed[id(model)] = known
        return known

    other = copy.copy(deck)
    other.elements = [
        replace(
            e,
            model=None if e.model is None else of(e.model),
            models={key: of(model) for key, model in e.models.items()},
        )
        for e in deck.elements
    ]
    return other


def _models(deck: Deck) -> dict[str, Model]:
    """Return the model cards that elements use, by name."""
    found = {e.model.name: e.model for e in deck.elements if e.model is not None}
    return found | {m.name: m for e in deck.elements for m in e.models.values()}
