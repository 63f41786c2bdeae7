"""A diode law between two nodes: the body of a D element, or one junction of a transistor.

A leg is a set-valued curve or a smooth junction, with a smooth drop ``V={expr(i)}`` in series if
the deck gives one.  It is written between any two nodes under a name of its own, so that a diode
has one leg and an Ebers-Moll transistor has two.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from ...netlist.expressions.expression import Expression
from ...problems.descriptor import Functional
from ..effect import Effect
from ..signals import own_current, register_of, shown
from ..stamper import Layout, Stamper
from ..valve import Valve
from .characteristic import Decomposition

if TYPE_CHECKING:
    from ..carrier import Carrier
    from ..device import EdgeKind
    from .junction import JunctionLaw

#: voltage of a node by name, for initial charges
Voltage = Callable[[str], float]


class Body(Protocol):
    """What a leg is without a drop in series."""

    @property
    def pair_count(self) -> int:
        """Number of complementarity pairs."""

    @property
    def smooth(self) -> bool:
        """True if the law has a smooth nonlinear part."""

    @property
    def stores_energy(self) -> bool:
        """True if the law has a charge."""

    @property
    def effects(self) -> tuple[Effect, ...]:
        """What the deck called for."""

    @property
    def kinds(self) -> tuple[EdgeKind, ...]:
        """Kinds of the parallel branches in the circuit graph."""

    def stamp(self, stamper: Stamper, name: str, element: str, a: str, b: str) -> None:
        """Write the law between two nodes."""

    def current(self, layout: Layout, name: str, a: str, b: str) -> Functional:
        """Return the current from a to b as an output."""

    def charge(self, layout: Layout, name: str, a: str, b: str, v: float) -> tuple[str, str, float]:
        """Return the charge [A s] at a voltage and the nodes between which it is."""


@dataclass(frozen=True, slots=True)
class CurveBody:
    """A set-valued curve: an off-conductance in parallel with pairs."""

    parts: Decomposition
    effects: tuple[Effect, ...]

    @property
    def pair_count(self) -> int:
        """Number of complementarity pairs."""
        return len(self.parts.pairs)

    @property
    def smooth(self) -> bool:
        """Return False."""
        return False

    @property
    def stores_energy(self) -> bool:
        """Return False."""
        return False

    @property
    def kinds(self) -> tuple[EdgeKind, ...]:
        """Return one branch per pair and one for the leakage."""
        pairs: tuple[EdgeKind, ...] = tuple("P" for _ in self.parts.pairs)
        return (*pairs, "R") if self.parts.conductance else pairs

    def stamp(self, stamper: Stamper, name: str, element: str, a: str, b: str) -> None:
        """Write the off-conductance and the pairs."""
        parts = self.parts
        if parts.conductance:
            stamper.conductance(a, b, parts.conductance)
        single = len(parts.pairs) == 1
        stamper.layout.pairs[name] = tuple(
            stamper.pair(name if single else f"{name}.fwd", element, a, b, p.offset, p.resistance)
            if p.forward
            else stamper.pair(f"{name}.rev", element, b, a, p.offset, p.resistance)
            for p in parts.pairs
        )

    def current(self, layout: Layout, name: str, a: str, b: str) -> Functional:
        """Return leakage plus forward minus reverse multiplier."""
        lam = tuple(
            (index, 1.0 if pair.forward else -1.0)
            for index, pair in zip(layout.pairs[name], self.parts.pairs, strict=True)
        )
        if not self.parts.conductance:
            return Functional(lam=lam)
        return Functional(z=layout.voltage(a, b, self.parts.conductance), lam=lam)

    def charge(self, layout: Layout, name: str, a: str, b: str, v: float) -> tuple[str, str, float]:
        """Return zero: nothing is stored."""
        return a, b, 0.0


@dataclass(frozen=True, slots=True)
class JunctionBody:
    """A smooth junction; with an ohmic resistance it has a node inside.

    Parameters
    ----------
    law : JunctionLaw
    parallel : float
        Number of equal junctions, or area.
    temp : float or None
        Own temperature [degrees Celsius].
    dtemp : float
        Above the circuit's [K].
    """

    law: JunctionLaw
    parallel: float = 1.0
    temp: float | None = None
    dtemp: float = 0.0

    @property
    def pair_count(self) -> int:
        """Return zero."""
        return 0

    @property
    def smooth(self) -> bool:
        """Return True."""
        return True

    @property
    def stores_energy(self) -> bool:
        """Return whether the junction has a charge."""
        return self.law.stores_charge

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Return what the model card called for."""
        return self.law.effects(self.parallel)

    @property
    def kinds(self) -> tuple[EdgeKind, ...]:
        """Return one resistive branch."""
        return ("R",)

    def stamp(self, stamper: Stamper, name: str, element: str, a: str, b: str) -> None:
        """Write the current and the rate of the charge."""
        tape, layout = stamper.tape, stamper.layout
        junction = self.law.at(layout.conditions, self.temp, self.dtemp)
        inner = a
        if self.law.rs:
            inner = f"{name}#internal"
            ohms = junction.resistance / self.parallel
            stamper.series_resistance(a, inner, element, ohms, held=bool(self.law.cjo))
        v = stamper.voltage_register(inner, b)
        current = stamper.function(junction.write_current(tape, v))
        stamper.enter(inner, b, current, self.parallel)
        layout.functions[name] = current
        if self.law.stores_charge:
            charge = stamper.function(junction.write_charge(tape, v))
            stamper.enter_charge(inner, b, charge, self.parallel)
            layout.functions[f"{name}#charge"] = charge

    def current(self, layout: Layout, name: str, a: str, b: str) -> Functional:
        """Return the current through the resistance, or the function and its charge's rate."""
        if self.law.rs:
            resistance = self.law.at(layout.conditions, self.temp, self.dtemp).resistance
            return layout.series_current(a, f"{name}#internal", self.parallel / resistance)
        charge = layout.functions.get(f"{name}#charge")
        return Functional(
            f=((layout.functions[name], self.parallel),),
            df=() if charge is None else ((charge, self.parallel),),
        )

    def charge(self, layout: Layout, name: str, a: str, b: str, v: float) -> tuple[str, str, float]:
        """Return the charge [A s] at a voltage and the nodes between which it is."""
        junction = self.law.at(layout.conditions, self.temp, self.dtemp)
        inner = f"{name}#internal" if self.law.rs else a
        return inner, b, self.parallel * junction.charge(v)


class Leg:
    """A diode law between two nodes.

    Parameters
    ----------
    body : Body
    drop : Expression, optional
        Voltage in series as a function of the current ``i`` of one element.
    parallel : float
        Number of equal elements.
    """

    __slots__ = ("body", "drop", "parallel")

    def __init__(self, body: Body, drop: Expression | None = None, parallel: float = 1.0) -> None:
        self.body = body
        self.drop = drop
        self.parallel = parallel

    @property
    def smooth(self) -> bool:
        """True if the law has a smooth nonlinear part."""
        return self.body.smooth or self.drop is not None

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Return what the deck called for."""
        if self.drop is None:
            return self.body.effects
        return (*self.body.effects, Effect(f"smooth series drop {shown(self.drop)}"))

    def allocate(self, stamper: Stamper, name: str) -> None:
        """Reserve the current of a leg with a drop, which the drop reads."""
        if self.drop is not None:
            stamper.branch(name)

    def stamp(
        self,
        stamper: Stamper,
        name: str,
        element: str,
        a: str,
        b: str,
        sources: Mapping[str, Carrier],
    ) -> None:
        """Write the law between two nodes; one with a drop must have been allocated."""
        if self.drop is None:
            self.body.stamp(stamper, name, element, a, b)
            return
        branch = stamper.layout.branches[name]
        inner = stamper.internal_node(f"{name}#drop", element)
        stamper.connect(branch, a, inner)
        self.body.stamp(stamper, name, element, inner, b)
        own = own_current(stamper, branch, self.parallel)
        register = register_of(stamper, self.drop, sources, own)
        stamper.F.add(branch, stamper.function(register), 1.0)

    def charge(self, layout: Layout, name: str, a: str, b: str, v: float) -> tuple[str, str, float]:
        """Return the charge [A s] at a voltage and the nodes between which it is."""
        return self.body.charge(layout, name, a if self.drop is None else f"{name}#drop", b, v)

    def current(self, layout: Layout, name: str, a: str, b: str) -> Functional:
        """Return the current from a to b as an output."""
        if self.drop is not None:
            return layout.branch(name)
        return self.body.current(layout, name, a, b)

    def valves(self, layout: Layout, name: str) -> Iterator[Valve]:
        """Yield the forward pair of a set-valued law."""
        if isinstance(self.body, CurveBody):
            for pair, one in zip(layout.pairs.get(name, ()), self.body.parts.pairs, strict=True):
                if one.forward:
                    yield Valve("diode", pair, self.parallel)
