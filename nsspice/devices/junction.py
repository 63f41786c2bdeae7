"""The smooth junction of SPICE's diode: current, charge, breakdown, temperature.

Only what the model card gives is written:

- exponential junction ``IS (exp(v / N Vt) - 1)`` (``IS N``), always
- recombination current (``ISR NR``) and high injection (``IKF``) as in PSpice
- breakdown (``BV IBV NBV``): a second exponential, such that the current at -BV is -IBV
- depletion charge (``CJO VJ M FC``) and diffusion charge (``TT``)
- ohmic resistance (``RS``): one node more

In the blocking region SPICE replaces the exponential by a cube; here it stays an exponential, and
the law is smooth everywhere.  The two differ by less than 0.05 IS.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..netlist.findings import Findings
from ..problems.tape import TapeBuilder
from .effect import Effect
from .parameter import Parameter, Table, inert, refused
from .stamper import Conditions
from .thermal import CELSIUS, depletion, kelvin, saturation, thermal_voltage

if TYPE_CHECKING:
    from ..netlist.deck import Model

_SIDEWALL = "leave it out, or add a second diode for the sidewall"
_TEMPERATURE = "write the parameter for this temperature"

CARD = Table(
    Parameter("is", "saturation current", "A", 1e-14, aliases=("js",)),
    Parameter("n", "emission coefficient", "", 1.0),
    Parameter("rs", "ohmic resistance", "Ohm"),
    Parameter("isr", "recombination saturation current", "A"),
    Parameter("nr", "emission coefficient of isr", "", 2.0),
    Parameter("ikf", "knee current of high injection", "A", aliases=("ik",)),
    Parameter("bv", "breakdown voltage, positive", "V", aliases=("vb",)),
    Parameter("ibv", "current at the breakdown voltage", "A", 1e-3, aliases=("ib",)),
    Parameter("nbv", "emission coefficient of the breakdown, default n"),
    Parameter("cjo", "junction capacitance at 0 V", "F", aliases=("cj0", "cj")),
    Parameter("vj", "junction potential", "V", 1.0, aliases=("pb",)),
    Parameter("m", "grading coefficient", "", 0.5, aliases=("mj",)),
    Parameter("fc", "forward capacitance coefficient", "", 0.5),
    Parameter("tt", "transit time", "s"),
    Parameter("eg", "band gap", "eV", 1.11),
    Parameter("xti", "temperature exponent of is", "", 3.0),
    Parameter("tnom", "temperature at which parameters are given", "C", aliases=("tref",)),
    refused("ikr", "knee current of reverse injection", "leave it out", "A"),
    refused("jsw", "sidewall saturation current", _SIDEWALL, "A"),
    refused("isw", "sidewall saturation current", _SIDEWALL, "A"),
    refused("cjp", "sidewall capacitance", _SIDEWALL, "F"),
    refused("cjsw", "sidewall capacitance", _SIDEWALL, "F"),
    refused("ibvl", "low-level breakdown current", "leave it out", "A"),
    refused("nbvl", "low-level breakdown coefficient", "leave it out", neutral=(1.0,)),
    *(
        refused(name, "temperature coefficient", _TEMPERATURE)
        for name in ("tbv1", "tbv2", "tcv", "trs", "trs1", "trs2", "tikf", "tm1", "tm2", "ttt1")
    ),
    *(
        refused(name, "temperature coefficient", _TEMPERATURE)
        for name in ("ttt2", "cta", "ctc", "ctp", "tpb", "tvj", "tphp", "tlev", "tlevc")
    ),
    refused("level", "model level", "use level=1", neutral=(1.0, 3.0)),
    *(inert(name, "sidewall") for name in ("php", "mjsw", "fcs", "ns")),
    inert("kf", "flicker noise"),
    inert("af", "flicker noise"),
    *(inert(name, "rating") for name in ("iave", "ipk", "vpk", "irms", "fv_max", "bv_max")),
    *(inert(name, "rating") for name in ("id_max", "te_max", "pd_max", "rth0", "cth0")),
    inert("mfg", "manufacturer"),
    inert("type", "kind of diode"),
)


@dataclass(frozen=True, slots=True)
class JunctionLaw:
    """The parameters of one model card; None stands for an absent effect.

    Parameters
    ----------
    given : tuple of (str, float)
        What the card gave, in its order.
    """

    is_: float = 1e-14
    n: float = 1.0
    rs: float | None = None
    isr: float | None = None
    nr: float = 2.0
    ikf: float | None = None
    bv: float | None = None
    ibv: float = 1e-3
    nbv: float | None = None
    cjo: float | None = None
    vj: float = 1.0
    m: float = 0.5
    fc: float = 0.5
    tt: float | None = None
    eg: float = 1.11
    xti: float = 3.0
    tnom: float | None = None
    given: tuple[tuple[str, float], ...] = ()

    @property
    def stores_charge(self) -> bool:
        """True if the junction has a charge."""
        return bool(self.cjo) or bool(self.tt)

    def effects(self, parallel: float) -> tuple[Effect, ...]:
        """Return what the model card called for, for ``parallel`` equal junctions."""
        listed: list[Effect] = []
        given = dict(self.given)
        listed.append(
            Effect("exponential junction", "is", self.is_ * parallel, "A")
            if "is" in given
            else Effect("exponential junction")
        )
        for key, name, unit, factor in _EFFECTS:
            if key in given and (given[key] or key not in _NEUTRAL_ZERO):
                listed.append(Effect(name, key, given[key] * parallel**factor, unit))
        return tuple(listed)

    def at(self, conditions: Conditions, temp: float | None, dtemp: float) -> Junction:
        """Return the junction at the temperature of its element.

        Parameters
        ----------
        conditions : Conditions
        temp : float or None
            The element's own temperature [degrees Celsius].
        dtemp : float
            Above the circuit's [K].
        """
        actual = kelvin(conditions, temp, dtemp)
        nominal = (conditions.nominal if self.tnom is None else self.tnom) + CELSIUS
        vt = thermal_voltage(actual)
        current = saturation(self.is_, self.n, self.eg, self.xti, nominal, actual)
        cjo, vj = depletion(self.cjo or 0.0, self.vj, self.m, nominal, actual)
        isr = saturation(self.isr or 0.0, self.nr, self.eg, self.xti, nominal, actual)
        nbv = (self.n if self.nbv is None else self.nbv) * vt
        return Junction(
            current=current,
            slope=self.n * vt,
            recombination=isr,
            recombination_slope=self.nr * vt,
            knee=self.ikf or 0.0,
            breakdown=_breakdown(self.bv, self.ibv, current, self.n * vt, nbv),
            breakdown_slope=nbv,
            capacitance=cjo,
            potential=vj,
            grading=self.m,
            bend=self.fc,
            transit=self.tt or 0.0,
        )


#: parameter, effect, unit, exponent of the number of equal junctions
_EFFECTS = (
    ("n", "emission coefficient", "", 0),
    ("rs", "ohmic resistance", "Ohm", -1),
    ("isr", "recombination", "A", 1),
    ("ikf", "high injection", "A", 1),
    ("bv", "SPICE breakdown", "V", 0),
    ("cjo", "junction charge", "F", 1),
    ("tt", "diffusion charge", "s", 0),
    ("tnom", "nominal temperature", "C", 0),
)
_NEUTRAL_ZERO = frozenset({"rs", "isr", "ikf", "cjo", "tt"})


@dataclass(frozen=True, slots=True)
class Junction:
    """The constants of one junction at its temperature; zero stands for an absent effect."""

    current: float
    slope: float
    recombination: float
    recombination_slope: float
    knee: float
    breakdown: float | None
    breakdown_slope: float
    capacitance: float
    potential: float
    grading: float
    bend: float
    transit: float

    def forward(self, tape: TapeBuilder, v: int) -> int:
        """Return the register of the current without breakdown [A]."""
        total = tape.op("junction", v, constants=(self.current, self.slope))
        if self.knee:
            # i / sqrt(1 + i / IKF)
            share = tape.op("div", total, tape.constant(self.knee))
            root = tape.op("sqrt", tape.op("add", tape.constant(1.0), share))
            total = tape.op("div", total, root)
        if self.recombination:
            constants = (self.recombination, self.recombination_slope)
            loss = tape.op("junction", v, constants=constants)
            width = tape.op("div", v, tape.constant(self.potential))
            width = tape.op("square", tape.op("sub", tape.constant(1.0), width))
            width = tape.op("add", width, tape.constant(0.005))
            width = tape.op("pow", width, tape.constant(self.grading / 2.0))
            total = tape.op("add", total, tape.op("mul", loss, width))
        return total

    def write_current(self, tape: TapeBuilder, v: int) -> int:
        """Return the register of the whole current [A]."""
        total = self.forward(tape, v)
        if self.breakdown is not None:
            depth = tape.op("neg", tape.op("add", v, tape.constant(self.breakdown)))
            reverse = tape.op("junction", depth, constants=(self.current, self.breakdown_slope))
            total = tape.op("sub", total, reverse)
            rest = self.current * math.expm1(-self.breakdown / self.breakdown_slope)
            total = tape.op("add", total, tape.constant(rest))  # no current at 0 V
        return total

    def write_charge(self, tape: TapeBuilder, v: int) -> int:
        """Return the register of the charge [A s]."""
        parts = []
        if self.capacitance:
            shape = (self.capacitance, self.potential, self.grading, self.bend)
            parts.append(tape.op("depletion", v, constants=shape))
        if self.transit:
            parts.append(tape.op("mul", tape.constant(self.transit), self.forward(tape, v)))
        return parts[0] if len(parts) == 1 else tape.op("add", *parts)

    def charge(self, v: float) -> float:
        """Return the charge [A s] at a voltage, for initial conditions."""
        total = depletion_charge(v, self.capacitance, self.potential, self.grading, self.bend)
        if self.transit:
            level = self.current * math.expm1(min(v / self.slope, 300.0))
            if self.knee:
                level /= math.sqrt(1.0 + level / self.knee)
            if self.recombination:
                loss = self.recombination * math.expm1(min(v / self.recombination_slope, 300.0))
                level += loss * ((1.0 - v / self.potential) ** 2 + 0.005) ** (self.grading / 2.0)
            total += self.transit * level
        return total


def depletion_charge(v: float, c: float, vj: float, m: float, fc: float) -> float:
    """Return the charge of a depletion layer [A s]; above ``fc vj`` it goes on as a parabola.

    Examples
    --------
    >>> depletion_charge(-1.0, 1e-12, 1.0, 0.5, 0.5) == 2e-12 * (1 - 2**0.5)
    True
    """
    edge = min(v, fc * vj)
    total = c * vj / (1.0 - m) * (1.0 - (1.0 - edge / vj) ** (1.0 - m))
    over = v - edge
    steep = c / (1.0 - fc) ** m
    return float(total + over * steep * (1.0 + m * over / (2.0 * vj * (1.0 - fc))))


def _breakdown(
    bv: float | None, ibv: float, current: float, slope: float, steep: float
) -> float | None:
    """Return the voltage at which the second exponential starts, so that ``i(-BV) = -IBV``."""
    if bv is None:
        return None
    # IBV = -IS expm1(-BV/nVt) + IS expm1(x/nbVt) - IS expm1((x - BV)/nbVt) for x = BV - start
    excess = ibv / current + math.expm1(-bv / slope) + math.expm1(-bv / steep)
    return bv - steep * math.log1p(excess) if excess > 0.0 else bv


def read_junction(model: Model, findings: Findings) -> JunctionLaw | None:
    """Return the smooth junction of a diode's model card, or None after reporting why not.

    Parameters
    ----------
    model : Model
        Of type ``d``, without set-valued parameters.
    findings : Findings
    """
    owner = f"model {model.name}"
    before = len(findings.errors)
    params = {key: p for key, p in model.params.items() if key != "v"}
    given = CARD.read(params, owner, findings)
    for key, low, high, strict in _RANGES:
        value = given.get(key)
        if (value is not None and not (low < value if strict else low <= value)) or (
            value is not None and not value < high
        ):
            sign = ">" if strict else ">="
            limit = f" and < {high:g}" if math.isfinite(high) else ""
            findings.error(
                "NS2005",
                f"{owner}: {key}={value:g} must be {sign} {low:g}{limit}",
                next((model.params[k].span for k in model.params if _main(k) == key), model.span),
                "leave it out for a junction without this effect",
            )
    if given.get("ibv") is not None and given.get("bv") is None:
        findings.warning("NS2052", f"{owner}: ibv has no effect without bv", model.span)
    if len(findings.errors) > before:
        return None
    values = {("is_" if key == "is" else key): value for key, value in given.items()}
    for key in ("rs", "isr", "ikf", "cjo", "tt"):
        if values.get(key) == 0.0:
            del values[key]
    return JunctionLaw(**values, given=tuple(given.items()))


_INF = math.inf
#: parameter, bounds, and whether the lower one is excluded
_RANGES = (
    ("is", 0.0, _INF, True),
    ("n", 0.0, _INF, True),
    ("rs", 0.0, _INF, False),
    ("isr", 0.0, _INF, False),
    ("nr", 0.0, _INF, True),
    ("ikf", 0.0, _INF, False),
    ("bv", 0.0, _INF, True),
    ("ibv", 0.0, _INF, True),
    ("nbv", 0.0, _INF, True),
    ("cjo", 0.0, _INF, False),
    ("vj", 0.0, _INF, True),
    ("m", 0.0, 1.0, False),
    ("fc", 0.0, 1.0, False),
    ("tt", 0.0, _INF, False),
)


def _main(key: str) -> str:
    """Return the main name of a parameter."""
    for parameter in CARD.parameters:
        if key == parameter.name or key in parameter.aliases:
            return parameter.name
    return key
