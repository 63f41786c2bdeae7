"""Numbers that carry a Taylor model through the reading of a deck and its assembly.

A netlist is read and assembled by code that works on floats.  A :class:`Carried` is a float, the
value in the middle of the box, and its arithmetic encloses the value for all parameters.  Where
code would lose that (a conversion, a function without an enclosure) or would decide by the middle
alone what differs within the box, it raises.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NoReturn

from ...netlist.text.numbers import Traced
from ...problems.taylor import Models, Unbounded


class Lost(ArithmeticError):
    """A value is used in a way for which there is no enclosure."""


class Carried(Traced):
    """A number that depends on parameters.

    Parameters
    ----------
    model : Models
        Of shape ().
    """

    model: Models
    __slots__ = ("model",)

    def __new__(cls, model: Models) -> Carried:
        """Return the value in the middle, with the model."""
        found = super().__new__(cls, float(model.middle))
        found.model = model
        return found

    def _with(self, other: object) -> Models | float:
        if isinstance(other, Carried):
            return other.model
        if isinstance(other, int | float):
            return float(other)
        raise Lost("a parameter is combined with a value that is not a number")

    def __add__(self, other: Any) -> Any:
        return Carried(self.model + self._with(other))

    def __sub__(self, other: Any) -> Any:
        return Carried(self.model - self._with(other))

    def __rsub__(self, other: Any) -> Any:
        return Carried(self._with(other) - self.model)

    def __mul__(self, other: Any) -> Any:
        if not isinstance(other, Carried) and other in (0.0, 1.0, -1.0):  # signs of incidence
            return self if other == 1.0 else -self if other else 0.0
        return 0.0 if other == 0.0 else Carried(self.model * self._with(other))

    def __truediv__(self, other: Any) -> Any:
        return Carried(self.model / self._with(other))

    def __rtruediv__(self, other: Any) -> Any:
        return Carried(self._with(other) / self.model)

    def __neg__(self) -> Any:
        return Carried(-self.model)

    def __pos__(self) -> Any:
        return self

    def __abs__(self) -> Any:
        return -self if self < 0.0 else self

    def __pow__(self, other: Any, modulo: Any = None) -> Any:
        if isinstance(other, Carried) or not abs(other) <= 64:
            raise Lost("a power whose exponent depends on a parameter")
        if other != int(other):
            return Carried(self.model.power(other))
        result = Carried(Models.constant(self.model.home, 1.0))
        for _ in range(abs(int(other))):
            result = result * self
        return 1.0 / result if other < 0 else result

    __radd__, __rmul__ = __add__, __mul__

    def _sign(self, other: Any) -> int:
        """Return the sign of the difference, which must be the same in all of the box."""
        if not isinstance(other, Carried) and not math.isfinite(other):
            if math.isnan(other):
                raise Lost("a parameter is compared with a value that is not a number")
            return -1 if other > 0 else 1
        low, high = (self.model - self._with(other)).range()
        if low > 0.0 or high < 0.0:
            return 1 if low > 0.0 else -1
        if low == high == 0.0:
            return 0
        raise Unbounded("a condition on a parameter holds in a part of the box only")

    def __lt__(self, other: Any) -> bool:
        return self._sign(other) < 0

    def __le__(self, other: Any) -> bool:
        return self._sign(other) <= 0

    def __gt__(self, other: Any) -> bool:
        return self._sign(other) > 0

    def __ge__(self, other: Any) -> bool:
        return self._sign(other) >= 0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, int | float) and self._sign(other) == 0

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __bool__(self) -> bool:
        return self._sign(0.0) != 0

    def __hash__(self) -> int:
        return id(self)

    def applied(self, function: str, arguments: Sequence[float]) -> float:
        """Return the square root; other functions have no enclosure."""
        if function == "sqrt":
            return Carried(self.model.power(0.5))
        raise Lost(f"{function}() of a parameter has no enclosure")

    def _lost(self, *_: object) -> NoReturn:
        raise Lost("a parameter is used in a function that has no enclosure")

    def __ceil__(self) -> int:
        low, high = (math.ceil(float(end)) for end in self.model.range())
        if low != high:
            raise Unbounded("a whole number that differs within the box")
        return low

    def __floor__(self) -> int:
        return -Carried(-self.model).__ceil__()

    __float__ = __int__ = __round__ = __trunc__ = _lost
    __mod__ = __rmod__ = __floordiv__ = __rfloordiv__ = __rpow__ = _lost
    __divmod__ = __rdivmod__ = _lost

    def __repr__(self) -> str:
        return f"{float.__repr__(self)}~"
