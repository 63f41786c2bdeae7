"""The devices: one file per element, with its parameters, effects, characteristic and stamp.

Read ``device`` first, what the circuit may ask of any element, then ``stamper``, where the laws
write their rows.  An element's file is loaded when the first element of its kind is read;
``element_kinds`` lists which.  Imports ``netlist`` and ``problems``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..element_kinds import KINDS
from ..lazy import lazily, resolve

if TYPE_CHECKING:
    from .device import Device

_HOME = {
    "Carrier": ".carrier",
    "Characteristic": ".diodes.characteristic",
    "Conditions": ".stamper",
    "Context": ".device",
    "CurrentControlled": ".sources.controlled",
    "Decomposition": ".diodes.characteristic",
    "Device": ".device",
    "DiodeLaw": ".diodes.diode",
    "Edge": ".device",
    "Effect": ".effect",
    "JunctionLaw": ".diodes.junction",
    "Layout": ".stamper",
    "PairLaw": ".diodes.characteristic",
    "Parameter": ".parameter",
    "Reading": ".expressions.behavioural",
    "Stamper": ".stamper",
    "SwitchLaw": ".switches.switch",
    "Table": ".parameter",
    "Terminal": ".carrier",
    "diode_curve": ".diodes.characteristic",
}
for _law in (law for kind in KINDS.values() for law in kind.laws):
    _home, _, _name = _law.partition(":")
    _HOME[_name] = _home.removeprefix(".devices")

__getattr__ = lazily(__name__, _HOME)


def law_of(letter: str) -> type[Device]:
    """Return the law that reads the elements whose names begin with a letter.

    Examples
    --------
    >>> law_of("r").__name__
    'Resistor'
    """
    law: type[Device] = resolve(KINDS[letter].laws[0])
    return law


__all__ = ["law_of", *_HOME]
