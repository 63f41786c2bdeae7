"""What resistors, capacitors and inductors share: a value, a model card, temperature, ``m``."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar

from ...netlist.expressions.expression import Expression
from ...netlist.expressions.functions import ABSOLUTE_ZERO
from ..coefficients import LINE, Coefficients
from ..device import Context, Device, check_flags, check_model, number
from ..effect import Effect
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


class Storing(Passive):
    """An element that stores a charge or a flux: base of C and L."""

    #: its value, and the unit of it, the initial value and its unit
    WHAT: ClassVar[tuple[str, str, str, str]]
    #: what an element of value zero is
    NOTHING: ClassVar[str] = ""
    stores_energy = True
    NOISE = ()
    __slots__ = ()

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the device of an element line, or None after reporting why not."""
        if element.quantity or isinstance(element.value, Expression):
            from ..expressions.stored import Charge, Flux, stored_by

            stored = element if element.quantity else stored_by(element)
            if stored is not None:
                return (Charge if element.letter == "c" else Flux).read(stored, context)
        what, unit, initial, initial_unit = cls.WHAT
        found = read_passive(cls, element, context, element.letter, what)
        if found is None:
            return None
        device = cls(element, *found)
        if device.value < 0.0 or device.value == float("inf"):
            context.findings.error(
                "NS2005",
                f"{element.name} has the {what} {device.value:g} {unit}",
                element.span,
                "give a positive value",
            )
            return None
        if device.value == 0.0:
            message = f"{element.name} has no {what} and is {cls.NOTHING}"
            context.findings.warning("NS2054", message, element.span)
        effects = [Effect(what, "value", device.of_all(device.value), unit)]
        if device.ic is not None:
            effects.append(Effect(initial, "ic", device.ic, initial_unit))
        device.effects = (*effects, *device.coefficients.effects)
        return device

    @abstractmethod
    def of_all(self, value: float) -> float:
        """Return the value of all equal elements in parallel."""


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
