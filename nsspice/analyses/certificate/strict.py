"""Whether checks take part in the verdict that still refuse some right runs.

Written rows, first states, signs of impulses, turns of switches and errors of steps see most of
what damaged engines do wrong, but also fail in right runs whose values are small by chance.  Until
they are measured everywhere by what rounding leaves there, they are asked for by those who look for
faults: ``tools/mutations.py`` and the tests of these checks.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

_state = {"strict": False}


def is_strict() -> bool:
    """Return whether these checks take part."""
    return _state["strict"]


@contextmanager
def strictly(wanted: bool = True) -> Iterator[None]:
    """Let these checks take part in the verdict.

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
