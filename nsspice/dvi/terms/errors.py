"""Errors of variational problems: they name the unknown, the equation and the hypothesis."""

from __future__ import annotations

from ...errors import Diagnostic, NumericalError, RegularityError, UsageError


def wrong(code: str, message: str, hint: str = "") -> UsageError:
    """Return the error of a model that is not well formed, or of a request that it cannot meet."""
    return UsageError(Diagnostic(code, message, hint=hint))


def unsolved(
    message: str, hint: str = "", time: float | None = None, residual: float | None = None
) -> NumericalError:
    """Return the error NS6020 of a problem without a solution, or for which none was found."""
    return NumericalError(Diagnostic("NS6020", message, hint=hint), time=time, residual=residual)


class RegularityLost(RegularityError):
    """A path of solutions has reached a point that is not strongly regular.

    Parameters
    ----------
    time : float
        Time of that point, as near as the path could be followed.
    unknown : str
        The unknown that moves fastest there.
    modulus : float
        Modulus of strong regularity at the last point: how far the unknown moves per unit of the
        data.
    hypothesis : str
        The hypothesis of the method, in words.

    Examples
    --------
    >>> error = RegularityLost(0.375, "k[0]", 1e12)
    >>> error.code, error.time, error.unknown
    ('NS6021', 0.375, 'k[0]')
    """

    def __init__(
        self,
        time: float,
        unknown: str,
        modulus: float,
        hypothesis: str = "strong metric regularity of the linearised problem at each time",
    ) -> None:
        super().__init__(
            Diagnostic(
                "NS6021",
                f"regularity is lost near t = {time:.9g}: {unknown} moves by {modulus:.3g} per "
                f"unit of the data; Euler-Newton needs {hypothesis}",
                hint="end the path before that time, or check the data there",
            ),
            time=time,
        )
        self.unknown = unknown
        self.modulus = modulus
        self.hypothesis = hypothesis
