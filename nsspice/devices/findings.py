"""Collecting everything that is wrong with a deck, so that all of it is reported at once."""

from __future__ import annotations

from ..errors import Diagnostic, Span


class Findings:
    """Errors and warnings in the order in which they were found.

    Examples
    --------
    >>> found = Findings()
    >>> found.error("NS2004", "r1 has no value")
    >>> found.errors[0].message
    'r1 has no value'
    """

    def __init__(self) -> None:
        self.errors: list[Diagnostic] = []
        self.warnings: list[Diagnostic] = []

    def error(self, code: str, message: str, span: Span | None = None, hint: str = "") -> None:
        """Record something that forbids a simulation."""
        self.errors.append(Diagnostic(code, message, span, hint))

    def warning(self, code: str, message: str, span: Span | None = None, hint: str = "") -> None:
        """Record something that the user should know."""
        self.warnings.append(Diagnostic(code, message, span, hint, "warning"))
