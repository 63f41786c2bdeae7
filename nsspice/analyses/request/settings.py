"""How to solve: method, theta, step; what the caller says goes before the deck's ``.options``."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ...errors import Diagnostic, Span, UsageError, suggest
from ...netlist.deck import Deck
from .arguments import finite

#: methods of this version
METHODS = ("auto", "modewise", "sdirk", "moreau", "euler-newton", "euler-newton-rate")
#: what errors of steps are measured by: the ranges of all unknowns, or the energy exchanged
ACCURACIES = ("waveforms", "energy")
#: error of one step relative to the energy exchanged, where that measures it
_OF_ENERGY = 1e-4
#: methods of SPICE programs: they cannot be meant for this one, decks carry them along
_FOREIGN = ("trap", "trapezoidal", "gear", "euler", "modtrap")


@dataclass(frozen=True, slots=True)
class Settings:
    """Resolved settings of a run.

    Parameters
    ----------
    method : str
        ``auto`` or a method by name.
    theta : float
        Weight of the new state, 1 (implicit) to 0 (explicit).
    step : float or None
        Solver step [s], the longest one where steps are controlled; None follows ``.tran``.
    max_step : float or None
        Longest solver step where none is asked for [s], as ``tmax`` of ``.tran``.
    reltol : float
        Error of one controlled step, relative to the largest value of each unknown so far.
    vntol, abstol : float
        Errors of one controlled step that are always allowed [V], [A].
    order : int
        Order of the ``sdirk`` method: 2 or 4.
    accuracy : str
        ``waveforms``, or ``energy``: errors are measured as energies, ``reltol`` is then 1e-4 by
        default.
    stepped : bool
        True if a step or theta was asked for: ``auto`` then means a stepping method.

    Examples
    --------
    >>> settings = Settings.of(Deck("t", "t.net"), theta=0.5)
    >>> settings.method, settings.theta, settings.reltol, settings.stepped
    ('auto', 0.5, 1e-05, True)
    """

    method: str = "auto"
    theta: float = 1.0
    step: float | None = None
    max_step: float | None = None
    reltol: float = 1e-5
    vntol: float = 0.0
    abstol: float = 0.0
    order: int = 4
    accuracy: str = "waveforms"
    stepped: bool = False

    @classmethod
    def of(
        cls,
        deck: Deck,
        method: str | None = None,
        theta: float | None = None,
        step: float | None = None,
        reltol: float | None = None,
        accuracy: str | None = None,
    ) -> Settings:
        """Return the settings of a deck with the caller's choices put over them.

        Raises
        ------
        UsageError
            NS4004 for a method that does not exist, NS4005 for a value out of range.
        """
        for name, value in (("theta", theta), ("step", step), ("reltol", reltol)):
            if value is not None and not finite(value):
                raise _bad(name, value, "give a finite number")
        option = deck.options.get("method")
        if method is not None:
            chosen = _method(method, None)
        elif option is not None and str(option.value).lower() not in _FOREIGN:
            chosen = _method(str(option.value), option.span)
        else:
            chosen = "auto"
        weight, span = theta, None
        if weight is None and (given := deck.options.get("theta")) is not None:
            weight, span = _number(given.value, "theta", given.span), given.span
        step = _step(deck, "step", step)
        stepped = weight is not None or step is not None
        if weight is None:
            weight = 1.0
        if not 0.0 <= weight <= 1.0:
            raise _bad("theta", weight, "theta is the weight of the new state: 0 to 1", span)
        accuracy = _accuracy(deck, accuracy)
        tolerances = {
            name: _tolerance(deck, name, given)
            for name, given in (("reltol", reltol), ("vntol", None), ("abstol", None))
        }
        if accuracy == "energy" and tolerances["reltol"] is None:
            tolerances["reltol"] = _OF_ENERGY
        return cls(
            chosen,
            float(weight),
            step,
            _step(deck, "maxstep", None),
            **{name: value for name, value in tolerances.items() if value is not None},
            order=_order(deck),
            accuracy=accuracy,
            stepped=stepped,
        )


def foreign_method(deck: Deck) -> Diagnostic | None:
    """Return a warning if the deck asks for an integration method of another program."""
    option = deck.options.get("method")
    if option is None or str(option.value).lower() not in _FOREIGN:
        return None
    return Diagnostic(
        "NS4052",
        f"method={option.value} is a method of other programs and has no effect",
        option.span,
        f"choose one of {', '.join(METHODS)}, or remove it",
        severity="warning",
    )


def _method(name: object, span: Span | None) -> str:
    if not isinstance(name, str):
        raise _bad("method", name, f"methods: {', '.join(METHODS)}", span)
    name = name.strip().lower()
    if name in METHODS:
        return name
    hint = suggest(name, METHODS) or f"methods: {', '.join(METHODS)}"
    raise UsageError(Diagnostic("NS4004", f"there is no method {name!r}", span, hint))


def _tolerance(deck: Deck, name: str, given: float | None) -> float | None:
    """Return what the caller or the deck's options say of a tolerance, None if they do not."""
    value, span = given, None
    if value is None and (option := deck.options.get(name)) is not None:
        value, span = _number(option.value, name, option.span), option.span
    if value is None:
        return None
    least = 0.0 if name != "reltol" else 1e-14
    if not (math.isfinite(value) and value >= least):
        raise _bad(name, value, f"give a number of at least {least:g}, such as 1e-6", span)
    return value


def _step(deck: Deck, name: str, given: float | None) -> float | None:
    """Return what the caller or the deck's options say of a step [s], None if they do not."""
    value, span = given, None
    if value is None and (option := deck.options.get(name)) is not None:
        value, span = _number(option.value, name, option.span), option.span
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise _bad(name, value, "give a positive step in seconds, such as 1e-6", span)
    return value


def _accuracy(deck: Deck, given: str | None) -> str:
    value: object = given
    span = None
    if given is None and (option := deck.options.get("accuracy")) is not None:
        value, span = option.value, option.span
    if value is None:
        return ACCURACIES[0]
    name = str(value).strip().lower()
    if name in ACCURACIES:
        return name
    hint = suggest(name, ACCURACIES) or f"accuracy is one of {', '.join(ACCURACIES)}"
    raise _bad("accuracy", value, hint, span)


def _order(deck: Deck) -> int:
    option = deck.options.get("order")
    if option is None:
        return 4
    if option.value in (2, 4):
        return int(option.value)
    raise _bad("order", option.value, "the method sdirk has order 2 or 4", option.span)


def _number(value: object, name: str, span: Span | None) -> float:
    if isinstance(value, int | float):
        return float(value)
    raise _bad(name, value, "give a number", span)


def _bad(name: str, value: object, hint: str, span: Span | None = None) -> UsageError:
    shown = f"{value:g}" if isinstance(value, float) else repr(value)
    return UsageError(Diagnostic("NS4005", f"{name} cannot be {shown}", span, hint))
