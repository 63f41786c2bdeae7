"""Names of signals: ``v(a)``, ``v(a,b)``, ``i(r1)``, ``p(r1)``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

from ..devices.device import Device
from ..errors import Diagnostic, NetlistError, Span, suggest


class ParsedSignal(NamedTuple):
    """A signal name taken apart: kind ``v``, ``i`` or ``p`` and its one or two names."""

    kind: str
    names: tuple[str, ...]


@lru_cache(maxsize=4096)  # each run asks for the same names several times
def parse_signal(name: str) -> ParsedSignal | None:
    """Return the parts of a signal name, or None if it is not one.

    Examples
    --------
    >>> parse_signal("V(out, 0)")
    ParsedSignal(kind='v', names=('out', '0'))
    >>> parse_signal("out") is None
    True
    """
    text = name.strip().lower()
    kind, opening, inner = text.partition("(")
    if kind not in ("v", "i", "p") or not opening or not inner.endswith(")"):
        return None
    names = tuple(part.strip() for part in inner[:-1].split(","))
    if not all(names) or len(names) > (2 if kind == "v" else 1):
        return None
    if kind == "v":
        names = tuple("0" if n in ("gnd", "gnd!") else n for n in names)
    return ParsedSignal(kind, names)


def owner(name: str, devices: Mapping[str, Device]) -> tuple[Device, str] | None:
    """Return the element of a current and its terminal: ``q1.b`` is the base of ``q1``.

    Parameters
    ----------
    name : str
        An element, or an element with a terminal; the terminal is ``""`` for the first one.
    devices : mapping of str to Device
    """
    device = devices.get(name)
    if device is not None:
        return device, ""
    element, _, terminal = name.rpartition(".")
    device = devices.get(element)
    return None if device is None or terminal not in device.terminals else (device, terminal)


def unknown_signal(name: str, known: Sequence[str], span: Span | None = None) -> NetlistError:
    """Return the error for a signal that does not exist, with the nearest name as a hint."""
    bare = name.strip().lower()
    meant = next((s for s in (f"v({bare})", f"i({bare})") if s in known), "")
    hint = f"did you mean {meant}?" if meant else suggest(bare, known)
    if not hint:
        hint = "signals are v(node), v(node,node) and i(element)"
    return NetlistError(Diagnostic("NS2012", f"there is no signal {name}", span, hint))
