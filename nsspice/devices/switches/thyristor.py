"""Thyristor (silicon-controlled rectifier) ``D anode cathode [gate] model`` with an SCR model.

Its characteristic is set-valued at zero current and falls with the current before it rises again:

    v in [-Vrev, phi(0)]  for i = 0,     v = phi(i)  for i > 0,     v = -Vrev + Rrev i  for i < 0

``phi`` is given by ``V={expr(i)}`` up to the current ``alpha``, from where it goes on with the
slope ``Ron`` (T. Roubal, master's thesis, Univ. of West Bohemia 2015, appendix B, example 4.3), or
by breakover voltage, holding voltage and holding current:

    phi(i) = Vh + Ron i + (Vbo - Vh) max(0, 1 - i/Ih)^2 max(0, 1 - ig/Igt)

The current ``ig`` from gate to cathode lowers the breakover, at ``Igt`` to the holding voltage: the
thyristor then is a diode.  Once the current exceeds ``Ih`` the gate has no more influence.

A card with neither a curve nor a holding current is the ideal thyristor of
``latching_thyristor.py``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from ...netlist.expressions.expression import Expression
from ...problems.descriptor import Functional
from ..device import NO_VALUES, Context, Device, Edge, check_flags
from ..diodes.leg_device import SIZE, series_drop, size_of
from ..effect import Effect
from ..outputs import plus, scaled
from ..parameter import Table, inert
from ..signals import register_of, shown
from ..stamper import Layout, Stamper
from .thyristor_card import CARD, EFFECTS, check_card, latches

if TYPE_CHECKING:
    from ...netlist.deck import Element


class Thyristor(Device):
    """A thyristor: a forward branch with a falling curve, a reverse branch, a gate."""

    KIND = "thyristor"
    FLAGS: ClassVar[tuple[str, ...]] = ("off",)
    INSTANCE = Table(
        *SIZE,
        inert("ic", "initial voltage (no charge is stored)", "V"),
        inert("temp", "temperature (the law has none)", "C"),
        inert("dtemp", "temperature difference", "K"),
    )
    MODEL = CARD
    terminals = ("a", "k", "g")
    shows_current = True
    smooth = True
    late = True
    NOISE = ()
    __slots__ = ("card", "curve", "parallel", "sources")

    def __init__(
        self, element: Element, card: Mapping[str, float], curve: Expression | None, parallel: float
    ) -> None:
        super().__init__(element)
        self.card = card
        #: phi as an expression, None for the one of breakover and holding
        self.curve = curve
        self.parallel = parallel
        self.sources = {}
        listed = [Effect("thyristor")] if curve is None else [Effect(f"curve {shown(curve)}")]
        listed += [
            Effect(name, key, card[key] * parallel**factor, unit)
            for key, name, unit, factor in EFFECTS
            if key in card
        ]
        self.effects = tuple(listed)

    @classmethod
    def read(cls, element: Element, context: Context) -> Thyristor | None:
        """Return the thyristor of an element line, or None after reporting why not."""
        findings = context.findings
        model = element.model
        assert model is not None
        check_flags(cls, element, findings)
        params = {key: p for key, p in element.params.items() if key != "v"}
        given = cls.INSTANCE.read(params, element.name, findings)
        parallel = size_of(element, given, findings)
        card = context.cards.get(id(model))
        if card is None:
            params = {key: p for key, p in model.params.items() if key != "v"}
            card = CARD.read(params, f"model {model.name}", findings)
            context.cards[id(model)] = card
        before = len(findings.errors)
        curve = series_drop(element, model, findings)
        check_card(element, model, card, curve, findings)
        if parallel is None or len(findings.errors) > before:
            return None
        if latches(card, curve):
            from .latching_thyristor import LatchingThyristor

            return LatchingThyristor(element, card, None, parallel)
        return cls(element, card, curve, parallel)

    @property
    def gate(self) -> str | None:
        """Node of the gate, None without one."""
        return self.nodes[2] if len(self.nodes) > 2 else None

    @property
    def pair_count(self) -> int:
        """Number of complementarity pairs: forward, reverse, gate."""
        return 1 + ("vrev" in self.card) + (self.gate is not None)

    @property
    def expressions(self) -> tuple[Expression, ...]:
        """Return the forward curve, if it is an expression."""
        return () if self.curve is None else (self.curve,)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one branch for each pair."""
        a, k = self.ends
        main = tuple(Edge("P", a, k) for _ in range(1 + ("vrev" in self.card)))
        return main if self.gate is None else (*main, Edge("P", self.gate, k))

    def _stamp_pairs(self, stamper: Stamper, forward: int) -> int | None:
        """Write reverse breakdown and gate; return the gate current, None without one."""
        a, k = self.ends
        name, card, layout = self.name, self.card, stamper.layout
        pairs, gate = [forward], None
        if "vrev" in card:
            slope = card.get("rrev", card.get("ron", 0.0)) / self.parallel
            pairs.append(stamper.pair(f"{name}.rev", name, k, a, card["vrev"], slope))
        if self.gate is not None:
            series = card.get("rg", 0.0) / self.parallel
            drop = card.get("vgt", 0.0)
            pairs.append(stamper.pair(f"{name}.gate", name, self.gate, k, drop, series))
            gate = stamper.as_unknown(f"{name}.g", Functional(lam=((pairs[-1], 1.0),)))
        layout.pairs[name] = tuple(pairs)
        return gate

    def allocate(self, stamper: Stamper) -> None:
        """Reserve the current of the forward branch, which its curve reads."""
        stamper.branch(self.name)

    def stamp(self, stamper: Stamper) -> None:
        """Write ``-(va - vx) + phi(i, ig) = 0``, the pairs, and the gate."""
        a, k = self.ends
        name = self.name
        branch = stamper.layout.branches[name]
        inner = stamper.internal_node(f"{name}#drop", name)
        stamper.connect(branch, a, inner)
        gate = self._stamp_pairs(stamper, stamper.pair(f"{name}.fwd", name, inner, k, 0.0, 0.0))
        register = (
            self._curve(stamper, branch) if self.curve else self._thyristor(stamper, branch, gate)
        )
        stamper.F.add(branch, stamper.function(register), 1.0)

    def _share(self, stamper: Stamper, unknown: int) -> int:
        """Return the register of the current of one of the parallel elements."""
        own = stamper.tape.unknown(unknown)
        if self.parallel == 1.0:
            return own
        return stamper.tape.op("div", own, stamper.tape.constant(self.parallel))

    def _curve(self, stamper: Stamper, branch: int) -> int:
        """Return the given curve, straight below zero and above its end."""
        assert self.curve is not None
        tape, card = stamper.tape, self.card
        own = self._share(stamper, branch)
        slope, zero = tape.constant(card.get("ron", 0.0)), tape.constant(0.0)

        def at(current: int) -> int:
            return register_of(stamper, self.curve, self.sources, current)  # type: ignore[arg-type]

        total = at(own)
        alpha = card.get("alpha", math.inf)
        if math.isfinite(alpha):
            end = tape.constant(alpha)
            above = tape.op("mul", slope, tape.op("sub", own, end))
            above = tape.op("add", at(end), above)
            total = tape.op("if", tape.op("gt", own, end), above, total)
        below = tape.op("add", at(zero), tape.op("mul", slope, own))
        return tape.op("if", tape.op("lt", own, zero), below, total)

    def _thyristor(self, stamper: Stamper, branch: int, gate: int | None) -> int:
        """Return the curve of breakover and holding."""
        tape, card = stamper.tape, self.card
        own = self._share(stamper, branch)
        one, zero = tape.constant(1.0), tape.constant(0.0)

        def left(current: int, limit: float) -> int:
            ratio = tape.op("div", current, tape.constant(limit))
            return tape.op("max", zero, tape.op("sub", one, ratio))

        height = tape.constant(card["vbo"] - card.get("vh", 0.0))
        # straight below zero, where no current flows: the square would grow without end
        within = tape.op("max", own, zero)
        fall = tape.op("mul", height, tape.op("square", left(within, card["ih"])))
        if gate is not None:
            fall = tape.op("mul", fall, left(self._share(stamper, gate), card["igt"]))
        rise = tape.op("mul", tape.constant(card.get("ron", 0.0)), own)
        return tape.op("add", tape.op("add", tape.constant(card.get("vh", 0.0)), rise), fall)

    def terminal_current(self, layout: Layout, terminal: str) -> Functional:
        """Return the current into anode, cathode or gate."""
        if terminal == "k":
            both = self.terminal_current(layout, "a")
            if self.gate is not None:
                both = plus(both, self.terminal_current(layout, "g"))
            return scaled(both, -1.0)
        if terminal == "g":
            return Functional() if self.gate is None else layout.branch(f"{self.name}.g")
        forward = self._forward(layout)
        if "vrev" not in self.card:
            return forward
        return plus(forward, Functional(lam=((layout.pairs[self.name][1], -1.0),)))

    def _forward(self, layout: Layout) -> Functional:
        """Return the forward current."""
        return layout.branch(self.name)

    def current(self, layout: Layout) -> Functional:
        """Return the current into the anode."""
        return self.terminal_current(layout, "a")

    @property
    def powers(self) -> tuple[tuple[str, str, str], ...]:
        """Return current and two nodes of each product that adds to the power."""
        main = (self.name, *self.ends)
        return (main,) if self.gate is None else (main, (f"{self.name}.g", self.gate, self.ends[1]))
