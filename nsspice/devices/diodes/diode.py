"""Set-valued diode ``D a b [model] [area]``: conduction plus the effects that its model gives.

Without a model, or with ``D(ideal)``, the diode is ideal: no drop, no resistance, no leakage.  With
``Vfwd`` and ``Vrev`` it is the practical (Zener) diode; ``Ron``, ``Rrev`` and ``Roff`` tilt the
pieces of its curve.  On the conducting piece the slope is exactly ``Ron``; the corner is at
``Vfwd``.  ``V={expr(i)}`` adds a smooth drop in series, on the model card or on the element line.
A model card without set-valued parameters is SPICE's smooth junction.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

from ...netlist.findings import Findings
from ..device import Context, Device, check_flags, check_model
from ..effect import Effect
from ..heat.switching_loss import DIODE_LOSSES
from ..parameter import Parameter, Table, inert, refused
from .characteristic import Characteristic, Decomposition, diode_curve
from .diode_branch import CurveBody, Leg
from .leg_device import GEOMETRY, SIZE, LegDevice, series_drop, size_of

if TYPE_CHECKING:
    from ...errors import Span
    from ...netlist.deck import Element, Model, Param
    from ..stamper import Conditions, Layout
    from ..valve import Valve

_SMOOTH = "remove it, or remove the set-valued parameters for a smooth junction"


#: the set-valued effects, on the model card or on the element line, which goes first
_EFFECTS = (
    Parameter("vfwd", "forward drop", "V"),
    Parameter("ron", "resistance while it conducts", "Ohm"),
    Parameter("roff", "resistance while it blocks", "Ohm"),
    Parameter("vrev", "breakdown voltage, positive", "V"),
    Parameter("rrev", "resistance in breakdown, default ron", "Ohm"),
)
_NAMES = tuple(p.name for p in _EFFECTS)
#: parameters that make a model card set-valued
SET_VALUED = ("ideal", "vfwd", "vrev", "ron", "rrev", "roff")


@dataclass(frozen=True, slots=True)
class DiodeLaw:
    """The effects of one model card; None stands for an absent effect."""

    vfwd: float | None = None
    ron: float | None = None
    roff: float | None = None
    vrev: float | None = None
    rrev: float | None = None

    def curve(self, parallel: float = 1.0) -> Characteristic:
        """Return the curve of ``parallel`` equal diodes."""
        ron = self.ron or 0.0
        rrev = ron if self.rrev is None else self.rrev
        roff = math.inf if self.roff is None else self.roff
        return diode_curve(
            self.vfwd or 0.0, ron / parallel, roff / parallel, self.vrev, rrev / parallel
        )

    def effects(self, parallel: float) -> tuple[Effect, ...]:
        """Return what the model card called for."""
        listed = [
            Effect("forward drop", "vfwd", self.vfwd, "V"),
            Effect("on-resistance", "ron", _over(self.ron, parallel), "Ohm"),
            Effect("breakdown", "vrev", self.vrev, "V"),
            Effect("breakdown resistance", "rrev", _over(self.rrev, parallel), "Ohm"),
            Effect("leakage", "roff", _over(self.roff, parallel), "Ohm"),
        ]
        return (Effect("conduction"), *(e for e in listed if e.value is not None))


def _over(value: float | None, parallel: float) -> float | None:
    return None if value is None else value / parallel


IDEAL = DiodeLaw()


class Diode(LegDevice):
    """A set-valued diode: an off-conductance in parallel with one or two pairs.

    With ``V={expr(i)}`` a smooth drop is in series with them.
    """

    INSTANCE = Table(
        *SIZE,
        *_EFFECTS,
        inert("ic", "initial voltage (no charge is stored)", "V"),
        inert("temp", "temperature (piecewise-linear laws have none)", "C"),
        inert("dtemp", "temperature difference", "K"),
        *GEOMETRY,
    )
    MODEL = Table(
        Parameter("ideal", "an ideal diode"),
        *_EFFECTS,
        *DIODE_LOSSES,
        refused("epsilon", "width of a rounded corner", "the corner is sharp: write epsilon=0"),
        refused("revepsilon", "width of a rounded corner", "the corner is sharp: revepsilon=0"),
        refused("ilimit", "current limit", "remove it, or limit the current with a source"),
        refused("revilimit", "reverse current limit", "leave it out"),
        refused("rs", "ohmic resistance", "add it to ron"),
        refused("cjo", "junction capacitance", "put a capacitor in parallel"),
        refused("cj0", "junction capacitance", "put a capacitor in parallel"),
        refused("cj", "junction capacitance", "put a capacitor in parallel"),
        refused("tt", "transit time", _SMOOTH),
        refused("bv", "SPICE breakdown", "use vrev"),
        inert("ibv", "SPICE breakdown current", "A"),
        inert("is", "saturation current", "A"),
        inert("js", "saturation current", "A"),
        inert("n", "emission coefficient"),
        inert("eg", "band gap", "eV"),
        inert("xti", "temperature exponent"),
        inert("vj", "junction potential", "V"),
        inert("m", "grading coefficient"),
        inert("mj", "grading coefficient"),
        inert("fc", "forward capacitance coefficient"),
        inert("tnom", "nominal temperature", "C"),
        inert("t_abs", "temperature (piecewise-linear laws have none)", "C"),
        inert("kf", "flicker noise"),
        inert("af", "flicker noise"),
        inert("level", "model level"),
        inert("iave", "rating: mean current", "A"),
        inert("ipk", "rating: peak current", "A"),
        inert("vpk", "rating: peak voltage", "V"),
        inert("irms", "rating: current", "A"),
        inert("mfg", "manufacturer"),
        inert("type", "kind of diode"),
    )
    FLAGS: ClassVar[tuple[str, ...]] = ("on", "off")
    NOISE = ()
    __slots__ = ("law", "parts")

    def __init__(self, element: Element, law: DiodeLaw, leg: Leg, parts: Decomposition) -> None:
        super().__init__(element, leg)
        self.law = law
        self.parts = parts

    @classmethod
    def read(cls, element: Element, context: Context) -> Device | None:
        """Return the diode of an element line, or None after reporting why not."""
        findings = context.findings
        model = element.model
        if model is not None:
            if not check_model(element, ("d", "scr"), context, required=False):
                return None
            if model.type == "scr":
                from ..switches.thyristor import Thyristor

                return Thyristor.read(element, context)
            if len(element.nodes) > 2:
                findings.error(
                    "NS2002",
                    f"{element.name} has three nodes, but its model {model.name} is a diode",
                    element.span,
                    "only a model of type SCR has a gate",
                )
                return None
            if is_smooth(model):
                from .junction_diode import JunctionDiode

                return JunctionDiode.read(element, context)
        check_flags(cls, element, findings)
        params = {key: p for key, p in element.params.items() if key != "v"}
        given = cls.INSTANCE.read(params, element.name, findings) if params else {}
        parallel = size_of(element, given, findings)
        law = model_law(model, context)
        if parallel is None or law is None:
            return None
        own = {name: given[name] for name in _NAMES if name in given}
        if own:
            law = replace(law, **own)
            if not check_law(law, element.name, element.params, element.span, findings):
                return None
        body = curve_body(law, parallel, context)
        drop = series_drop(element, model, findings)
        return cls(element, law, Leg(body, drop, parallel), body.parts)

    def curve(self, conditions: Conditions) -> Characteristic | None:
        """Return the set-valued law."""
        return self.law.curve(self.leg.parallel)

    def valves(self, layout: Layout) -> Iterator[Valve]:
        """Yield the forward pair."""
        return self.leg.valves(layout, self.name)


def curve_body(law: DiodeLaw, parallel: float, context: Context) -> CurveBody:
    """Return the branches and effects of a law, computed once for equal diodes."""
    known = context.diodes.get((law, parallel))
    if known is None:
        known = CurveBody(law.curve(parallel).decompose(), law.effects(parallel))
        context.diodes[(law, parallel)] = known
    return known


def model_law(model: Model | None, context: Context) -> DiodeLaw | None:
    """Return the set-valued law of a model card, read once; None after reporting why not."""
    if model is None:
        return IDEAL
    known = context.models.get(id(model))
    if known is None:
        known = context.models[id(model)] = read_law(model, context.findings)
    return known if isinstance(known, DiodeLaw) else None


def is_smooth(model: Model) -> bool:
    """Return whether a diode's model card is SPICE's smooth junction."""
    return not any(key in model.params for key in SET_VALUED)


def read_law(model: Model, findings: Findings) -> DiodeLaw | str:
    """Return the set-valued law of a model card, or ``"wrong"`` after reporting why.

    Parameters
    ----------
    model : Model
        Of type ``d`` with set-valued parameters.
    findings : Findings
    """
    params = {k: p for k, p in model.params.items() if k not in ("ideal", "v")}
    owner = f"model {model.name}"
    before = len(findings.errors)
    given = Diode.MODEL.read(params, owner, findings)
    law = DiodeLaw(**{name: given[name] for name in _NAMES if name in given})
    check_law(law, owner, model.params, model.span, findings)
    return law if len(findings.errors) == before else "wrong"


def check_law(
    law: DiodeLaw, owner: str, params: Mapping[str, Param], span: Span, findings: Findings
) -> bool:
    """Return whether the effects fit together; report those that do not.

    Parameters
    ----------
    law : DiodeLaw
    owner : str
        ``d1`` or ``model dm``.
    params : mapping of str to Param
        For the places of the parameters.
    span : Span
        Place of the owner.
    findings : Findings
    """
    before = len(findings.errors)

    def wrong(key: str, message: str, hint: str) -> None:
        where = params[key].span if key in params else span
        findings.error("NS2005", f"{owner}: {message}", where, hint)

    roff = math.inf if law.roff is None else law.roff
    for key, value in (("ron", law.ron), ("rrev", law.rrev)):
        if value is not None and not 0.0 <= value < roff:
            wrong(key, f"{key}={value:g} Ohm must be between 0 and roff", f"roff is {roff:g} Ohm")
    if roff <= 0.0:
        wrong("roff", "roff must be positive", "remove it for an ideally blocking diode")
    if math.isinf(law.vfwd or 0.0):
        wrong("vfwd", "vfwd must be finite", "give a voltage")
    if law.vrev is not None and law.vrev + (law.vfwd or 0.0) < 0.0:
        wrong(
            "vrev", "the breakdown voltage is above the forward drop", "vrev is a positive number"
        )
    if law.vrev is not None and math.isinf(law.vrev):
        wrong("vrev", "vrev must be finite", "remove it for a diode that never breaks down")
    if law.rrev is not None and law.vrev is None:
        where = params["rrev"].span if "rrev" in params else span
        findings.warning("NS2052", f"{owner}: rrev has no effect without vrev", where)
    return len(findings.errors) == before
