"""Values that callers and sweeps put in place of those of the deck."""

from __future__ import annotations

from collections.abc import Mapping

from ...circuit import Circuit
from ...devices.device import Device
from ...devices.passive.passive import Passive
from ...devices.sources.isource import CurrentSource
from ...devices.sources.vsource import VoltageSource
from ...errors import Diagnostic, Span, UsageError
from .arguments import by_name, finite, name_of


def checked_values(circuit: Circuit, values: Mapping[str, float] | None) -> dict[str, float]:
    """Return values by element name, names in lower case.

    Parameters
    ----------
    circuit : Circuit
    values : mapping of str to float or None
        [Ohm, H, F, V or A]

    Raises
    ------
    NetlistError
        NS2012 for an element that does not exist.
    UsageError
        NS4007 for one that has no value, NS4005 for a value that is impossible.

    Examples
    --------
    >>> import nsspice
    >>> checked_values(nsspice.read("an RC\\nR1 a 0 1\\nC1 a 0 1\\n"), {"R1": 2})
    {'r1': 2.0}
    """
    found = {}
    given = by_name(values, "the values of elements", '{"r1": 1e3}')
    for name, value in given.items():
        device = valued(circuit, name_of(name, "an element", "r1"))
        check_value(device, value)
        found[device.name] = float(value)
    return found


def valued(circuit: Circuit, name: str, span: Span | None = None) -> Device:
    """Return an element that has a number as its value.

    Raises
    ------
    UsageError
        NS4007 for any other.
    """
    device = circuit.device(name)
    if not isinstance(device, VoltageSource | CurrentSource | Passive):
        law = ": its value is an expression" if device.letter in "irlc" else ""
        message = f"{device.name} cannot be swept{law}"
        hint = "sweep a V, I, R, L or C, or temp"
        if law:
            hint = "write {name} in the expression, and sweep the parameter: .step param name ..."
        raise UsageError(Diagnostic("NS4007", message, span, hint))
    return device


def check_value(device: Device, value: float, span: Span | None = None) -> None:
    """Refuse a value that the element line could not have, either.

    Raises
    ------
    UsageError
        NS4005
    """
    if not finite(value):
        raise _impossible(f"{device.name} cannot be {value!r}", "give a finite number", span)
    if device.letter in "cl" and value < 0.0:
        what = "capacitance" if device.letter == "c" else "inductance"
        message = f"{device.name} cannot have the {what} {value:g}"
        raise _impossible(message, "give a value of 0 or more", span)


def _impossible(message: str, hint: str, span: Span | None = None) -> UsageError:
    return UsageError(Diagnostic("NS4005", message, span, hint))
