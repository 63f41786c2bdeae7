"""The model card of the power MOSFET ``VDMOS`` of LTspice and ngspice: parameters, bounds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ...netlist.findings import Findings
from ..diodes.junction import STEEPEST, JunctionLaw
from ..parameter import Parameter, Table, check_bounds, inert, limited, refused
from .mosfet import RATINGS

if TYPE_CHECKING:
    from ...netlist.deck import Model

#: LTspice's values of a card that gives none
_KP = 1.0

CARD = Table(
    Parameter("nchan", "n-channel"),
    Parameter("pchan", "p-channel"),
    Parameter("vto", "threshold, negative for p-channel", "V", 0.0, aliases=("vth0", "vt0")),
    Parameter("kp", "transconductance", "A/V2", _KP),
    Parameter("lambda", "channel length modulation", "1/V"),
    Parameter("theta", "mobility reduction with the gate voltage", "1/V"),
    Parameter("mtriode", "conductance multiplier of the triode region", "", 1.0),
    Parameter("ksubthres", "slope of the current below the threshold", "V", 0.1),
    Parameter("subshift", "shift of that along the gate voltage", "V", 0.0),
    Parameter("rd", "drain resistance", "Ohm"),
    Parameter("rs", "source resistance", "Ohm"),
    Parameter("rg", "gate resistance", "Ohm"),
    Parameter("rds", "resistance from drain to source", "Ohm"),
    Parameter("cgs", "gate-source capacitance", "F"),
    Parameter("cgdmin", "least gate-drain capacitance", "F"),
    Parameter("cgdmax", "greatest gate-drain capacitance", "F"),
    Parameter("a", "steepness of the gate-drain capacitance", "1/V", 1.0),
    Parameter("is", "saturation current of the body diode", "A", 1e-14),
    Parameter("n", "emission coefficient of the body diode", "", 1.0),
    Parameter("rb", "resistance of the body diode", "Ohm"),
    Parameter("bv", "breakdown voltage", "V"),
    Parameter("ibv", "current at the breakdown voltage", "A", 1e-10),
    Parameter("nbv", "emission coefficient of the breakdown", "", 1.0),
    Parameter("cjo", "capacitance of the body diode at 0 V", "F", aliases=("cj0", "cj")),
    Parameter("vj", "potential of the body diode", "V", 0.8),
    Parameter("m", "grading of the body diode", "", 0.5, aliases=("mj",)),
    Parameter("fc", "forward capacitance coefficient", "", 0.5),
    Parameter("tt", "transit time of the body diode", "s"),
    Parameter("eg", "band gap of the body diode", "eV", 1.11),
    Parameter("xti", "temperature exponent of is", "", 3.0),
    Parameter("mu", "temperature exponent of kp", "", -1.5, aliases=("bex",)),
    Parameter("tcvth", "fall of the threshold", "V/K", 0.0, aliases=("vtotc",)),
    Parameter("texp0", "temperature exponent of rd, in place of trd1 and trd2"),
    *(
        Parameter(f"t{name}{k}", f"{kind} temperature coefficient of {name}", unit, 0.0)
        for name in ("rd", "rs", "rg", "rb", "ksubthres")
        for k, kind, unit in ((1, "linear", "1/K"), (2, "quadratic", "1/K2"))
    ),
    Parameter("tnom", "temperature at which parameters are given", "C", aliases=("tref",)),
    Parameter("t_abs", "temperature of its transistors", "C"),
    Parameter("switch", "read the card as that of a switch"),
    refused("rq", "quasi-saturation", "leave it out, or raise rd", "Ohm"),
    inert("vq", "quasi-saturation", "V"),
    inert("texp1", "quasi-saturation"),
    inert("phi", "surface potential", "V"),
    inert("kf", "flicker noise"),
    inert("af", "flicker noise"),
    inert("noiseless", "noise"),
    *(
        inert(name, "self-heating: give temp=")
        for name in ("rthjc", "rthca", "cthj", "rth_ext", "derating")
    ),
    *(inert(name, "rating") for name in ("ron", "vdss", "id", "pd_max", "id_max", "idr_max")),
    inert("te_max", "rating"),
    *RATINGS,
)
#: parameter, effect, unit
EFFECTS = (
    ("vto", "threshold", "V"),
    ("kp", "transconductance", "A/V2"),
    ("lambda", "channel length modulation", "1/V"),
    ("theta", "mobility over gate voltage", "1/V"),
    ("mtriode", "triode conductance", ""),
    ("ksubthres", "subthreshold slope", "V"),
    ("subshift", "subthreshold shift", "V"),
    ("rd", "drain resistance", "Ohm"),
    ("rs", "source resistance", "Ohm"),
    ("rg", "gate resistance", "Ohm"),
    ("rds", "drain-source resistance", "Ohm"),
    ("cgs", "gate-source charge", "F"),
    ("cgdmax", "gate-drain charge", "F"),
    ("cgdmin", "least gate-drain capacitance", "F"),
    ("is", "body diode", "A"),
    ("n", "body diode emission coefficient", ""),
    ("rb", "body diode resistance", "Ohm"),
    ("bv", "breakdown", "V"),
    ("cjo", "body diode charge", "F"),
    ("tt", "body diode transit", "s"),
    ("tnom", "nominal temperature", "C"),
    ("t_abs", "own temperature", "C"),
)
#: zero means "no such effect"
NEUTRAL_ZERO = frozenset(
    {"lambda", "theta", "subshift", "rd", "rs", "rg", "rb", "cgs", "cgdmax", "cgdmin", "cjo", "tt"}
)
_POSITIVE = frozenset(
    {"kp", "mtriode", "ksubthres", "a", "is", "n", "bv", "ibv", "nbv", "vj", "rds"}
)
_FREE = frozenset(
    {"vto", "subshift", "eg", "xti", "mu", "tcvth", "texp0", "tnom", "t_abs", "nchan", "pchan"}
    | {"switch"}
    | {f"t{name}{k}" for name in ("rd", "rs", "rg", "rb", "ksubthres") for k in (1, 2)}
)


def is_n(model: Model) -> bool:
    """Return whether a VDMOS card is that of an n-channel transistor."""
    return model.type != "vdmosp" and "pchan" not in model.params


def check_card(model: Model, findings: Findings) -> dict[str, float] | None:
    """Return the given parameters of a model card, or None after reporting what is wrong.

    Parameters
    ----------
    model : Model
        Of type ``vdmos``.
    findings : Findings
    """
    owner = f"model {model.name}"
    before = len(findings.errors)
    given = CARD.read(model.params, owner, findings)
    if "bv" in given:
        given["bv"] = abs(given["bv"])  # that of a p-channel transistor may have a sign
    check_bounds(given, model, findings, positive=_POSITIVE, free=_FREE)
    missing = [key for key in ("vto", "kp") if key not in given]
    if missing:
        shown = " and ".join("Vto = 0" if key == "vto" else "Kp = 1 A/V2" for key in missing)
        findings.warning(
            "NS2058",
            f"{owner} gives no {' and no '.join(missing)}: {shown}, LTspice's values, are used",
            model.span,
            "ngspice takes those of an IRF540",
        )
    if "cgdmin" in given and given["cgdmin"] > given.get("cgdmax", math.inf):
        message = f"{owner}: cgdmin={given['cgdmin']:g} must not be above cgdmax"
        findings.error("NS2005", message, model.params["cgdmin"].span)
    limited(given, "m", STEEPEST, model, findings)
    for key in ("rds", "bv"):
        if math.isinf(given.get(key, 0.0)):
            del given[key]
    return given if len(findings.errors) == before else None


def body_diode(card: dict[str, float]) -> JunctionLaw:
    """Return the junction from source to drain."""
    values = {"vj": 0.8, "nbv": 1.0, "ibv": 1e-10}
    names = ("n", "bv", "ibv", "nbv", "cjo", "vj", "m", "fc", "tt", "eg", "xti", "tnom", "t_abs")
    values |= {key: card[key] for key in names if key in card}
    values |= {new: card[old] for old, new in _RENAMED.items() if old in card}
    for key in ("rs", "cjo", "tt"):
        if not values.get(key, 1.0):
            del values[key]
    return JunctionLaw(**values, given=tuple(values.items()))


_RENAMED = {"is": "is_", "rb": "rs", "trb1": "trs1", "trb2": "trs2"}
