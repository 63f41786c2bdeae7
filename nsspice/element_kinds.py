"""The kinds of elements, one row for each letter: what reads its line, its laws, its translation.

A new device is a class derived from ``Device`` and its name in this table; a test goes through the
table and says what is missing.  Places are written ``module:name`` and imported when the first
element of the kind is read.
"""

from __future__ import annotations

from typing import NamedTuple


class Kind(NamedTuple):
    """What belongs to the elements whose names begin with a letter.

    Parameters
    ----------
    form : str
        How the line is written, for hints.
    reader : str
        The function that reads the line, in ``netlist/elements``.
    translation : str
        The function that writes it for ngspice, in ``compare/ngspice``; empty if there is none.
    laws : tuple of str
        Its devices; the first one is asked to read, and hands over to the others.
    has_cards : bool
        Words among its parameters name further model cards, as ``body=`` does.
    """

    form: str
    reader: str
    translation: str
    laws: tuple[str, ...]
    has_cards: bool = False


_READ = ".netlist.elements"
_WRITE = ".compare.ngspice"
_PASSIVE = f"{_READ}.passive:passive", f"{_WRITE}.elements:write_passive"
_SOURCE = f"{_READ}.sources:source", f"{_WRITE}.elements:write_source"
_CONTROLLED = f"{_READ}.controlled:controlled", f"{_WRITE}.elements:write_controlled"
_WAVE = ", or a waveform such as SIN(0 10 50)"
_STORED = ".devices.expressions.stored"
_LAYERS = ".devices.expressions.layered_storage"
_BEHAVIOURAL = ".devices.expressions.behavioural:Behavioural"

KINDS = {
    "r": Kind("Rname n+ n- value", *_PASSIVE, (".devices.passive.resistor:Resistor",
         ".devices.passive.behavioural_resistor:BehaviouralResistor")),
    "c": Kind("Cname n+ n- value", *_PASSIVE, (".devices.passive.capacitor:Capacitor",
         f"{_STORED}:Charge", f"{_LAYERS}:ChargeLayers",
         ".devices.expressions.knotted_charge:KnottedCharge")),
    "l": Kind("Lname n+ n- value", *_PASSIVE, (".devices.passive.inductor:Inductor",
         f"{_STORED}:Flux", f"{_LAYERS}:FluxLayers")),
    "k": Kind("Kname L1 L2 coefficient", f"{_READ}.passive:coupling",
         f"{_WRITE}.elements:write_coupling", (".devices.passive.coupling:Coupling",)),
    "v": Kind(f"Vname n+ n- value{_WAVE}", *_SOURCE, (".devices.sources.vsource:VoltageSource",)),
    "i": Kind(f"Iname n+ n- value{_WAVE}", *_SOURCE, (".devices.sources.isource:CurrentSource",
         _BEHAVIOURAL)),
    "e": Kind("Ename n+ n- nc+ nc- gain, or Ename n+ n- VALUE={expression}", *_CONTROLLED,
         (".devices.sources.controlled:Vcvs", _BEHAVIOURAL, ".devices.sources.delayed:Delayed")),
    "f": Kind("Fname n+ n- Vname gain", *_CONTROLLED,
         (".devices.sources.controlled:Cccs", _BEHAVIOURAL)),
    "g": Kind("Gname n+ n- nc+ nc- gain, or Gname n+ n- VALUE={expression}", *_CONTROLLED,
         (".devices.sources.controlled:Vccs", _BEHAVIOURAL)),
    "h": Kind("Hname n+ n- Vname gain", *_CONTROLLED,
         (".devices.sources.controlled:Ccvs", _BEHAVIOURAL)),
    "b": Kind("Bname n+ n- V=expression, or I=expression", f"{_READ}.controlled:behavioural",
         f"{_WRITE}.elements:write_behavioural", (_BEHAVIOURAL,
         ".devices.expressions.broken_conductor:BrokenConductor")),
    "d": Kind("Dname anode cathode, and its model unless it is ideal",
         f"{_READ}.semiconductors:diode", f"{_WRITE}.elements:write_diode",
         (".devices.diodes.diode:Diode", ".devices.diodes.junction_diode:JunctionDiode",
          ".devices.switches.thyristor:Thyristor",
          ".devices.switches.latching_thyristor:LatchingThyristor")),
    "j": Kind("Jname drain gate source model", f"{_READ}.semiconductors:jfet",
         f"{_WRITE}.mosfets:write_jfet", (".devices.transistors.jfet:Jfet",)),
    "m": Kind("Mname drain gate source body model", f"{_READ}.semiconductors:mosfet",
         f"{_WRITE}.mosfets:write_mosfet",
         (".devices.mosfets.mosfet:Mosfet", ".devices.mosfets.mosfet_switch:MosfetSwitch",
          ".devices.mosfets.level1:Level1", ".devices.mosfets.level2:Level2",
          ".devices.mosfets.level3:Level3",
          ".devices.mosfets.vdmos:Vdmos"), has_cards=True),
    "q": Kind("Qname collector base emitter model", f"{_READ}.semiconductors:transistor",
         f"{_WRITE}.elements:write_transistor",
         (".devices.transistors.transistor:Transistor", ".devices.transistors.bipolar:Bipolar",
          ".devices.transistors.ebers_moll:EbersMoll"), has_cards=True),
    "s": Kind("Sname n+ n- nc+ nc- model", f"{_READ}.semiconductors:switch",
         f"{_WRITE}.diodes:write_switch", (".devices.switches.switch:VoltageSwitch",)),
    "w": Kind("Wname n+ n- Vname model", f"{_READ}.semiconductors:current_switch",
         f"{_WRITE}.diodes:write_switch", (".devices.switches.switch:CurrentSwitch",)),
    "z": Kind("Zname collector gate emitter model", f"{_READ}.semiconductors:igbt",
         f"{_WRITE}.mosfets:write_igbt", (".devices.transistors.igbt:Igbt",), has_cards=True),
}  # fmt: skip
