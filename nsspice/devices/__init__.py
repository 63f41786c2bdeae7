"""The laws: one file per element, each with its parameters, effects, characteristic and stamp."""

from __future__ import annotations

from .behavioural import Behavioural, BehaviouralResistor, Reading
from .bipolar import Bipolar
from .capacitor import Capacitor
from .characteristic import Characteristic, Decomposition, PairLaw, diode_curve
from .controlled import Cccs, Ccvs, CurrentControlled, Vccs, Vcvs
from .coupling import Coupling
from .device import Context, Device, Edge
from .diode import Diode, DiodeLaw
from .ebers_moll import EbersMoll
from .effect import Effect
from .findings import Findings, did_you_mean
from .inductor import Inductor
from .isource import CurrentSource
from .junction import JunctionLaw
from .junction_diode import JunctionDiode
from .parameter import Parameter, Table
from .resistor import Resistor
from .stamper import Conditions, Layout, Stamper
from .switch import CurrentSwitch, SwitchLaw, VoltageSwitch
from .thyristor import Thyristor
from .transistor import Terminal, Transistor
from .vsource import VoltageSource

#: the law of each element letter
LAWS: dict[str, type[Device]] = {
    "r": Resistor,
    "c": Capacitor,
    "l": Inductor,
    "k": Coupling,
    "v": VoltageSource,
    "i": CurrentSource,
    "e": Vcvs,
    "f": Cccs,
    "g": Vccs,
    "h": Ccvs,
    "b": Behavioural,
    "d": Diode,
    "q": Transistor,
    "s": VoltageSwitch,
    "w": CurrentSwitch,
}

__all__ = [
    "LAWS",
    "Behavioural",
    "BehaviouralResistor",
    "Bipolar",
    "Capacitor",
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
    "Findings",
    "Inductor",
    "JunctionDiode",
    "JunctionLaw",
    "Layout",
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
    "VoltageSource",
    "VoltageSwitch",
    "did_you_mean",
    "diode_curve",
]
