"""Whether a check takes part in the verdict that still refuses some right runs.

Errors of steps, from a quadrature of what flows, show steps whose own estimate is wrong, but also
refuse right runs at some events.  Until that is understood the check is asked for by those who look
for faults: ``tools/mutations.py`` and its own tests.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

_state = {"strict": False}


def is_strict() -> bool:
    """Return whether the check takes part."""
    return _state["strict"]


@contextmanager
def strictly(wanted: bool = True) -> Iterator[None]:
    """Let the check take part in the verdict.

    Examples
    --------
    >>> with strictly():
    ...     is_strict()
    True
    """
    before = _state["strict"]
    _state["strict"] = wanted
    try:
        yield
    finally:
        _state["strict"] = before
