"""Transfer functions of z in a deck, as controllers."""

from __future__ import annotations

from ...errors import Diagnostic, UsageError
from ...netlist.deck import Deck, Sampled
from .controller import Controller


class Recursion:
    """A transfer function of z: its difference equation, in the transposed direct form II.

    Limits act within the recursion, so that nothing winds up.

    References: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing (2nd ed., 1999),
    section 6.3.

    Examples
    --------
    >>> from nsspice.errors import Span
    >>> where = Span("deck.net", 1, 1, 1, "")
    >>> law = Recursion(Sampled("e1", "v(a)", (0.5, 0.0), (1.0, -1.0), 1.0, 0.0, 0.0, 1.0,
    ...     0.0, 1.75, where))
    >>> [law(float(k), (1.0,)) for k in range(3)]
    [1.5, 1.75, 1.75]
    """

    def __init__(self, function: Sampled) -> None:
        self._b, self._a = function.numerator, function.denominator
        self._low, self._high = function.low, function.high
        #: what is left of earlier samples: at first that of the start value without an input
        self.state = [-function.start * sum(self._a[k:]) for k in range(1, len(self._a))]

    def __call__(self, time: float, values: tuple[float, ...]) -> float:
        """Return the output for the next sample."""
        (u,) = values
        s, a, b = self.state, self._a, self._b
        y = b[0] * u + (s[0] if s else 0.0)
        y = min(max(y, self._low), self._high)
        later = [*s[1:], 0.0]
        self.state = [b[k] * u - a[k] * y + later[k - 1] for k in range(1, len(a))]
        return y


def controllers_of(deck: Deck) -> list[Controller]:
    """Return the transfer functions of z of a deck as controllers, at their start."""
    return [
        Controller(f.period, [f.signal], [f.source], Recursion(f), f.delay, f.offset)
        for f in deck.sampled
    ]


def refuse_delays(deck: Deck, what: str) -> None:
    """Refuse an analysis that knows no delays.

    Raises
    ------
    UsageError
        NS4024
    """
    if deck.delays:
        found = deck.delays[0]
        message = f"{found.element} is a delay, which {what} does not know"
        raise UsageError(Diagnostic("NS4024", message, found.span, "use .tran"))


def refuse_sampled(deck: Deck, what: str, delays: bool = False) -> None:
    """Refuse an analysis that knows no clock, and maybe no delays.

    Raises
    ------
    UsageError
        NS4024
    """
    if not delays:
        refuse_delays(deck, what)
    if deck.sampled:
        found = deck.sampled[0]
        message = f"{found.source} is a function of z, which {what} does not know"
        hint = "use .tran or .pss, or an approximation in s: LAPLACE"
        raise UsageError(Diagnostic("NS4024", message, found.span, hint))
