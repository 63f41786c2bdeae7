"""What an SCR model card says, and which of its three laws it asks for."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from ...netlist.expressions.expression import Expression
from ..parameter import Parameter, Table, inert

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model
    from ...netlist.findings import Findings

CARD = Table(
    Parameter("vbo", "breakover voltage without gate current", "V"),
    Parameter("vh", "holding voltage", "V", 0.0, aliases=("vfwd",)),
    Parameter("ih", "holding current", "A"),
    Parameter("ron", "resistance while it conducts, with v= beyond alpha", "Ohm", 0.0),
    Parameter("alpha", "current up to which v= holds", "A", math.inf),
    Parameter("vrev", "reverse breakdown voltage, positive", "V"),
    Parameter("rrev", "resistance in reverse breakdown, default ron", "Ohm"),
    Parameter("igt", "gate current that triggers", "A"),
    Parameter("vgt", "gate voltage that triggers; with igt, the drop of the gate", "V", 0.0),
    Parameter("rg", "resistance of the gate", "Ohm", 0.0),
    *(inert(name, "rating or note") for name in ("mfg", "type", "iave", "vpk", "irms", "ipk")),
)
#: effects of the parameters: name, unit, power of the number of parallel thyristors
EFFECTS = (
    ("vbo", "breakover", "V", 0),
    ("vh", "holding voltage", "V", 0),
    ("ih", "holding current", "A", 1),
    ("alpha", "end of the curve", "A", 1),
    ("ron", "on-resistance", "Ohm", -1),
    ("vrev", "reverse breakdown", "V", 0),
    ("rrev", "breakdown resistance", "Ohm", -1),
    ("igt", "gate trigger current", "A", 1),
    ("vgt", "gate voltage", "V", 0),
    ("rg", "gate resistance", "Ohm", -1),
)
_FORMS = (
    "give igt or vgt for an ideal thyristor fired by its gate; vbo, vh, ih, ron (and igt) for "
    "one with a falling characteristic; or the curve V={expr(i)} with alpha and ron"
)


def latches(card: Mapping[str, float], curve: Expression | None) -> bool:
    """Return whether the card asks for the ideal thyristor: neither a curve nor a holding current.

    Examples
    --------
    >>> latches({"vgt": 1.0}, None), latches({"vbo": 600.0, "ih": 0.1}, None)
    (True, False)
    """
    return curve is None and "ih" not in card


def check_card(
    element: Element,
    model: Model,
    card: Mapping[str, float],
    curve: Expression | None,
    findings: Findings,
) -> None:
    """Report parameters that are missing, superfluous or impossible."""

    def wrong(key: str, message: str, hint: str) -> None:
        span = model.params[key].span if key in model.params else model.span
        findings.error("NS2005", f"model {model.name}: {message}", span, hint)

    gated = len(element.nodes) > 2
    for key in _missing(card, curve, gated):
        wrong(key, f"{key} is missing for {element.name}", _FORMS)
    for key in ("vbo", "ih", "igt"):
        if card.get(key, 1.0) <= 0.0:
            wrong(key, f"{key}={card[key]:g} must be positive", "give a positive number")
    if curve is None:
        if card.get("vbo", math.inf) < card.get("vh", 0.0):
            wrong("vbo", "the breakover voltage is below the holding voltage", "give vbo > vh")
        if "alpha" in card:
            wrong("alpha", "alpha belongs to a curve V={expr(i)}", _FORMS)
    else:
        for key in ("vbo", "vh", "ih", "igt"):
            if key in card:
                wrong(key, f"{key} is given together with a curve V={{expr(i)}}", _FORMS)
        if gated:
            message = f"{element.name} has a gate, which a curve V={{expr(i)}} does not read"
            wrong("v", message, _FORMS)
        if card.get("alpha", 1.0) <= 0.0:
            wrong("alpha", "alpha must be positive", _FORMS)
    for key in ("ron", "rrev", "rg", "vh", "vgt"):
        if card.get(key, 0.0) < 0.0:
            wrong(key, f"{key}={card[key]:g} must not be negative", "give a positive number")
    if card.get("vrev", 1.0) < 0.0:
        wrong("vrev", "vrev must not be negative", "it is the height of the reverse breakdown")


def _missing(card: Mapping[str, float], curve: Expression | None, gated: bool) -> list[str]:
    """Return the parameters without which the law says nothing."""
    if curve is not None:
        return []
    if latches(card, curve):
        if gated:
            return [] if "igt" in card or "vgt" in card else ["igt or vgt"]
        needed = ["vbo"]
    else:
        needed = ["vbo", "igt"] if gated else ["vbo"]
    return [key for key in needed if key not in card]
