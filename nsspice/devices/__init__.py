"""The devices: one file per element, with its parameters, effects, characteristic and stamp.

An element's file is loaded when the first element of its kind is read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..lazy import lazily

if TYPE_CHECKING:
    from .carrier import Carrier, Terminal
    from .device import Context, Device, Edge
    from .diodes.characteristic import Characteristic, Decomposition, PairLaw, diode_curve
    from .diodes.diode import Diode, DiodeLaw
    from .diodes.junction import JunctionLaw
    from .diodes.junction_diode import JunctionDiode
    from .effect import Effect
    from .expressions.behavioural import Behavioural, Reading
    from .mosfets.level1 import Level1
    from .mosfets.mosfet import Mosfet
    from .mosfets.mosfet_switch import MosfetSwitch
    from .mosfets.vdmos import Vdmos
    from .parameter import Parameter, Table
    from .passive.behavioural_resistor import BehaviouralResistor
    from .passive.capacitor import Capacitor
    from .passive.coupling import Coupling
    from .passive.inductor import Inductor
    from .passive.resistor import Resistor
    from .sources.controlled import Cccs, Ccvs, CurrentControlled, Vccs, Vcvs
    from .sources.isource import CurrentSource
    from .sources.vsource import VoltageSource
    from .stamper import Conditions, Layout, Stamper
    from .switches.latching_thyristor import LatchingThyristor
    from .switches.switch import CurrentSwitch, SwitchLaw, VoltageSwitch
    from .switches.thyristor import Thyristor
    from .transistors.bipolar import Bipolar
    from .transistors.ebers_moll import EbersMoll
    from .transistors.igbt import Igbt
    from .transistors.jfet import Jfet
    from .transistors.transistor import Transistor

_HOME = {
    "Behavioural": ".expressions.behavioural",
    "BehaviouralResistor": ".passive.behavioural_resistor",
    "Bipolar": ".transistors.bipolar",
    "Capacitor": ".passive.capacitor",
    "Carrier": ".carrier",
    "Cccs": ".sources.controlled",
    "Ccvs": ".sources.controlled",
    "Characteristic": ".diodes.characteristic",
    "Conditions": ".stamper",
    "Context": ".device",
    "Coupling": ".passive.coupling",
    "CurrentControlled": ".sources.controlled",
    "CurrentSource": ".sources.isource",
    "CurrentSwitch": ".switches.switch",
    "Decomposition": ".diodes.characteristic",
    "Device": ".device",
    "Diode": ".diodes.diode",
    "DiodeLaw": ".diodes.diode",
    "EbersMoll": ".transistors.ebers_moll",
    "Edge": ".device",
    "Effect": ".effect",
    "Igbt": ".transistors.igbt",
    "Inductor": ".passive.inductor",
    "Jfet": ".transistors.jfet",
    "JunctionDiode": ".diodes.junction_diode",
    "JunctionLaw": ".diodes.junction",
    "LatchingThyristor": ".switches.latching_thyristor",
    "Layout": ".stamper",
    "Level1": ".mosfets.level1",
    "Mosfet": ".mosfets.mosfet",
    "MosfetSwitch": ".mosfets.mosfet_switch",
    "PairLaw": ".diodes.characteristic",
    "Parameter": ".parameter",
    "Reading": ".expressions.behavioural",
    "Resistor": ".passive.resistor",
    "Stamper": ".stamper",
    "SwitchLaw": ".switches.switch",
    "Table": ".parameter",
    "Terminal": ".carrier",
    "Thyristor": ".switches.thyristor",
    "Transistor": ".transistors.transistor",
    "Vccs": ".sources.controlled",
    "Vcvs": ".sources.controlled",
    "Vdmos": ".mosfets.vdmos",
    "VoltageSource": ".sources.vsource",
    "VoltageSwitch": ".switches.switch",
    "diode_curve": ".diodes.characteristic",
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
