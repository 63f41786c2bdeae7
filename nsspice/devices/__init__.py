"""The laws: one file per element, each with its parameters, effects, characteristic and stamp.

An element's file is loaded when the first element of its kind is read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..lazy import lazily

if TYPE_CHECKING:
    from .behavioural import Behavioural, BehaviouralResistor, Reading
    from .bipolar import Bipolar
    from .capacitor import Capacitor
    from .carrier import Carrier, Terminal
    from .characteristic import Characteristic, Decomposition, PairLaw, diode_curve
    from .controlled import Cccs, Ccvs, CurrentControlled, Vccs, Vcvs
    from .coupling import Coupling
    from .device import Context, Device, Edge
    from .diode import Diode, DiodeLaw
    from .ebers_moll import EbersMoll
    from .effect import Effect
    from .igbt import Igbt
    from .inductor import Inductor
    from .isource import CurrentSource
    from .jfet import Jfet
    from .junction import JunctionLaw
    from .junction_diode import JunctionDiode
    from .latching_thyristor import LatchingThyristor
    from .level1 import Level1
    from .mosfet import Mosfet
    from .mosfet_switch import MosfetSwitch
    from .parameter import Parameter, Table
    from .resistor import Resistor
    from .stamper import Conditions, Layout, Stamper
    from .switch import CurrentSwitch, SwitchLaw, VoltageSwitch
    from .thyristor import Thyristor
    from .transistor import Transistor
    from .vdmos import Vdmos
    from .vsource import VoltageSource

_HOME = {
    "Behavioural": ".behavioural",
    "BehaviouralResistor": ".behavioural",
    "Bipolar": ".bipolar",
    "Capacitor": ".capacitor",
    "Carrier": ".carrier",
    "Cccs": ".controlled",
    "Ccvs": ".controlled",
    "Characteristic": ".characteristic",
    "Conditions": ".stamper",
    "Context": ".device",
    "Coupling": ".coupling",
    "CurrentControlled": ".controlled",
    "CurrentSource": ".isource",
    "CurrentSwitch": ".switch",
    "Decomposition": ".characteristic",
    "Device": ".device",
    "Diode": ".diode",
    "DiodeLaw": ".diode",
    "EbersMoll": ".ebers_moll",
    "Edge": ".device",
    "Effect": ".effect",
    "Igbt": ".igbt",
    "Inductor": ".inductor",
    "Jfet": ".jfet",
    "JunctionDiode": ".junction_diode",
    "JunctionLaw": ".junction",
    "LatchingThyristor": ".latching_thyristor",
    "Layout": ".stamper",
    "Level1": ".level1",
    "Mosfet": ".mosfet",
    "MosfetSwitch": ".mosfet_switch",
    "PairLaw": ".characteristic",
    "Parameter": ".parameter",
    "Reading": ".behavioural",
    "Resistor": ".resistor",
    "Stamper": ".stamper",
    "SwitchLaw": ".switch",
    "Table": ".parameter",
    "Terminal": ".carrier",
    "Thyristor": ".thyristor",
    "Transistor": ".transistor",
    "Vccs": ".controlled",
    "Vcvs": ".controlled",
    "Vdmos": ".vdmos",
    "VoltageSource": ".vsource",
    "VoltageSwitch": ".switch",
    "diode_curve": ".characteristic",
}

__getattr__ = lazily(__name__, _HOME)

_LAWS = {
    "r": "Resistor",
    "c": "Capacitor",
    "l": "Inductor",
    "k": "Coupling",
    "v": "VoltageSource",
    "i": "CurrentSource",
    "e": "Vcvs",
    "f": "Cccs",
    "g": "Vccs",
    "h": "Ccvs",
    "b": "Behavioural",
    "d": "Diode",
    "j": "Jfet",
    "m": "Mosfet",
    "q": "Transistor",
    "s": "VoltageSwitch",
    "w": "CurrentSwitch",
    "z": "Igbt",
}


def law_of(letter: str) -> type[Device]:
    """Return the law of the elements whose names begin with a letter.

    Examples
    --------
    >>> law_of("r").__name__
    'Resistor'
    """
    law: type[Device] = __getattr__(_LAWS[letter])
    return law


__all__ = [
    "Behavioural",
    "BehaviouralResistor",
    "Bipolar",
    "Capacitor",
    "Carrier",
    "Cccs",
    "Ccvs",
    "Characteristic",
    "Conditions",
    "Context",
    "Coupling",
    "CurrentControlled",
    "CurrentSource",
    "CurrentSwitch",
    "Decomposition",
    "Device",
    "Diode",
    "DiodeLaw",
    "EbersMoll",
    "Edge",
    "Effect",
    "Igbt",
    "Inductor",
    "Jfet",
    "JunctionDiode",
    "JunctionLaw",
    "LatchingThyristor",
    "Layout",
    "Level1",
    "Mosfet",
    "MosfetSwitch",
    "PairLaw",
    "Parameter",
    "Reading",
    "Resistor",
    "Stamper",
    "SwitchLaw",
    "Table",
    "Terminal",
    "Thyristor",
    "Transistor",
    "Vccs",
    "Vcvs",
    "Vdmos",
    "VoltageSource",
    "VoltageSwitch",
    "diode_curve",
    "law_of",
]
