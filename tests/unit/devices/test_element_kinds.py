"""Every kind of element is complete: form, reader, laws, noise, translation, page."""

from __future__ import annotations

import inspect
from pathlib import Path

import pytest

import nsspice
from nsspice.devices.device import Device, Edge, number
from nsspice.devices.effect import Effect
from nsspice.devices.noise import Flicker
from nsspice.devices.parameter import Table
from nsspice.element_kinds import KINDS, Kind
from nsspice.lazy import resolve
from nsspice.netlist.elements.terminals import Terminals
from nsspice.problems.descriptor import Functional

PAGE = Path(__file__).parents[3] / "docs" / "reference" / "elements.md"

#: an element of each law, `x` its name, and what else the deck needs
EXAMPLES = {
    "Resistor": "Rx a 0 1",
    "BehaviouralResistor": "Rx a 0 R={1+V(a)^2}",
    "Capacitor": "Cx a 0 1u",
    "Charge": "Cx a 0 Q={x+x^3}",
    "ChargeLayers": "Cx a 0 Q={if(x>1,2*x-1,x)}",
    "KnottedCharge": "Cx a 0 Q={table(x,-1,-3,0,0,1,1,2,4)}\nB1 a 0 I={max(V(a), 0)}",
    "Inductor": "Lx a 0 1u",
    "Flux": "Lx a 0 Flux={x+x^3}",
    "FluxLayers": "Lx a 0 Flux={if(x>1,2*x-1,x)}",
    "Coupling": "Kx L1 L2 0.5\nL1 a 0 1\nL2 b 0 1\nRb b 0 1",
    "VoltageSource": "Vx b 0 1\nRb b 0 1",
    "CurrentSource": "Ix a 0 1",
    "Vcvs": "Ex b 0 a 0 2\nRb b 0 1",
    "Cccs": "Fx a 0 V1 0.5",
    "Vccs": "Gx a 0 a 0 2",
    "Ccvs": "Hx b 0 V1 2\nRb b 0 1",
    "Behavioural": "Bx a 0 I={V(a)^3}",
    "BrokenConductor": "Bx a 0 I={max(V(a), 0)}",
    "Diode": "Dx a 0",
    "JunctionDiode": "Dx a 0 card\n.model card D(IS=1e-14)",
    "Thyristor": "Dx a 0 g card\nRg g 0 1\n.model card SCR(Vfwd=1 Vbo=100 Ih=1m Igt=1m)",
    "LatchingThyristor": "Dx a 0 g card\nRg g 0 1\n.model card SCR(Vfwd=1 Igt=1m)",
    "Jfet": "Jx a b 0 card\nRb b 0 1\n.model card NJF(VTO=-2)",
    "MosfetSwitch": "Mx a b 0 0 card\nRb b 0 1\n.model card NMOS(ideal)",
    "Level1": "Mx a b 0 0 card\nRb b 0 1\n.model card NMOS(VTO=1)",
    "Level2": "Mx a b 0 0 card\nRb b 0 1\n.model card NMOS(LEVEL=2 VTO=1 GAMMA=0.5)",
    "Level3": "Mx a b 0 0 card\nRb b 0 1\n.model card NMOS(LEVEL=3 VTO=1 THETA=0.1)",
    "Vdmos": "Mx a b 0 card\nRb b 0 1\n.model card VDMOS(VTO=1 KP=1)",
    "Bipolar": "Qx a b 0 card\nRb b 0 1\n.model card NPN(IS=1e-15 BF=100)",
    "EbersMoll": "Qx a b 0 card\nRb b 0 1\n.model card NPN(DE=i DC=i)\n.model i D(ideal)",
    "VoltageSwitch": "Sx a 0 a 0 card\n.model card SW(VT=0.5)",
    "CurrentSwitch": "Wx a 0 V1 card\n.model card CSW(IT=0.5)",
    "Igbt": "Zx a b 0 card\nRb b 0 1\n.model card NIGBT(ideal)",
}

#: written otherwise than the table calls them: ic=vbe,vce
ON_THE_LINE = {"icvce": "vce"}


def laws() -> dict[str, type[Device]]:
    """Return all laws that elements are made of; bases that only hand over are none."""
    found = {law: resolve(law) for kind in KINDS.values() for law in kind.laws}
    return {c.__name__: c for c in found.values() if not inspect.isabstract(c)}


def test_every_law_has_an_example():
    # a delay is a part of an expression, and has no line of its own
    assert set(EXAMPLES) == set(laws()) - {"Delayed"}


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_a_law_is_complete(name: str):
    line = EXAMPLES[name]
    circuit = nsspice.read(f"one of each\nV1 in 0 1\nRin in a 1\n{line}\n.op\n")
    device = circuit.device(line.split()[0].lower())
    law = laws()[name]
    assert type(device) is law
    assert device.KIND != Device.KIND, "messages call it an element"
    assert isinstance(law.INSTANCE, Table)
    assert device.effects, "nsspice explain would say nothing of it"
    noisy = law.noise is not Device.noise
    assert noisy == bool(law.NOISE), "NOISE says what noise() yields, () that there is none"
    for parameter in law.INSTANCE.parameters:
        if parameter.status == "used":
            _reads(line, ON_THE_LINE.get(parameter.name, parameter.name))


def _reads(line: str, parameter: str) -> None:
    """Check that the reader of lines knows a parameter of the device."""
    first, *rest = line.split("\n")
    deck = "\n".join([f"{first} {parameter}=1", *rest])
    try:
        nsspice.read(f"one parameter\nV1 in 0 1\nRin in a 1\n{deck}\n.op\n")
    except nsspice.NetlistError as error:
        for found in error.diagnostics:
            assert "unknown parameter" not in found.message


@pytest.mark.parametrize("letter", sorted(KINDS))
def test_a_kind_is_complete(letter: str):
    kind = KINDS[letter]
    assert callable(resolve(kind.reader))
    assert kind.translation == "" or callable(resolve(kind.translation))
    assert kind.form[0].lower() == letter
    rows = [r for r in PAGE.read_text("utf-8").splitlines() if r.startswith("| `")]
    assert any(f"`{letter.upper()} " in row for row in rows), "a line in docs/reference/elements.md"


def test_all_devices_are_registered():
    def below(law: type[Device]):
        for one in law.__subclasses__():
            yield from (one, *below(one))

    known = set(laws().values())
    inner = {"BlockInput"}  # stands for what another island determines
    concrete = {c for c in below(Device) if c.__module__.startswith("nsspice.")}
    missing = {
        c.__name__
        for c in concrete - known
        if not inspect.isabstract(c) and not c.__subclasses__() and c.__name__ not in inner
    }
    assert missing == set()


# a constant-power load, as a contributor would write it: one class, one reader, one row -----------


class ConstantPower(Device):
    """``P a b watts``: i = p / v."""

    KIND = "constant-power load"
    NOISE = ()
    smooth = True
    __slots__ = ("watts",)

    @classmethod
    def read(cls, element, context):
        watts = number(element, "power", context.findings)
        if watts is None:
            return None
        device = cls(element)
        device.watts = watts
        device.effects = (Effect("power", "value", watts, "W"),)
        return device

    def edges(self, values=None):
        return (Edge("R", *self.ends),)

    def stamp(self, stamper):
        tape = stamper.tape
        power = tape.constant(self.watts)
        current = tape.op("div", power, stamper.voltage_register(*self.ends))
        number = stamper.function(current)
        stamper.layout.functions[self.name] = number
        stamper.enter(*self.ends, number)

    def current(self, layout):
        return Functional(f=((layout.functions[self.name], 1.0),))


def read_load(reader, line, items):
    terminals = Terminals(reader, line, items)
    terminals.take_nodes(2)
    result = terminals.template()
    result.value = reader.value(line, terminals.next())
    terminals.finish(result)
    return result


def test_a_new_device_is_a_class_and_a_row(monkeypatch):
    """10 V behind 1 Ohm feed 9 W: v (10 - v) = 9, of whose solutions 1 V and 9 V one is found."""
    row = Kind("Nname n+ n- watts", f"{__name__}:read_load", "", (f"{__name__}:ConstantPower",))
    monkeypatch.setitem(KINDS, "n", row)
    circuit = nsspice.read("load\nV1 in 0 10\nR1 in out 1\nN1 out 0 9\n.nodeset v(out)=9\n")
    solution = nsspice.op(circuit)
    v = float(solution["v(out)"][0])
    assert v * (10.0 - v) == pytest.approx(9.0, rel=1e-9)
    assert float(solution["i(n1)"][0]) == pytest.approx(9.0 / v, rel=1e-9)
    assert list(circuit.device("n1").noise(None, Flicker())) == []
