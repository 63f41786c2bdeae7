"""Diodes of any law inside another element, whose model card one of its parameters names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..device import Context
from .broken_junction import as_lines
from .diode import curve_body, is_smooth, model_law
from .diode_branch import Body, JunctionBody, Leg
from .junction_diode import junction_law
from .leg_device import series_drop

if TYPE_CHECKING:
    from ...netlist.deck import Element, Model
    from ...netlist.findings import Findings


def named_leg(
    element: Element,
    key: str,
    diode: Model | None,
    parallel: float,
    temperature: tuple[float | None, float],
    context: Context,
) -> Leg | None:
    """Return one diode of a transistor, or None after reporting why not.

    Parameters
    ----------
    element : Element
    key : str
        The parameter that names the card: ``de``, ``dc``, ``body``.
    diode : Model or None
        The card; without one the diode is ideal.
    parallel : float
    temperature : (float or None, float)
        Own temperature [degrees Celsius], and above the circuit's [K].
    context : Context
    """
    if diode is not None and diode.type != "d":
        _wrong_type(element, key, diode, context.findings)
        return None
    body: Body | None
    if diode is not None and is_smooth(diode):
        junction = junction_law(diode, context)
        if junction is None:
            return None
        body = as_lines(JunctionBody(junction, parallel, *temperature), element, context)
        if body is None:
            return None
    else:
        law = model_law(diode, context)
        if law is None:
            return None
        body = curve_body(law, parallel, context)
    return Leg(body, series_drop(None, diode, context.findings), parallel)


def _wrong_type(element: Element, key: str, diode: Model, findings: Findings) -> None:
    """Report a junction whose model is not a diode."""
    findings.error(
        "NS2002",
        f"{key} of {element.name} needs a .model of type d, but {diode.name} is of type "
        f"{diode.type}",
        element.span,
        f"the card is at {diode.span}",
    )
