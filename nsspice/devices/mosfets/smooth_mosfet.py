"""What the smooth MOSFETs share: functions between terminals, resistances in series with them.

Laws are written for n-channel transistors; those of p-channel ones have all voltages and currents
turned round.  A terminal is called ``d``, ``g``, ``s`` or ``b``, and ``D``, ``G``, ``S`` behind its
resistance; without one the two are the same node.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, ClassVar

from ...problems.descriptor import Functional
from ..diodes.diode_branch import Voltage
from ..noise import Flicker, NoiseSource, thermal_noise
from ..stamper import Conditions, Layout, Stamper
from ..temperature import BOLTZMANN, kelvin
from .mosfet import Flow, Mosfet

if TYPE_CHECKING:
    from ...netlist.deck import Element

#: in messages and names of nodes
_LABELS = {"d": "drain", "g": "gate", "s": "source"}
_EPS0 = 8.854214871e-12  # as SPICE has it [F/m]
_OXIDE = 1e-7  # thickness where the card has none [m]


class SmoothMosfet(Mosfet):
    """Base of the smooth MOSFETs."""

    NOISE = ("thermal", "flicker")
    smooth = True
    #: currents and charges with the ends between which they flow in an n-channel transistor
    CURRENTS: ClassVar[tuple[tuple[str, str, str], ...]] = ()
    CHARGES: ClassVar[tuple[tuple[str, str, str], ...]] = ()
    __slots__ = ("card", "dtemp", "given", "stores_energy", "temp")

    def __init__(
        self, element: Element, n: bool, card: Mapping[str, float], given: Mapping[str, float]
    ) -> None:
        super().__init__(element, n, given.get("m", 1.0))
        self.card = card
        self.given = given
        self.temp = given.get("temp", card.get("t_abs"))
        self.dtemp = given.get("dtemp", 0.0)

    @abstractmethod
    def resistances(self, conditions: Conditions) -> dict[str, float]:
        """Return the resistance [Ohm] in series with each terminal that has one."""

    @property
    def _shunt(self) -> float:
        """Conductance from drain to source [S]."""
        return self.parallel / self.card["rds"] if "rds" in self.card else 0.0

    def inside(self, conditions: Conditions) -> dict[str, str]:
        """Return the nodes of all terminals, and those behind their resistances."""
        d, g, s = self.corners
        outer = {"d": d, "g": g, "s": s, "b": self.body}
        nodes = dict(outer)
        resistances = self.resistances(conditions)
        for terminal, label in _LABELS.items():
            apart = terminal in resistances
            nodes[terminal.upper()] = f"{self.name}#{label}" if apart else outer[terminal]
        return nodes

    def _stamp_resistances(self, stamper: Stamper, held: Mapping[str, bool]) -> None:
        """Add the resistances; ``held`` says which inner nodes have a capacitance."""
        conditions = stamper.layout.conditions
        nodes = self.inside(conditions)
        for terminal, ohms in self.resistances(conditions).items():
            inner = nodes[terminal.upper()]
            ohms = ohms / self.parallel
            stamper.series_resistance(
                nodes[terminal], inner, self.name, ohms, held=held.get(terminal, False)
            )

    def _across(self, stamper: Stamper, nodes: Mapping[str, str], a: str, b: str) -> int:
        """Return the register of a voltage, turned round for p-channel transistors."""
        ends = (nodes[a], nodes[b]) if self.n else (nodes[b], nodes[a])
        return stamper.voltage_register(*ends)

    def _stamp_functions(
        self, stamper: Stamper, nodes: Mapping[str, str], registers: Mapping[str, int | None]
    ) -> None:
        """Let currents and rates of charges flow between their ends."""
        for flows, enter in (
            (self.CURRENTS, stamper.enter),
            (self.CHARGES, stamper.enter_charge),
        ):
            for name, a, k in flows:
                register = registers.get(name)
                if register is None:
                    continue
                number = stamper.function(register)
                stamper.layout.functions[f"{self.name}#{name}"] = number
                ends = (nodes[a], nodes[k]) if self.n else (nodes[k], nodes[a])
                enter(*ends, number, self.parallel)

    def flows(self, layout: Layout) -> Iterator[Flow]:
        """Yield the currents, rates of charges, and what flows through resistances."""
        sign = 1.0 if self.n else -1.0
        resistances = self.resistances(layout.conditions)

        def label(end: str) -> str:
            """Return the terminal of an inner node without a resistance, and of a tied body."""
            if end == "b" and "b" not in self.terminals:
                return "s"
            return end if end.lower() in resistances or end == end.lower() else end.lower()

        for flows, key in ((self.CURRENTS, "f"), (self.CHARGES, "df")):
            for name, a, k in flows:
                number = layout.functions.get(f"{self.name}#{name}")
                if number is not None:
                    term = ((number, sign * self.parallel),)
                    current = Functional(f=term) if key == "f" else Functional(df=term)
                    yield Flow(current, label(a), label(k))
        if self._shunt:
            d, _, s = self.corners
            yield Flow(Functional(z=layout.voltage(d, s, self._shunt)), "d", "s")
        nodes = self.inside(layout.conditions)
        for terminal, ohms in resistances.items():
            inner = nodes[terminal.upper()]
            through = layout.series_current(nodes[terminal], inner, self.parallel / ohms)
            yield Flow(through, terminal, terminal.upper())

    def noise(self, layout: Layout, flicker: Flicker) -> Iterator[NoiseSource]:
        """Yield the noise of the resistances and of the channel."""
        conditions, many = layout.conditions, self.parallel
        temperature = kelvin(conditions, self.temp, self.dtemp)
        nodes = self.inside(conditions)
        for terminal, ohms in self.resistances(conditions).items():
            inner = nodes[terminal.upper()]
            yield thermal_noise(nodes[terminal], inner, many / ohms, temperature)
        number = layout.functions.get(f"{self.name}#channel")
        if number is None:
            return
        d, s = nodes["D"], nodes["S"]
        thermal = 8.0 / 3.0 * BOLTZMANN * temperature * many
        yield NoiseSource(d, s, thermal, function=number, gate=nodes["G"])
        # of one of equal parallel transistors
        own = Flicker(flicker.kf * self.flicker_factor() * many, flicker.af)
        yield from own.sources(d, s, function=number)

    def flicker_factor(self) -> float:
        """Return what ``KF`` is multiplied by: one over the square of the oxide's capacitance."""
        oxide = 3.9 * _EPS0 / (self.card.get("tox") or _OXIDE)
        return 1.0 / oxide**2

    def _initial_voltages(self, voltage: Voltage) -> dict[str, float]:
        """Return initial voltages of the terminals over the source; ``ic=vds,vgs,vbs`` goes first.

        Those of a p-channel transistor are turned round.
        """
        sign = 1.0 if self.n else -1.0
        d, g, s = self.corners
        found = {"s": 0.0}
        for terminal, node, key in (("d", d, "ic"), ("g", g, "icvgs"), ("b", self.body, "icvbs")):
            given = self.given.get(key)
            found[terminal] = sign * (voltage(node) - voltage(s) if given is None else given)
        return found

    def _charges_at(
        self, layout: Layout, charges: Mapping[str, float | None]
    ) -> list[tuple[int, float]]:
        """Return initial charges [A s] by name as shares of rows."""
        nodes = self.inside(layout.conditions)
        found: list[tuple[int, float]] = []
        for name, a, k in self.CHARGES:
            charge = charges.get(name)
            if charge is not None:
                ends = (nodes[a], nodes[k]) if self.n else (nodes[k], nodes[a])
                found += layout.voltage(*ends, self.parallel * charge)
        return found
