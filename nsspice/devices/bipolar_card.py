"""The model card of the smooth bipolar transistor: parameters, effects, bounds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..netlist.findings import Findings
from .parameter import Parameter, Table, inert, refused
from .transistor import RATINGS

if TYPE_CHECKING:
    from ..netlist.deck import Model

_SUBSTRATE = "put a capacitor or a diode to the substrate node"

CARD = Table(
    Parameter("is", "transport saturation current", "A", 1e-16),
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
    refused("irb", "current at which rb falls to half", "give rbm, which is simulated", "A"),
    refused("ptf", "excess phase", "leave it out: it is a delay"),
    refused("xcjc", "share of cjc at the inner base", "use xcjc=1", neutral=(1.0,)),
    refused("cjs", "substrate capacitance", _SUBSTRATE, "F"),
    refused("ccs", "substrate capacitance", _SUBSTRATE, "F"),
    refused("iss", "substrate saturation current", _SUBSTRATE, "A"),
    refused("rco", "epitaxial resistance", "use rc", "Ohm"),
    refused("qco", "epitaxial charge", "use tr"),
    refused("nkf", "exponent of high injection", "use nkf=0.5", neutral=(0.5,)),
    refused("nk", "exponent of high injection", "use nk=0.5", neutral=(0.5,)),
    *(
        refused(name, "temperature coefficient", "write the parameter for this temperature")
        for name in ("trb1", "trb2", "trc1", "trc2", "tre1", "tre2", "trm1", "trm2")
    ),
    *(inert(name, "substrate junction") for name in ("vjs", "mjs", "ns", "ps", "ms")),
    *(inert(name, "epitaxial region") for name in ("vo", "gamma", "vg", "cn", "d", "quasimod")),
    refused("level", "model level", "only SPICE's Gummel-Poon model, level 1", neutral=(1.0, 2.0)),
    inert("subs", "place of the substrate"),
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
    ("ise", "base-emitter leakage", "A", 1),
    ("isc", "base-collector leakage", "A", 1),
    ("rb", "base resistance", "Ohm", -1),
    ("rbm", "falling base resistance", "Ohm", -1),
    ("rc", "collector resistance", "Ohm", -1),
    ("re", "emitter resistance", "Ohm", -1),
    ("cje", "emitter charge", "F", 1),
    ("cjc", "collector charge", "F", 1),
    ("tf", "forward transit", "s", 0),
    ("xtf", "growing transit time", "", 0),
    ("tr", "reverse transit", "s", 0),
    ("xtb", "gain over temperature", "", 0),
    ("tnom", "nominal temperature", "C", 0),
)
#: zero means "no such effect"
NEUTRAL_ZERO = frozenset(
    {"vaf", "var", "ikf", "ikr", "ise", "isc", "rb", "rbm", "rc", "re"}
    | {"cje", "cjc", "tf", "xtf", "tr", "xtb"}
)
_POSITIVE = frozenset(["is", "bf", "br", "nf", "nr", "ne", "nc", "vje", "vjc"])
_BELOW_ONE = frozenset(["mje", "mjc", "fc"])
_SIGNED = frozenset(["eg", "xti", "xtb", "tnom"])


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
    given = CARD.read(model.params, owner, findings)
    for key, value in given.items():
        bound = ""
        if key in _SIGNED or math.isnan(value):
            continue
        if value < 0.0 or (key in _POSITIVE and value == 0.0):
            bound = "positive" if key in _POSITIVE else "at least 0"
        elif key in _BELOW_ONE and value >= 1.0:
            bound = "below 1"
        if bound:
            span = model.params[key].span if key in model.params else model.span
            findings.error("NS2005", f"{owner}: {key}={value:g} must be {bound}", span)
    if given.get("rbm") is not None and not given.get("rb"):
        findings.warning("NS2052", f"{owner}: rbm has no effect without rb", model.span)
    # an infinite Early voltage or knee is written by some programs for "no such effect"
    for key in ("vaf", "var", "ikf", "ikr", "itf", "vtf"):
        if math.isinf(given.get(key, 0.0)):
            del given[key]
    return given if len(findings.errors) == before else None
