"""The model card of SPICE's diode: its parameters, their bounds, and the law that they give."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ...netlist.findings import Findings
from ..parameter import Parameter, Table, inert, limited, refused
from .junction import STEEPEST, JunctionLaw

if TYPE_CHECKING:
    from ...netlist.deck import Model

#: parameters of the sidewall, whose length pj is 0 unless the element gives it
SIDEWALL = ("jsw", "isw", "cjp", "cjsw", "rsw")
_GAP = "remove it: the band gap of silicon is used"

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
    Parameter("t_abs", "temperature of its diodes", "C"),
    refused("ikr", "knee current of reverse injection", "leave it out", "A"),
    *(inert(name, "current of the sidewall, none without pj", "A") for name in SIDEWALL[:2]),
    *(inert(name, "its capacitance, none without pj", "F") for name in SIDEWALL[2:4]),
    Parameter("ibvl", "low-level breakdown current at the breakdown voltage", "A"),
    Parameter("nbvl", "emission coefficient of ibvl", "", 1.0),
    Parameter("trs1", "linear temperature coefficient of rs", "1/K", aliases=("trs",)),
    Parameter("trs2", "quadratic temperature coefficient of rs", "1/K2"),
    Parameter("tikf", "linear temperature coefficient of ikf", "1/K"),
    Parameter("ttt1", "linear temperature coefficient of tt", "1/K"),
    Parameter("ttt2", "quadratic temperature coefficient of tt", "1/K2"),
    Parameter("tm1", "linear temperature coefficient of m", "1/K"),
    Parameter("tm2", "quadratic temperature coefficient of m", "1/K2"),
    Parameter("tbv1", "linear temperature coefficient of bv (PSpice)", "1/K"),
    Parameter("tbv2", "quadratic temperature coefficient of bv (PSpice)", "1/K2"),
    Parameter("tcv", "fall of bv [V/K], of its share [1/K] with tlev=1 (ngspice)"),
    Parameter("tlev", "how tcv is meant, 0 or 1"),
    Parameter("tlevc", "cjo and vj follow cta and tpb (1) instead of silicon (0)"),
    Parameter("cta", "linear temperature coefficient of cjo", "1/K", aliases=("ctc",)),
    Parameter("tpb", "fall of vj", "V/K", aliases=("tvj",)),
    refused("gap1", "band gap over temperature", _GAP, neutral=(7.02e-4,)),
    refused("gap2", "band gap over temperature", _GAP, neutral=(1108.0,)),
    refused("area", "area factor", "write it on the element line", neutral=(1.0,)),
    refused("vp", "soft recovery", "remove it: only tt is simulated"),
    *(inert(name, "its resistance, none without pj", "Ohm") for name in SIDEWALL[4:]),
    refused("jtun", "tunnel current", "leave it out, or add a B source", "A"),
    refused("jtunsw", "tunnel current of the sidewall", "leave it out, or add a B source", "A"),
    *(
        refused(name, "size of a metal or poly layer", "put a capacitor in parallel", "m")
        for name in ("lm", "lp", "wm", "wp")
    ),
    refused("level", "model level", "use level=1", neutral=(1.0, 3.0)),
    *(inert(name, "sidewall") for name in ("php", "mjsw", "fcs", "ns", "ctp", "tphp")),
    *(inert(name, "tunnel current") for name in ("ntun", "xtitun", "keg")),
    *(inert(name, "size of a layer") for name in ("xom", "xoi", "xm", "xp")),
    inert("kf", "flicker noise"),
    inert("af", "flicker noise"),
    *(inert(name, "rating") for name in ("iave", "ipk", "vpk", "irms", "fv_max", "bv_max")),
    *(inert(name, "rating") for name in ("id_max", "te_max", "pd_max", "rth0", "cth0")),
    inert("mfg", "manufacturer"),
    inert("type", "kind of diode"),
)


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
    given = CARD.read(params, owner, findings, ("vfwd", "vrev", "ron", "rrev", "roff"))
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
                "remove it for a junction without this effect",
            )
    for key in ("ibv", "ibvl"):
        if key in given and "bv" not in given:
            findings.warning("NS2052", f"{owner}: {key} has no effect without bv", model.span)
    for key in ("tlev", "tlevc"):
        if given.get(key, 0.0) not in (0.0, 1.0):
            findings.error(
                "NS2008",
                f"{owner}: {key}={given[key]:g} is not simulated",
                model.params[key].span,
                "0 and 1 are",
            )
    limited(given, "m", STEEPEST, model, findings)
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
    ("ibvl", 0.0, _INF, False),
    ("nbvl", 0.0, _INF, True),
    ("cjo", 0.0, _INF, False),
    ("vj", 0.0, _INF, True),
    ("m", 0.0, _INF, False),
    ("fc", 0.0, 1.0, False),
    ("tt", 0.0, _INF, False),
)


def _main(key: str) -> str:
    """Return the main name of a parameter."""
    for parameter in CARD.parameters:
        if key == parameter.name or key in parameter.aliases:
            return parameter.name
    return key
