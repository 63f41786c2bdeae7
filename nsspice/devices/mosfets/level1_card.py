"""The model card of SPICE's LEVEL=1 MOSFET: parameters, effects, bounds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ...netlist.findings import Findings
from ..diodes.junction import STEEPEST
from ..parameter import Parameter, Table, check_bounds, inert, limited, refused
from .mosfet import RATINGS

if TYPE_CHECKING:
    from ...netlist.deck import Model

_RESISTOR = "put a resistor there"

CARD = Table(
    Parameter("level", "model level", "", 1.0),
    Parameter("vto", "threshold at vbs = 0, negative for PMOS", "V", aliases=("vt0", "vth0")),
    Parameter("kp", "transconductance", "A/V2"),
    Parameter("gamma", "effect of the body on the threshold", "V^0.5"),
    Parameter("phi", "surface potential", "V", 0.6),
    Parameter("lambda", "channel length modulation", "1/V"),
    Parameter("rd", "drain resistance", "Ohm"),
    Parameter("rs", "source resistance", "Ohm"),
    Parameter("rsh", "resistance of a square of drain and source", "Ohm"),
    Parameter("rg", "gate resistance", "Ohm"),
    Parameter("rds", "resistance from drain to source", "Ohm"),
    Parameter("n", "emission coefficient of the body junctions", "", 1.0),
    Parameter("tt", "transit time of the body junctions", "s"),
    Parameter("is", "saturation current of the body junctions", "A", 1e-14),
    Parameter("js", "saturation current of the body junctions by area", "A/m2"),
    Parameter("cbd", "body-drain capacitance at 0 V", "F"),
    Parameter("cbs", "body-source capacitance at 0 V", "F"),
    Parameter("cj", "capacitance of the body junctions by area", "F/m2"),
    Parameter("cjsw", "capacitance of the body junctions by perimeter", "F/m"),
    Parameter("pb", "potential of the body junctions", "V", 0.8),
    Parameter("mj", "grading of the body junctions", "", 0.5),
    Parameter("mjsw", "grading of their perimeter", "", 0.5),
    Parameter("fc", "forward capacitance coefficient", "", 0.5),
    Parameter("cgso", "gate-source overlap capacitance by width", "F/m"),
    Parameter("cgdo", "gate-drain overlap capacitance by width", "F/m"),
    Parameter("cgbo", "gate-body overlap capacitance by length", "F/m"),
    Parameter("tox", "thickness of the oxide: charges of the channel", "m"),
    Parameter("u0", "mobility, for kp", "cm2/Vs", 600.0, aliases=("uo",)),
    Parameter("nsub", "doping of the body, for phi, gamma, vto", "1/cm3"),
    Parameter("nss", "density of surface states, for vto", "1/cm2", 0.0),
    Parameter("tpg", "gate: 1 opposite to body, -1 like body, 0 aluminium", "", 1.0),
    Parameter("ld", "lateral diffusion, on each side of the length", "m", 0.0),
    Parameter("l", "length of the channel, if the line gives none", "m"),
    Parameter("w", "width of the channel, if the line gives none", "m"),
    Parameter("tnom", "temperature at which parameters are given", "C", aliases=("tref",)),
    Parameter("t_abs", "temperature of its transistors", "C"),
    Parameter("switch", "read the card as that of a switch"),
    refused("rb", "body resistance", _RESISTOR, "Ohm"),
    refused("wd", "lateral diffusion of the width", "give the effective width, W=", "m"),
    inert("kf", "flicker noise"),
    inert("af", "flicker noise"),
    inert("nlev", "noise equation"),
    inert("gdsnoi", "noise"),
    # of LEVEL 2 and 3, which LEVEL=1 of all simulators leaves out
    *(
        inert(name, "parameter of other levels")
        for name in ("xj", "ucrit", "uexp", "utra", "vmax", "neff", "delta", "theta", "eta")
    ),
    *(inert(name, "parameter of other levels") for name in ("kappa", "nfs", "xqc")),
    *RATINGS,
)

#: parameter, effect, unit
EFFECTS = (
    ("vto", "threshold", "V"),
    ("kp", "transconductance", "A/V2"),
    ("gamma", "body effect", "V^0.5"),
    ("lambda", "channel length modulation", "1/V"),
    ("rd", "drain resistance", "Ohm"),
    ("rs", "source resistance", "Ohm"),
    ("rsh", "sheet resistance", "Ohm"),
    ("rg", "gate resistance", "Ohm"),
    ("rds", "drain-source resistance", "Ohm"),
    ("is", "body junctions", "A"),
    ("js", "body junctions by area", "A/m2"),
    ("cbd", "body-drain charge", "F"),
    ("cbs", "body-source charge", "F"),
    ("cj", "body charge by area", "F/m2"),
    ("cjsw", "body charge by perimeter", "F/m"),
    ("cgso", "gate-source overlap", "F/m"),
    ("cgdo", "gate-drain overlap", "F/m"),
    ("cgbo", "gate-body overlap", "F/m"),
    ("tt", "body transit", "s"),
    ("tox", "channel charge", "m"),
    ("tnom", "nominal temperature", "C"),
    ("t_abs", "own temperature", "C"),
)
#: zero means "no such effect"
NEUTRAL_ZERO = frozenset(
    {"gamma", "lambda", "rd", "rs", "rsh", "is", "js", "cbd", "cbs", "cj", "cjsw"}
    | {"cgso", "cgdo", "cgbo", "tox", "rg", "tt"}
)
_POSITIVE = frozenset(["n", "rds", "kp", "phi", "pb", "u0", "nsub", "l", "w"])
_SIGNED = frozenset(["level", "vto", "tpg", "tnom", "t_abs", "ld", "switch", "nss"])


def check_card(model: Model, findings: Findings) -> dict[str, float] | None:
    """Return the given parameters of a model card, or None after reporting what is wrong.

    Parameters
    ----------
    model : Model
        Of type ``nmos`` or ``pmos``.
    findings : Findings
    """
    return checked(CARD, model, findings)


def checked(table: Table, model: Model, findings: Findings) -> dict[str, float] | None:
    """Return what a card gives of the parameters in a table, None after reporting what is wrong."""
    owner = f"model {model.name}"
    before = len(findings.errors)
    given = table.read(model.params, owner, findings)
    check_bounds(given, model, findings, positive=_POSITIVE, free=_SIGNED)
    if given.get("nsub") and not given["nsub"] * 1e6 > INTRINSIC:
        message = f"{owner}: nsub={given['nsub']:g} is not above the intrinsic density 1.45e10"
        findings.error("NS2005", message, model.params["nsub"].span)
    if given.get("tpg", 1.0) not in (-1.0, 0.0, 1.0):
        message = f"{owner}: tpg={given['tpg']:g} must be 1, 0 or -1"
        findings.error("NS2005", message, model.params["tpg"].span)
    for key in ("nsub", "u0"):
        if key in given and not given.get("tox"):
            findings.warning("NS2052", f"{owner}: {key} has no effect without tox", model.span)
    if math.isinf(given.get("rds", 0.0)):
        del given["rds"]
    for key in ("mj", "mjsw"):
        limited(given, key, STEEPEST, model, findings)
    return given if len(findings.errors) == before else None


#: density of carriers in pure silicon [1/m3]
INTRINSIC = 1.45e16
