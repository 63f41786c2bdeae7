"""The path-following methods on request: which, with how many correctors, and where they fit."""

from __future__ import annotations

from dataclasses import dataclass

from ...circuit import Island
from ...errors import Diagnostic, UsageError
from ...netlist.deck import Deck
from ...problems.descriptor import DescriptorSystem
from ...solvers.moreau import MoreauStepper

#: name -> whether the predictor takes the rate of the sources, (3.2), or their next value, (3.4)
PATH_METHODS = {"euler-newton": False, "euler-newton-rate": True}


@dataclass(frozen=True, slots=True)
class Following:
    """Path following at the output points.

    Parameters
    ----------
    method : str
        A name among ``PATH_METHODS``.
    correctors : int or None
        Newton steps after the predictor; None takes 1, or 3 where a law has kinks.
    """

    method: str
    correctors: int | None = None

    @classmethod
    def of(cls, deck: Deck, method: str) -> Following | None:
        """Return what a method asks for, None if it is not one of path following.

        Raises
        ------
        UsageError
            NS4005 for an impossible number of correctors.
        """
        if method not in PATH_METHODS:
            return None
        option = deck.options.get("correctors")
        if option is None:
            return cls(method)
        value = option.value
        number = float(value) if isinstance(value, int | float) else -1.0
        if not (number.is_integer() and 0.0 <= number <= 50.0):
            raise UsageError(
                Diagnostic(
                    "NS4005",
                    f"correctors cannot be {value}",
                    option.span,
                    "give a whole number from 0 to 50",
                )
            )
        return cls(method, int(number))

    def apply(self, stepper: MoreauStepper, island: Island, system: DescriptorSystem) -> str:
        """Let a stepper follow the path; return how the island is solved, in words.

        Raises
        ------
        UsageError
            NS4030 for an island that stores energy: its solutions are not a path of static ones.
        """
        if not system.static:
            storing = [d.name for d in island.devices if d.stores_energy][:4]
            raise UsageError(
                Diagnostic(
                    "NS4030",
                    f"{self.method} follows circuits without energy storage, and "
                    f"{', '.join(storing) or 'this one'} store{'s' * (len(storing) < 2)} energy",
                    hint="omit the method, or run a .dc sweep",
                )
            )
        if system.smooth is None:
            return "point by point"  # piecewise linear: every point is exact
        stepper.follow_path(PATH_METHODS[self.method], self.correctors)
        return self.method
