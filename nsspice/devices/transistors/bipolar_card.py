"""The model card of the smooth bipolar transistor: parameters, effects, bounds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ...netlist.findings import Findings
from ..parameter import Parameter, Table, check_bounds, inert, limited, omitted, refused
from .transistor import RATINGS

if TYPE_CHECKING:
    from ...netlist.deck import Model

#: parameter, its linear and its quadratic temperature coefficient
COEFFICIENTS = (
    *(
        (name, f"t{name}1", f"t{name}2")
        for name in ("bf", "br", "vaf", "var", "ikf", "ikr", "irb", "rb", "rc", "re", "nf", "nr")
    ),
    *(
        (name, f"t{name}1", f"t{name}2")
        for name in ("ne", "nc", "ns", "itf", "tf", "tr", "mje", "mjc", "mjs")
    ),
    ("rbm", "trm1", "trm2"),
)

#: IS of a card without one [A]
_CURRENT = 1e-16
#: a larger grading coefficient has no charge at forward voltages (ngspice's bound, too)
STEEPEST = 0.999

CARD = Table(
    Parameter("is", "transport saturation current", "A", _CURRENT),
    Parameter("bf", "forward current gain", "", 100.0, aliases=("bfm",)),
    Parameter("nf", "forward emission coefficient", "", 1.0),
    Parameter("br", "reverse current gain", "", 1.0, aliases=("brm",)),
    Parameter("nr", "reverse emission coefficient", "", 1.0),
    Parameter("vaf", "forward Early voltage", "V", aliases=("va",)),
    Parameter("var", "reverse Early voltage", "V", aliases=("vb",)),
    Parameter("ikf", "knee of the forward gain", "A", aliases=("ik",)),
    Parameter("ikr", "knee of the reverse gain", "A"),
    Parameter("ise", "base-emitter leakage", "A"),
    Parameter("ne", "emission coefficient of ise", "", 1.5),
    Parameter("c2", "ise as a multiple of is (SPICE2)"),
    Parameter("c4", "isc as a multiple of is (SPICE2)"),
    Parameter("isc", "base-collector leakage", "A"),
    Parameter("nc", "emission coefficient of isc", "", 2.0),
    Parameter("rb", "base resistance", "Ohm"),
    Parameter("rbm", "base resistance at high currents", "Ohm"),
    Parameter("rc", "collector resistance", "Ohm"),
    Parameter("re", "emitter resistance", "Ohm"),
    Parameter("cje", "base-emitter capacitance at 0 V", "F"),
    Parameter("vje", "base-emitter potential", "V", 0.75, aliases=("pe",)),
    Parameter("mje", "base-emitter grading", "", 0.33, aliases=("me",)),
    Parameter("cjc", "base-collector capacitance at 0 V", "F"),
    Parameter("vjc", "base-collector potential", "V", 0.75, aliases=("pc",)),
    Parameter("mjc", "base-collector grading", "", 0.33, aliases=("mc",)),
    Parameter("fc", "forward capacitance coefficient", "", 0.5),
    Parameter("tf", "forward transit time", "s"),
    Parameter("xtf", "growth of the transit time"),
    Parameter("itf", "current at which tf grows", "A"),
    Parameter("vtf", "voltage at which tf grows", "V"),
    Parameter("tr", "reverse transit time", "s"),
    Parameter("eg", "band gap", "eV", 1.11),
    Parameter("xti", "temperature exponent of is", "", 3.0, aliases=("pt",)),
    Parameter("xtb", "temperature exponent of the gains", "", 0.0),
    Parameter("tnom", "temperature at which parameters are given", "C", aliases=("tref",)),
    Parameter("t_abs", "temperature of its transistors", "C"),
    Parameter("irb", "base current at which rb falls to half", "A"),
    Parameter("xcjc", "share of cjc at the inner base", "", 1.0),
    Parameter("cjs", "substrate capacitance at 0 V", "F", aliases=("ccs",)),
    Parameter("vjs", "substrate potential", "V", 0.75, aliases=("ps",)),
    Parameter("mjs", "substrate grading", "", 0.0, aliases=("ms",)),
    Parameter("iss", "substrate saturation current", "A"),
    Parameter("ns", "emission coefficient of iss", "", 1.0),
    Parameter("subs", "substrate at the collector (1) or at the base (-1)"),
    Parameter("nk", "exponent of high injection", "", 0.5, aliases=("nkf",)),
    *(
        Parameter(key, f"{kind} temperature coefficient of {name}", unit)
        for name, *keys in COEFFICIENTS
        for key, kind, unit in zip(keys, ("linear", "quadratic"), ("1/K", "1/K2"), strict=True)
    ),
    omitted("ptf", "excess phase", "deg"),
    inert("isr", "parameter of diodes"),
    inert("alpha", "parameter of other models"),
    refused("rco", "epitaxial resistance", "use rc", "Ohm"),
    refused("qco", "epitaxial charge", "use tr"),
    *(
        refused(name, "way to follow the temperature", "remove it, or give tbf1, trb1 ...")
        for name in ("tlev", "tlevc")
    ),
    *(inert(name, "epitaxial region") for name in ("vo", "gamma", "vg", "cn", "d", "quasimod")),
    refused("level", "model level", "only SPICE's Gummel-Poon model, level 1", neutral=(1.0, 2.0)),
    inert("kf", "flicker noise"),
    inert("af", "flicker noise"),
    *RATINGS,
)

#: parameter, effect, unit, exponent of the number of equal transistors
EFFECTS = (
    ("is", "saturation current", "A", 1),
    ("bf", "forward gain", "", 0),
    ("nf", "forward emission coefficient", "", 0),
    ("br", "reverse gain", "", 0),
    ("nr", "reverse emission coefficient", "", 0),
    ("vaf", "Early effect", "V", 0),
    ("var", "reverse Early effect", "V", 0),
    ("ikf", "high injection", "A", 1),
    ("ikr", "reverse high injection", "A", 1),
    ("nk", "exponent of high injection", "", 0),
    ("ise", "base-emitter leakage", "A", 1),
    ("isc", "base-collector leakage", "A", 1),
    ("rb", "base resistance", "Ohm", -1),
    ("rbm", "falling base resistance", "Ohm", -1),
    ("irb", "base resistance over current", "A", 1),
    ("rc", "collector resistance", "Ohm", -1),
    ("re", "emitter resistance", "Ohm", -1),
    ("cje", "emitter charge", "F", 1),
    ("cjc", "collector charge", "F", 1),
    ("xcjc", "share of the inner base", "", 0),
    ("tf", "forward transit", "s", 0),
    ("xtf", "growing transit time", "", 0),
    ("tr", "reverse transit", "s", 0),
    ("cjs", "substrate charge", "F", 1),
    ("iss", "substrate junction", "A", 1),
    ("xtb", "gain over temperature", "", 0),
    ("tnom", "nominal temperature", "C", 0),
    ("t_abs", "own temperature", "C", 0),
)
#: zero means "no such effect"
NEUTRAL_ZERO = frozenset(
    {"vaf", "var", "ikf", "ikr", "ise", "isc", "rb", "rbm", "rc", "re"}
    | {"irb", "cje", "cjc", "tf", "xtf", "tr", "cjs", "iss", "xtb"}
)
_POSITIVE = frozenset(["is", "bf", "br", "nf", "nr", "ne", "nc", "ns", "nk", "vje", "vjc", "vjs"])
#: LTspice's breakdown, of which nothing is simulated
_BREAKDOWN = ("bvcbo", "nbvcbo", "bvbe", "ibvbe", "nbvbe")
_SIGNED = frozenset(["eg", "xti", "xtb", "tnom", "t_abs", "subs"]) | {
    key for _, *keys in COEFFICIENTS for key in keys
}


def check_card(model: Model, findings: Findings) -> dict[str, float] | None:
    """Return the given parameters of a model card, or None after reporting what is wrong.

    Parameters
    ----------
    model : Model
        Of type ``npn`` or ``pnp``.
    findings : Findings
    """
    owner = f"model {model.name}"
    before = len(findings.errors)
    broken = [key for key in _BREAKDOWN if key in model.params]
    if broken:
        findings.warning(
            "NS2052",
            f"{', '.join(broken)} of {owner} are ignored: its transistors do not break down",
            model.params[broken[0]].span,
            "if they can reach that voltage, put a diode with BV across the junction",
        )
    params = {key: param for key, param in model.params.items() if key not in broken}
    given = CARD.read(params, owner, findings)
    check_bounds(given, model, findings, positive=_POSITIVE, free=_SIGNED)
    if given.get("subs", 1.0) not in (1.0, -1.0):
        wrong = f"{owner}: subs={given['subs']:g} must be 1 (collector) or -1 (base)"
        hint = "remove it: the default is 1 for NPN and -1 for PNP transistors"
        findings.error("NS2005", wrong, model.params["subs"].span, hint)
    if given.get("xcjc", 1.0) > 1.0:
        wrong = f"{owner}: xcjc={given['xcjc']:g} is a fraction of cjc: at most 1"
        findings.error("NS2005", wrong, model.params["xcjc"].span)
    for key, needed in (("rbm", "rb"), ("irb", "rbm")):
        if given.get(key) and needed not in given:
            findings.warning("NS2052", f"{owner}: {key} has no effect without {needed}", model.span)
    for key in ("mje", "mjc", "mjs"):
        limited(given, key, STEEPEST, model, findings)
    for key, multiple in (("ise", "c2"), ("isc", "c4")):
        if multiple in given:
            leakage = given.pop(multiple) * given.get("is", _CURRENT)
            given.setdefault(key, leakage)
    # an infinite Early voltage or knee is written by some programs for "no such effect"
    for key in ("vaf", "var", "ikf", "ikr", "irb", "itf", "vtf"):
        if math.isinf(given.get(key, 0.0)):
            del given[key]
    return given if len(findings.errors) == before else None
