"""``--controller``: digital controllers in C and FMUs, from a command line, never from a deck."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..errors import Diagnostic, UsageError
from .options import read_signals, spice_number

if TYPE_CHECKING:
    from ..analyses.request.controller import Controller

_NUMBERS = ("period", "delay", "offset")
_NAMES = ("reads", "writes")
_HINT = 'write --controller "law.so period=10u reads=v(out),i(l1) writes=vduty"'


def read_controllers(items: Sequence[str], confined: bool) -> list[Controller]:
    """Return the controllers that options name.

    Raises
    ------
    UsageError
        NS4005 for what cannot be read, or if the run is confined: a library may do anything.
    """
    if not items:
        return []
    from ..analyses.request.controller import Controller

    if confined:
        message = "--confined: a controller in a library could do anything"
        raise UsageError(Diagnostic("NS4005", message, hint="leave one of the options out"))
    found = []
    for item in items:
        path, *rest = item.split() or [""]
        given = dict(word.partition("=")[::2] for word in rest)
        more = {key: value for key, value in given.items() if key not in (*_NUMBERS, *_NAMES)}
        unit = path.lower().endswith(".fmu")
        if not path or (more and not unit) or "period" not in given:
            raise UsageError(Diagnostic("NS4005", f"--controller cannot be {item!r}", hint=_HINT))
        times = {key: _number(key, given[key]) for key in _NUMBERS if key in given}
        reads, writes = (read_signals([given.get(key, "")]) or [] for key in _NAMES)
        if unit:
            values = {key: _number(key, value) for key, value in more.items()}
            period = times.pop("period")
            found.append(Controller.from_fmu(path, period, reads, writes, values, **times))
        else:
            found.append(Controller.from_library(path, reads=reads, writes=writes, **times))
    return found


def _number(key: str, text: str) -> float:
    value, why = spice_number(text)
    if value is None:
        message = f"the {key} of a controller cannot be {text!r}"
        raise UsageError(Diagnostic("NS4005", message, hint=f"{text!r} {why}"))
    return value
