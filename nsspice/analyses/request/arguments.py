"""Whether what a caller gives is a number, a name, or several of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

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


def frequencies_of(values: object) -> npt.NDArray[np.float64]:
    """Return frequencies [Hz], shape (k,), of a number or several.

    Raises
    ------
    UsageError
        NS4005 for anything but finite numbers from 0 on.

    Examples
    --------
    >>> frequencies_of(50.0), frequencies_of([0, 1e3])
    (array([50.]), array([   0., 1000.]))
    """
    numbers: list[Any] = list(values) if np.ndim(values) else [values]  # type: ignore[call-overload, arg-type]
    for value in numbers:
        if not (finite(value) and value >= 0.0):
            raise _refused("a frequency", value, "give finite numbers from 0 on [Hz]")
    if not numbers:
        raise _refused("the frequencies", numbers, "give at least one, such as [1e3]")
    return np.array(numbers, dtype=np.float64)


def instant_of(value: object, what: str, *, above_zero: bool = False) -> None:
    """Check a time [s].

    Raises
    ------
    UsageError
        NS4005 for anything but a finite number from 0 on, or above 0.
    """
    if not finite(value) or value < 0.0 or (above_zero and value == 0.0):  # type: ignore[operator]
        kind = "above 0" if above_zero else "from 0 on"
        raise _refused(what, value, f"give a finite number {kind}, in seconds")


def _refused(what: str, value: object, hint: str) -> UsageError:
    return UsageError(Diagnostic("NS4005", f"{what} cannot be {value!r}", hint=hint))
