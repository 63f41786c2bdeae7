"""Set-valued diode ``D a b [model] [area]``: conduction plus the effects that its model gives.

Without a model, or with ``D(ideal)``, the diode is ideal: no drop, no resistance, no leakage.  With
``Vfwd`` and ``Vrev`` it is the practical (Zener) diode; ``Ron``, ``Rrev`` and ``Roff`` tilt the
pieces of its curve.  On the conducting piece the slope is exactly ``Ron``; the corner stands at
``Vfwd``.  A model card without any of these is SPICE's smooth junction.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar

from ..problems.descriptor import Functional
from .characteristic import Characteristic, Decomposition, diode_curve
from .device import (
    NO_VALUES,
    Context,
    Device,
    Edge,
    check_flags,
    check_model,
    number,
    refuse_smooth,
)
from .effect import Effect
from .findings import Findings
from .parameter import Parameter, Table, inert, refused
from .stamper import Layout, Stamper

if TYPE_CHECKING:
    from ..errors import Span
    from ..netlist.deck import Element, Model, Param

_SMOOTH = "leave it out, or leave out the set-valued parameters for a smooth junction"


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


class Diode(Device):
    """A set-valued diode: an off-conductance in parallel with one or two pairs."""

    KIND = "diode"
    FLAGS: ClassVar[tuple[str, ...]] = ("off",)
    INSTANCE = Table(
        Parameter("area", "area factor", "", 1.0),
        Parameter("m", "number of equal diodes in parallel", "", 1.0),
        *_EFFECTS,
        inert("ic", "initial voltage (no charge is stored)", "V"),
        inert("temp", "temperature (piecewise-linear laws have none)", "C"),
        inert("dtemp", "temperature difference", "K"),
        inert("pj", "perimeter factor"),
        inert("w", "width of the junction", "m"),
        inert("l", "length of the junction", "m"),
    )
    MODEL = Table(
        Parameter("ideal", "an ideal diode"),
        *_EFFECTS,
        refused("epsilon", "width of a rounded corner", "the corner is sharp: write epsilon=0"),
        refused("revepsilon", "width of a rounded corner", "the corner is sharp: revepsilon=0"),
        refused("ilimit", "current limit", "leave it out, or limit the current by a source"),
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
    shows_current = True
    __slots__ = ("law", "parallel", "parts")

    def __init__(
        self,
        element: Element,
        law: DiodeLaw,
        parallel: float,
        derived: tuple[Decomposition, tuple[Effect, ...]],
    ) -> None:
        super().__init__(element)
        self.law = law
        self.parallel = parallel
        self.parts, self.effects = derived

    @classmethod
    def read(cls, element: Element, context: Context) -> Diode | None:
        """Return the diode of an element line, or None after reporting why not."""
        findings = context.findings
        if element.flags:
            check_flags(cls, element, findings)
            if "off" in element.flags:
                findings.warning(
                    "NS2052",
                    f"off of {element.name} is a starting hint that this program does not need",
                    element.flags["off"],
                )
        given = cls._given(element, findings)
        area = given.get("area", 1.0)
        if element.value is not None and "area" not in given:
            bare = number(element, "area", findings)
            if bare is None:
                return None
            area = bare
        parallel = area * given.get("m", 1.0)
        if not 0.0 < parallel < math.inf:
            findings.error("NS2005", f"area and m of {element.name} must be positive", element.span)
            return None
        law = cls._law(element, context)
        own = {name: given[name] for name in _NAMES if name in given}
        if law is not None and own:
            law = replace(law, **own)
            if not check_law(law, element.name, element.params, element.span, findings):
                return None
        if law is None:
            return None
        return cls(element, law, parallel, _derived(law, parallel, context))

    @classmethod
    def _given(cls, element: Element, findings: Findings) -> dict[str, float]:
        """Return the parameters of the element line; report a smooth series drop."""
        if not element.params:
            return {}
        params = dict(element.params)
        if "v" in params:
            del params["v"]
            refuse_smooth(
                element,
                f"{element.name} has a smooth series drop V={{...}}",
                findings,
                "use vfwd and ron",
            )
        return cls.INSTANCE.read(params, element.name, findings)

    @classmethod
    def _law(cls, element: Element, context: Context) -> DiodeLaw | None:
        """Return the law of the element's model card, read once."""
        model = element.model
        if model is None:
            return IDEAL
        known = context.models.get(id(model))
        if known is None:
            if not check_model(element, ("d",), context.findings, required=False):
                return None
            known = read_law(model, context.findings)
            context.models[id(model)] = known
        if known == "smooth":
            refuse_smooth(
                element,
                f"{element.name} is a smooth junction by its model {model.name}",
                context.findings,
                f"give {model.name} Vfwd, Ron, Roff or Vrev, or write D(ideal)",
            )
            return None
        return known if isinstance(known, DiodeLaw) else None

    @property
    def pair_count(self) -> int:
        """Number of complementarity pairs."""
        return len(self.parts.pairs)

    def edges(self, values: Mapping[str, float] = NO_VALUES) -> tuple[Edge, ...]:
        """Return one branch per pair and one for the leakage."""
        a, b = self.nodes
        pairs = tuple(Edge("P", a, b) for _ in self.parts.pairs)
        return (*pairs, Edge("R", a, b)) if self.parts.conductance else pairs

    def stamp(self, stamper: Stamper) -> None:
        """Write the off-conductance and the pairs."""
        a, b = self.nodes
        name, parts = self.name, self.parts
        if parts.conductance:
            stamper.conductance(a, b, parts.conductance)
        single = len(parts.pairs) == 1
        stamper.layout.pairs[name] = tuple(
            stamper.pair(name if single else f"{name}.fwd", name, a, b, p.offset, p.resistance)
            if p.forward
            else stamper.pair(f"{name}.rev", name, b, a, p.offset, p.resistance)
            for p in parts.pairs
        )

    def current(self, layout: Layout) -> Functional:
        """Return leakage plus forward minus reverse multiplier."""
        lam = tuple(
            (index, 1.0 if pair.forward else -1.0)
            for index, pair in zip(layout.pairs[self.name], self.parts.pairs, strict=True)
        )
        if not self.parts.conductance:
            return Functional(lam=lam)
        return Functional(z=layout.voltage(*self.ends, self.parts.conductance), lam=lam)


def _derived(
    law: DiodeLaw, parallel: float, context: Context
) -> tuple[Decomposition, tuple[Effect, ...]]:
    """Return the branches and effects of a law, computed once for equal diodes."""
    known = context.diodes.get((law, parallel))
    if known is None:
        known = law.curve(parallel).decompose(), law.effects(parallel)
        context.diodes[(law, parallel)] = known
    return known


def read_law(model: Model, findings: Findings) -> DiodeLaw | str:
    """Return the law of a model card, ``"smooth"``, or ``"wrong"`` after reporting why.

    Parameters
    ----------
    model : Model
        Of type ``d``.
    findings : Findings
    """
    if not any(key in model.params for key in SET_VALUED):
        return "smooth"
    params = {k: p for k, p in model.params.items() if k != "ideal"}
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
            wrong(key, f"{key}={value:g} Ohm must lie between 0 and roff", f"roff is {roff:g} Ohm")
    if roff <= 0.0:
        wrong("roff", "roff must be positive", "leave it out for an ideally blocking diode")
    if math.isinf(law.vfwd or 0.0):
        wrong("vfwd", "vfwd must be finite", "give a voltage")
    if law.vrev is not None and law.vrev + (law.vfwd or 0.0) < 0.0:
        wrong("vrev", "the breakdown lies above the forward drop", "vrev is a positive number")
    if law.vrev is not None and math.isinf(law.vrev):
        wrong("vrev", "vrev must be finite", "leave it out for a diode that never breaks down")
    if law.rrev is not None and law.vrev is None:
        where = params["rrev"].span if "rrev" in params else span
        findings.warning("NS2052", f"{owner}: rrev has no effect without vrev", where)
    return len(findings.errors) == before
