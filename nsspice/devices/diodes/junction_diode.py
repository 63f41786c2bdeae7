"""Smooth diode ``D a b model [area]`` whose model card is SPICE's junction."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..device import Context, check_flags
from ..noise import Flicker, NoiseSource, shot_noise, thermal_noise
from ..parameter import Parameter, Table
from ..stamper import Conditions, Layout
from ..temperature import kelvin
from .broken_junction import BrokenJunction, as_lines
from .characteristic import Characteristic
from .diode_branch import JunctionBody, Leg, Voltage
from .junction import JunctionLaw
from .junction_card import SIDEWALL, read_junction
from .leg_device import GEOMETRY, SIZE, LegDevice, series_drop, size_of

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model

_SET_VALUED = ("vfwd", "ron", "roff", "vrev", "rrev")


class JunctionDiode(LegDevice):
    """A smooth junction, with the effects that its model card gives."""

    INSTANCE = Table(
        *SIZE,
        Parameter("temp", "temperature of this diode", "C"),
        Parameter("dtemp", "temperature above the circuit's", "K", 0.0),
        Parameter("ic", "initial voltage, used with uic", "V"),
        *GEOMETRY,
    )
    NOISE = ("thermal", "shot", "flicker")
    __slots__ = ("ic", "law")

    def __init__(self, element: Element, law: JunctionLaw, leg: Leg, ic: float | None) -> None:
        super().__init__(element, leg)
        self.law = law
        self.ic = ic

    @classmethod
    def read(cls, element: Element, context: Context) -> JunctionDiode | None:
        """Return the diode of an element line, or None after reporting why not."""
        findings = context.findings
        model = element.model
        assert model is not None
        check_flags(cls, element, findings)
        wrong = [key for key in _SET_VALUED if key in element.params]
        if wrong:
            findings.error(
                "NS2005",
                f"{element.name} gives {wrong[0]}, but its model {model.name} is a smooth junction",
                element.params[wrong[0]].span,
                f"write {model.name} with set-valued parameters, or remove {wrong[0]}",
            )
            return None
        sized = [key for key in ("w", "l") if key in element.params]
        if sized and "level" in model.params and model.params["level"].value == 3.0:
            findings.error(
                "NS2008",
                f"{sized[0]} of {element.name} (size of a level 3 diode) is not simulated",
                element.params[sized[0]].span,
                "give area=",
            )
        length = element.params.get("pj")
        wall = [key for key in SIDEWALL if key in model.params and model.params[key].value != 0.0]
        if wall and length is not None and length.value != 0.0:
            findings.error(
                "NS2008",
                f"{wall[0]} of model {model.name} (sidewall) with pj of {element.name} is not "
                "simulated",
                length.span,
                "put a diode and a capacitor in parallel",
            )
        params = {key: p for key, p in element.params.items() if key != "v"}
        given = cls.INSTANCE.read(params, element.name, findings)
        parallel = size_of(element, given, findings)
        law = junction_law(model, context)
        if law is None or parallel is None:
            return None
        smooth = JunctionBody(law, parallel, given.get("temp"), given.get("dtemp", 0.0))
        body = as_lines(smooth, element, context)
        if body is None:
            return None
        drop = series_drop(element, model, findings)
        return cls(element, law, Leg(body, drop, parallel), given.get("ic"))

    def initial_charges(self, layout: Layout, voltage: Voltage) -> list[tuple[int, float]]:
        """Return the charge from which a run with ``uic`` starts; ``ic=`` goes first."""
        a, b = self.ends
        v = voltage(a) - voltage(b) if self.ic is None else self.ic
        return list(layout.voltage(*self.leg.charge(layout, self.name, a, b, v)))

    def curve(self, conditions: Conditions) -> Characteristic | None:
        """Return broken lines in place of the junction, None if it is smooth or has a charge."""
        body = self.leg.body
        if isinstance(body, BrokenJunction) and not body.stores_energy:
            return body.curve(conditions)
        return None

    def noise(self, layout: Layout, flicker: Flicker) -> Iterator[NoiseSource]:
        """Yield the noise of the ohmic resistance and of the junction behind it."""
        name, body, conditions, (a, b) = self.name, self.leg.body, layout.conditions, self.ends
        assert isinstance(body, JunctionBody | BrokenJunction)
        if self.leg.drop is not None:
            a = f"{name}#drop"
        if self.law.rs:
            resistance = self.law.at(conditions, body.temp, body.dtemp).resistance
            inner = f"{name}#internal"
            temperature = kelvin(conditions, body.temp, body.dtemp)
            yield thermal_noise(a, inner, body.parallel / resistance, temperature)
            a = inner
        yield shot_noise(a, b, f"i({name})")
        yield from flicker.sources(a, b, f"i({name})")


def junction_law(model: Model, context: Context) -> JunctionLaw | None:
    """Return the smooth junction of a model card, read once; None after reporting why not."""
    known = context.models.get(id(model))
    if known is None:
        known = context.models[id(model)] = read_junction(model, context.findings) or "wrong"
    return known if isinstance(known, JunctionLaw) else None
