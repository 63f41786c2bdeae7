"""Whether what a caller gives is a number, a name, or several of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from ...errors import Diagnostic, UsageError


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
      hint: give its name, such as v(out)
    """
    if isinstance(value, str):
        return value.strip()
    raise _refused(what, value, f"give its name, such as {example}")


def several(values: Iterable[Any] | None, what: str, example: str) -> list[Any]:
    """Return what is given as a list: nothing if it is None, a text alone as one value.

    Raises
    ------
    UsageError
        NS4005 for anything that holds no values.

    Examples
    --------
    >>> several((1, 2), "values", "[0, 1]")
    [1, 2]
    >>> several("v(out)", "the signals", '["v(out)"]')
    ['v(out)']
    >>> several(5.0, "the values of a sweep", "[0, 1]")
    Traceback (most recent call last):
    ...
    nsspice.errors.UsageError: error NS4005: the values of a sweep cannot be 5.0
      hint: give a list, such as [0, 1]
    """
    if values is None:
        return []
    try:
        return [values] if isinstance(values, str) else list(values)
    except TypeError:
        raise _refused(what, values, f"give a list, such as {example}") from None


def by_name(values: object, what: str, example: str) -> dict[str, Any]:
    """Return values by name as a dict; nothing if they are None.

    Raises
    ------
    UsageError
        NS4005 for anything but a mapping.

    Examples
    --------
    >>> by_name([3.0], "values", '{"r1": 1e3}')
    Traceback (most recent call last):
    ...
    nsspice.errors.UsageError: error NS4005: values cannot be [3.0]
      hint: give a dict, such as {"r1": 1e3}
    """
    if values is None:
        return {}
    if isinstance(values, Mapping):
        return dict(values)
    raise _refused(what, values, f"give a dict, such as {example}")


def _refused(what: str, value: object, hint: str) -> UsageError:
    return UsageError(Diagnostic("NS4005", f"{what} cannot be {value!r}", hint=hint))
