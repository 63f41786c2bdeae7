"""Switches ``S a b c d model [on|off]`` (by voltage) and ``W a b vname model`` (by current).

Ideal unless the model gives ``RON`` or ``ROFF``: closed it is a short, open it is nothing.  It
closes when the control rises above ``VT + VH`` and opens when it falls below ``VT - VH``; in
between it keeps its state.  The stamp is the conductance of the less conducting state in parallel
with one switched pair whose series resistance makes the other state exact.

PSpice's ``VSWITCH(VON VOFF)`` blends its resistance between the two voltages; here it switches at
them: closed above VON, open below VOFF, which is a threshold in the middle with half the difference
as hysteresis.  So does LTspice's ``SW`` with a negative ``VH``, which blends between VT - |VH| and
VT + |VH|.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from ...netlist.findings import Findings
from ...problems.descriptor import Functional, Switch
from ..carrier import Carrier
from ..device import NO_VALUES, Context, Device, Edge, check_flags, check_model
from ..effect import Effect
from ..heat.switching_loss import SWITCH_LOSSES
from ..parameter import Parameter, Table, refused
from ..stamper import Layout, Stamper
from ..valve import Valve

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model


@dataclass(frozen=True, slots=True)
class SwitchLaw:
    """What a switch model says: resistances [Ohm] and thresholds [V or A]."""

    ron: float
    roff: float
    on_above: float
    off_below: float
    inverted: bool
    given: tuple[tuple[str, float], ...]

    @property
    def conductance(self) -> float:
        """Conductance [S] of the less conducting state."""
        high = max(self.ron, self.roff)
        return 0.0 if math.isinf(high) else 1.0 / high

    @property
    def has_pair(self) -> bool:
        """False for a switch whose two states are equal."""
        return self.ron != self.roff

    @property
    def series(self) -> float:
        """Series resistance [Ohm] of the pair."""
        low, high = sorted((self.ron, self.roff))
        return low if math.isinf(high) else low * high / (high - low)

    @property
    def active_below(self) -> bool:
        """True if the pair conducts while the control is low."""
        return self.inverted != (self.ron > self.roff)


_REFUSED = (
    refused("lser", "series inductance", "put an inductor in series", "H"),
    refused("vser", "series voltage", "put a voltage source in series", "V"),
    refused("ilimit", "current limit", "leave it out", "A"),
    refused("epsilon", "smooth transition", "write epsilon=0"),
    refused("level", "model level", "use level=1", neutral=(1.0,)),
)
#: instead of what Xyce adds
_PAIR = "remove it: between the on and off voltages the switch keeps its state"
_RESISTANCES = (
    Parameter("ron", "resistance while closed", "Ohm", 0.0),
    Parameter("roff", "resistance while open", "Ohm", math.inf),
)


class _Switch(Device):
    """Base of S and W."""

    TYPES: ClassVar[tuple[str, ...]] = ()
    SMOOTH_TYPE: ClassVar[str] = ""
    LETTER: ClassVar[str] = ""
    FLAGS: ClassVar[tuple[str, ...]] = ("on", "off")
    INSTANCE = Table(Parameter("m", "number of equal switches in parallel", "", 1.0))
    shows_current = True
    NOISE = ()
    __slots__ = ("law", "m", "starts_on")

    def __init__(self, element: Element, law: SwitchLaw, m: float) -> None:
        super().__init__(element)
        self.law = law
        self.m = m
        self.starts_on = "on" in element.flags
        self.effects = (
            Effect("switching"),
            *(Effect(_EFFECTS.get(key, key), key, value) for key, value in law.given),
            *([Effect("starts closed", "on")] if self.starts_on else []),
        )

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the switch of an element line, or None after reporting why not."""
        findings = context.findings
        check_flags(cls, element, findings)
        given = cls.INSTANCE.read(element.params, element.name, findings)
        model = element.model
        if not check_model(element, cls.TYPES, context, required=True) or model is None:
            return None
        law = context.models.get(id(model))
        if law is None:
            law = _read_law(cls, model, findings) or "wrong"
            context.models[id(model)] = law
        return cls(element, law, given.get("m", 1.0)) if isinstance(law, SwitchLaw) else None

    @property
    def pair_count(self) -> int:
        """Return 1, or 0 for a switch whose two states are equal."""
        return int(self.law.has_pair)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return a branch for the pair and one for the conductance."""
        a, b = self.nodes
        pair = (Edge("P", a, b),) if self.law.has_pair else ()
        return (*pair, Edge("R", a, b)) if self.law.conductance else pair

    def _stamp_pair(self, stamper: Stamper) -> None:
        """Write conductance and pair."""
        law = self.law
        if law.conductance:
            stamper.conductance(*self.ends, law.conductance * self.m)
        if law.has_pair:
            pair = stamper.pair(self.name, self.name, *self.ends, 0.0, law.series / self.m)
            stamper.layout.pairs[self.name] = (pair,)

    def _stamp_control(self, stamper: Stamper, control: tuple[tuple[int, float], ...]) -> None:
        """Set in the system what opens and closes the pair."""
        law = self.law
        if law.has_pair:
            pair = stamper.layout.pairs[self.name][0]
            # the state of the switch (on or off) decides with RON > ROFF which one conducts
            conducts = self.starts_on != (law.ron > law.roff)
            stamper.switches.append(
                Switch(pair, control, law.on_above, law.off_below, conducts, law.active_below)
            )

    def current(self, layout: Layout) -> Functional:
        """Return leakage plus multiplier."""
        pairs = layout.pairs.get(self.name, ())
        z = layout.voltage(*self.ends, self.law.conductance * self.m)
        return Functional(z=z if self.law.conductance else (), lam=tuple((p, 1.0) for p in pairs))

    def valves(self, layout: Layout) -> Iterator[Valve]:
        """Yield the pair of a switch whose states differ."""
        for pair in layout.pairs.get(self.name, ()):
            yield Valve("switch", pair, self.m, self.law.ron > self.law.roff)


class VoltageSwitch(_Switch):
    """``S a b c d model``: controlled by vc - vd."""

    KIND = "switch"
    TYPES = ("sw", "vswitch")
    SMOOTH_TYPE = "vswitch"
    LETTER = "v"
    MODEL = Table(
        *_RESISTANCES,
        Parameter("vt", "threshold", "V", 0.0),
        Parameter("vh", "hysteresis: half the width", "V", 0.0),
        *SWITCH_LOSSES,
        *_REFUSED,
    )
    SMOOTH_MODEL = Table(
        *_RESISTANCES,
        Parameter("von", "closed above", "V", 1.0),
        Parameter("voff", "open below", "V", 0.0),
        *SWITCH_LOSSES,
        refused("vhon", "a second threshold", _PAIR, "V", neutral=()),
        refused("vhoff", "a second threshold", _PAIR, "V", neutral=()),
    )
    __slots__ = ()

    @property
    def control_nodes(self) -> tuple[str, ...]:
        """Return the two controlling nodes."""
        return self.controls

    def stamp(self, stamper: Stamper) -> None:
        """Write the pair and its control voltage."""
        self._stamp_pair(stamper)
        layout = stamper.layout
        self._stamp_control(stamper, layout.voltage(self.controls[0], self.controls[1]))


class CurrentSwitch(_Switch):
    """``W a b vname model``: controlled by the current of another element."""

    KIND = "switch"
    TYPES = ("csw", "iswitch")
    SMOOTH_TYPE = "iswitch"
    LETTER = "i"
    MODEL = Table(
        *_RESISTANCES,
        Parameter("it", "threshold", "A", 0.0),
        Parameter("ih", "hysteresis: half the width", "A", 0.0),
        *SWITCH_LOSSES,
        *_REFUSED,
    )
    SMOOTH_MODEL = Table(
        *_RESISTANCES,
        Parameter("ion", "closed above", "A", 1e-3),
        Parameter("ioff", "open below", "A", 0.0),
        *SWITCH_LOSSES,
        refused("ihon", "a second threshold", _PAIR, "A", neutral=()),
        refused("ihoff", "a second threshold", _PAIR, "A", neutral=()),
    )
    late = True
    __slots__ = ("control",)

    def __init__(self, element: Element, law: SwitchLaw, m: float) -> None:
        super().__init__(element, law, m)
        #: set by the circuit once all names are known
        self.control: Carrier | None = None

    @property
    def control_elements(self) -> tuple[str, ...]:
        """Return the element whose current is read."""
        return self.controls

    def allocate(self, stamper: Stamper) -> None:
        """Write the pair, whose current others may read."""
        self._stamp_pair(stamper)

    def stamp(self, stamper: Stamper) -> None:
        """Write the control; a current that is not an unknown yet becomes one."""
        layout = stamper.layout
        control = self.control.current(layout) if self.control is not None else Functional()
        self._stamp_control(stamper, stamper.of_unknowns(self.controls[0], control))


_EFFECTS = {
    "ron": "on-resistance",
    "roff": "off-resistance",
    "vt": "threshold",
    "it": "threshold",
    "vh": "hysteresis",
    "ih": "hysteresis",
    "von": "closing threshold",
    "voff": "opening threshold",
    "ion": "closing threshold",
    "ioff": "opening threshold",
}


def _read_law(
    device: type[VoltageSwitch] | type[CurrentSwitch] | type[_Switch],
    model: Model,
    findings: Findings,
) -> SwitchLaw | None:
    """Return the law of a switch model, or None after reporting why not."""
    owner = f"model {model.name}"
    letter = device.LETTER
    before = len(findings.errors)
    smooth = model.type == device.SMOOTH_TYPE
    table: Table = getattr(device, "SMOOTH_MODEL" if smooth else "MODEL")
    given = table.read(model.params, owner, findings)
    ron, roff = given.get("ron", 0.0), given.get("roff", math.inf)
    if ron < 0.0 or roff < 0.0 or ron == roff == 0.0:
        findings.error(
            "NS2005",
            f"{owner}: ron={ron:g} and roff={roff:g} Ohm must be >= 0 and not both 0",
            model.span,
            "for a permanent short circuit use a 0 Ohm resistor",
        )
    inverted = False
    if smooth:
        default_on = 1.0 if letter == "v" else 1e-3
        on, off = given.get(f"{letter}on", default_on), given.get(f"{letter}off", 0.0)
        on_above, off_below, inverted = max(on, off), min(on, off), on < off
        findings.warning(
            "NS2055",
            f"{owner} ({model.type}) switches at {letter}on={on:g} and {letter}off={off:g} with "
            "hysteresis between them instead of blending its resistance",
            model.span,
        )
    else:
        threshold, width = given.get(f"{letter}t", 0.0), given.get(f"{letter}h", 0.0)
        if width < 0.0:
            width = -width
            findings.warning(
                "NS2055",
                f"{owner}: a negative {letter}h requests a smooth transition; the switch closes at "
                f"{threshold + width:g} and opens at {threshold - width:g} instead",
                model.params[f"{letter}h"].span,
                f"write {letter}h=0, or a positive hysteresis",
            )
        on_above, off_below = threshold + width, threshold - width
    if len(findings.errors) > before:
        return None
    return SwitchLaw(ron, roff, on_above, off_below, inverted, tuple(given.items()))
