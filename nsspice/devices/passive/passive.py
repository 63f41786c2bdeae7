"""What resistors, capacitors and inductors share: a value, a model card, temperature, ``m``."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from ...netlist.expressions.functions import ABSOLUTE_ZERO
from ..coefficients import LINE, Coefficients
from ..device import Context, Device, check_flags, check_model, number
from ..parameter import Parameter
from ..stamper import Conditions

if TYPE_CHECKING:
    from ...netlist.deck import Element

SHARED = (
    Parameter("m", "number of equal elements in parallel", "", 1.0),
    Parameter("scale", "factor of the value", "", 1.0),
    *LINE,
)


class Passive(Device):
    """An element with one value: base of R, L and C."""

    MODEL_TYPES: ClassVar[tuple[str, ...]] = ()

    __slots__ = ("coefficients", "ic", "m", "value")

    def __init__(self, element: Element, value: float, given: dict[str, float]) -> None:
        super().__init__(element)
        self.value = value * given.get("scale", 1.0)
        self.m = given.get("m", 1.0)
        self.coefficients = Coefficients.of(given)
        self.ic = given.get("ic")

    def at(self, conditions: Conditions) -> float:
        """Return the value of one element, before ``m``, under the given conditions."""
        value = conditions.values.get(self.name, self.value)
        return value * self.coefficients.factor(conditions) if self.coefficients else value


def read_given(
    law: type[Device], element: Element, types: tuple[str, ...], context: Context
) -> tuple[dict[str, float], dict[str, float]] | None:
    """Return the parameters of an R, L or C line and of its card, or None after reporting.

    Temperature coefficients of the card are among those of the line, which go first.
    """
    findings = context.findings
    check_flags(law, element, findings)
    given = law.INSTANCE.read(element.params, element.name, findings)
    card: dict[str, float] = {}
    if element.model is not None:
        if not check_model(element, types, context, required=False):
            return None
        known = context.cards.get(id(element.model))
        if known is None:
            known = law.MODEL.read(element.model.params, f"model {element.model.name}", findings)
            if known.get("t_abs", 0.0) < ABSOLUTE_ZERO:
                message = f"t_abs of model {element.model.name} is below absolute zero"
                span = element.model.params["t_abs"].span
                findings.error("NS2005", message, span, "give degrees Celsius")
            context.cards[id(element.model)] = known
        card = known
    if given.get("m", 1.0) <= 0.0:
        findings.error("NS2005", f"m of {element.name} must be positive", element.params["m"].span)
        return None
    for key in ("tc1", "tc2", "tce", "tnom"):
        if key in card:
            given.setdefault(key, card[key])
    if "t_abs" in card:
        given.setdefault("temp", card["t_abs"])
    Coefficients.of(given).check(element, findings)
    return given, card


def read_passive(
    law: type[Passive], element: Element, context: Context, letter: str, what: str
) -> tuple[float, dict[str, float]] | None:
    """Return value and given parameters of an R, L or C line, or None after reporting.

    The value of the line goes before the one of the model card (``r=``, ``c=``, ``l=``).
    """
    found = read_given(law, element, law.MODEL_TYPES, context)
    if found is None:
        return None
    given, card = found
    if element.value is None and letter in card:
        return card[letter], given
    value = number(element, what, context.findings)
    return None if value is None else (value, given)
