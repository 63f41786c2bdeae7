"""What resistors, capacitors and inductors share: a value, a model card, temperature, ``m``."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from .device import Context, Device, check_flags, check_model, number, temperature_factor
from .parameter import Parameter
from .stamper import Conditions

if TYPE_CHECKING:
    from ..netlist.deck import Element

SHARED = (
    Parameter("m", "number of equal elements in parallel", "", 1.0),
    Parameter("tc1", "linear temperature coefficient", "1/K", 0.0, ("tc",)),
    Parameter("tc2", "quadratic temperature coefficient", "1/K2", 0.0),
    Parameter("scale", "factor of the value", "", 1.0),
    Parameter("temp", "temperature of this element", "C"),
    Parameter("dtemp", "temperature above the circuit's", "K", 0.0),
)
MODEL_SHARED = (
    Parameter("tc1", "linear temperature coefficient", "1/K", 0.0),
    Parameter("tc2", "quadratic temperature coefficient", "1/K2", 0.0),
    Parameter("tnom", "temperature at which values are given", "C", 27.0),
)


class Passive(Device):
    """An element with one value: base of R, L and C."""

    MODEL_TYPES: ClassVar[tuple[str, ...]] = ()

    __slots__ = ("dtemp", "ic", "m", "nominal", "tc1", "tc2", "temp", "value")

    def __init__(self, element: Element, value: float, given: dict[str, float]) -> None:
        super().__init__(element)
        self.value = value * given.get("scale", 1.0)
        self.m = given.get("m", 1.0)
        self.tc1 = given.get("tc1", 0.0)
        self.tc2 = given.get("tc2", 0.0)
        self.temp = given.get("temp")
        self.dtemp = given.get("dtemp", 0.0)
        self.nominal = given.get("tnom")
        self.ic = given.get("ic")

    def at(self, conditions: Conditions) -> float:
        """Return the value of one element, before ``m``, under the given conditions."""
        value = conditions.values.get(self.name, self.value)
        if self.tc1 == 0.0 and self.tc2 == 0.0:
            return value
        return value * temperature_factor(
            conditions, self.tc1, self.tc2, self.temp, self.dtemp, self.nominal
        )


def read_passive(
    law: type[Passive], element: Element, context: Context, letter: str, what: str
) -> tuple[float, dict[str, float]] | None:
    """Return value and given parameters of an R, L or C line, or None after reporting.

    The value of the line goes before the one of the model card (``r=``, ``c=``, ``l=``).
    """
    findings = context.findings
    check_flags(law, element, findings)
    given = law.INSTANCE.read(element.params, element.name, findings)
    card: dict[str, float] = {}
    if element.model is not None:
        if not check_model(element, law.MODEL_TYPES, findings, required=False):
            return None
        card = context.cards.get(id(element.model), {})
        if id(element.model) not in context.cards:
            card = law.MODEL.read(element.model.params, f"model {element.model.name}", findings)
            context.cards[id(element.model)] = card
    if element.value is None and letter in card:
        value: float | None = card[letter]
    else:
        value = number(element, what, findings)
    if value is None:
        return None
    if given.get("m", 1.0) <= 0.0:
        findings.error("NS2005", f"m of {element.name} must be positive", element.params["m"].span)
        return None
    for key in ("tc1", "tc2", "tnom"):
        if key in card:
            given.setdefault(key, card[key])
    return value, given
