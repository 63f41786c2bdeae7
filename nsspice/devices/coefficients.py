"""Temperature coefficients ``tc1 tc2`` of R, L, C and of expressions, ``tce`` of R."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..netlist.findings import Findings
from .effect import Effect
from .parameter import Parameter
from .stamper import Conditions

if TYPE_CHECKING:
    from ..netlist.deck import Element

#: on the element line
LINE = (
    Parameter("tc1", "linear temperature coefficient", "1/K", 0.0, ("tc",)),
    Parameter("tc2", "quadratic temperature coefficient", "1/K2", 0.0),
    Parameter("temp", "temperature of this element", "C"),
    Parameter("dtemp", "temperature above the circuit's", "K", 0.0),
)
#: on the model card
CARD = (
    Parameter("tc1", "linear temperature coefficient", "1/K", 0.0),
    Parameter("tc2", "quadratic temperature coefficient", "1/K2", 0.0),
    Parameter("tnom", "temperature at which values are given", "C", 27.0),
    # without a unit that excludes absolute zero: PSpice's resistors without noise have it
    Parameter("t_abs", "temperature of its elements [degrees Celsius]"),
)
#: of resistors, on the element line and on the model card
EXPONENTIAL = Parameter("tce", "exponential temperature coefficient", "%/K", 0.0)
#: growth by one percent
_PERCENT = 1.01


@dataclass(frozen=True, slots=True)
class Coefficients:
    """A value that grows as ``1 + tc1 dT + tc2 dT^2``, or as ``1.01^(tce dT)``.

    Parameters
    ----------
    tc1, tc2 : float
        [1/K], [1/K2]
    temp : float or None
        The element's own temperature [degrees Celsius].
    dtemp : float
        Above the circuit's [K], if it has none of its own.
    tnom : float or None
        Temperature at which values are given [degrees Celsius], the circuit's by default.
    tce : float
        [%/K]; takes the place of ``tc1`` and ``tc2`` if it is not zero, as in PSpice and ngspice.

    Examples
    --------
    >>> Coefficients(tc1=0.01).factor(Conditions(temperature=37.0))
    1.1
    """

    tc1: float = 0.0
    tc2: float = 0.0
    temp: float | None = None
    dtemp: float = 0.0
    tnom: float | None = None
    tce: float = 0.0

    def check(self, element: Element, findings: Findings) -> None:
        """Warn of a temperature that nothing follows."""
        for key in ("temp", "dtemp"):
            if key in element.params and getattr(self, key) and not self:
                findings.warning(
                    "NS2052",
                    f"{key} of {element.name} has no effect without tc1, tc2 or tce",
                    element.params[key].span,
                )

    @classmethod
    def of(cls, given: Mapping[str, float]) -> Coefficients:
        """Return those that an element line and its model card give."""
        return cls(**{key: given[key] for key in cls.__slots__ if key in given})

    def __bool__(self) -> bool:
        """Return whether the temperature matters."""
        return self.tc1 != 0.0 or self.tc2 != 0.0 or self.tce != 0.0

    def factor(self, conditions: Conditions) -> float:
        """Return the value under given conditions over the nominal one."""
        if not self:
            return 1.0
        actual = self.temp if self.temp is not None else conditions.temperature + self.dtemp
        rise = actual - (conditions.nominal if self.tnom is None else self.tnom)
        if self.tce:
            return float(_PERCENT ** (self.tce * rise))
        return 1.0 + self.tc1 * rise + self.tc2 * rise * rise

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Return the effect for the list of those of an element."""
        leading = next((key for key in ("tce", "tc1") if getattr(self, key)), "tc2")
        return (Effect("temperature", leading),) if self else ()
