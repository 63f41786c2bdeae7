"""Parasitics that LTspice writes on the line of an element, as elements of their own.

    a --- rser --- lser --- element --- b        rlshunt lies across lser,
                                                 rpar and cpar across all of it

They are named by the element and the parameter, ``l1.rser``; the nodes between them, ``l1#rser``,
are not among the signals unless they are asked for.  The element keeps its name: ``i(l1)`` is the
current of the inductance alone, ``ic=`` is its own, and a coupling finds it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from ..deck import Element, Param
from ..findings import Findings, Unreadable

SERIES = ("rser", "lser")
PARALLEL = ("rpar", "cpar")
PARASITICS = frozenset({*SERIES, "rlshunt", *PARALLEL})


def port_impedance(element: Element) -> float:
    """Return the impedance of a port [Ohm], which is positive."""
    given = element.params.get("z0")
    value = 50.0 if given is None else given.value
    if not isinstance(value, float) or not 0.0 < value < math.inf:
        message = f"{element.name}: the impedance z0 of a port is a positive number"
        raise Unreadable("NS1025", message, element.span, "write portnum 1 z0 50")
    return value


def taken_apart(element: Element, findings: Findings) -> Iterator[Element]:
    """Yield an element without its parasitics, and an element for each of them.

    A parasitic of zero is none: LTspice's catalogues write ``Rpar=0 Cpar=0`` so.

    Parameters
    ----------
    element : Element
        ``Rser Rlshunt Rpar`` [Ohm], ``Lser`` [H], ``Cpar`` [F] among its parameters.
    findings : Findings
        Receives a warning about a shunt across nothing.

    Raises
    ------
    Unreadable
        If one of them is a word.

    Examples
    --------
    >>> from nsspice.netlist import parse_text
    >>> deck = parse_text("coil\\nL1 a 0 1m Rser=2 Cpar=3p\\nR1 a 0 1\\n")
    >>> [(e.name, e.nodes) for e in deck.elements[:3]]
    [('l1', ('l1#rser', '0')), ('l1.rser', ('a', 'l1#rser')), ('l1.cpar', ('a', '0'))]
    """
    from .core import with_core

    given = {key: p for key, p in element.params.items() if key in PARASITICS}
    if "portnum" in element.params:
        if "rser" in given:
            message = f"{element.name}: a port has an impedance z0, and no rser besides"
            raise Unreadable("NS1009", message, given["rser"].span, "remove one of them")
        where = element.params["portnum"].span
        given["rser"] = Param("rser", port_impedance(element), where)
    if not given:
        yield from with_core(element, findings)
        return
    for key, param in given.items():
        if isinstance(param.value, str):
            message = f"{element.name}: {key}={param.value} is not a number"
            raise Unreadable("NS1010", message, param.span, "define it with .param")
    kept = {key: p for key, p in element.params.items() if key not in PARASITICS}
    multiple = {"m": kept["m"]} if "m" in kept else {}
    given = {key: p for key, p in given.items() if p.value != 0.0}
    a, b = element.nodes
    places = dict.fromkeys(PARALLEL, (a, b))
    inner = a
    for key in SERIES:
        if key in given:
            outer, inner = inner, f"{element.name}#{key}"
            places[key] = (outer, inner)
    if "lser" in places:
        places["rlshunt"] = places["lser"]
    elif "rlshunt" in given:
        message = (
            f"{element.name}: rlshunt is ignored: it is connected across lser, which is not given"
        )
        findings.warning("NS1003", message, given["rlshunt"].span)
    yield from with_core(replace(element, nodes=(inner, b), params=kept), findings)
    for key, param in given.items():
        if key in places:
            yield Element(
                f"{element.name}.{key}",
                key[0],
                places[key],
                param.span,
                value=param.value,  # type: ignore[arg-type]
                params=multiple,
                node_spans=element.node_spans,
            )
