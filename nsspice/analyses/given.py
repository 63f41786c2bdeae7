"""Whether what a caller gives is a number, or a name."""

from __future__ import annotations

import math

from ..errors import Diagnostic, UsageError


def finite(value: object) -> bool:
    """Return whether a value is a finite number: no text, no nan, nothing else.

    Examples
    --------
    >>> finite(2), finite("2"), finite(float("nan")), finite(None)
    (True, False, False, False)
    """
    try:
        return math.isfinite(value)  # type: ignore[arg-type]
    except (TypeError, OverflowError):
        return False


def name_of(value: object, what: str, example: str) -> str:
    """Return a name without blanks around it.

    Raises
    ------
    UsageError
        NS4005 for anything but a text.

    Examples
    --------
    >>> name_of(3, "a signal", "v(out)")
    Traceback (most recent call last):
    ...
    nsspice.errors.UsageError: error NS4005: a signal cannot be 3
      hint: write its name, such as v(out)
    """
    if isinstance(value, str):
        return value.strip()
    hint = f"write its name, such as {example}"
    raise UsageError(Diagnostic("NS4005", f"{what} cannot be {value!r}", hint=hint))
