"""Windings on a core with hysteresis, ``K L1 [L2 ...] k core``: the L lines have numbers of turns.

The core is one inductor with hysteresis, of the turns of the first winding; the others are joined
to it by a controlled voltage source and a controlled current source each, an ideal transformer.
With a coupling below one, each winding has a leakage inductance in series: what is not coupled of
the inductance that it has at small currents.

    L1: a - 0 V - leakage - y - core - b      L2: c - 0 V - leakage - E n2/n1 v(y,b) - d
                            y - F -n2/n1 i(L2) - b
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ..deck import Element, Model, Source
from ..elements.core import hysteretic
from ..findings import Findings, Unreadable

if TYPE_CHECKING:
    from ..elements.jiles_atherton import Fit


def wound(elements: Sequence[Element], findings: Findings) -> list[Element]:
    """Return elements with cores and windings for the couplings that name a core.

    Parameters
    ----------
    elements : sequence of Element
    findings : Findings
        Receives how well each core is fitted, and what cannot be built.
    """
    couplings = [e for e in elements if e.letter == "k" and e.model is not None]
    if not couplings:
        return list(elements)
    fits: dict[str, Fit] = {}
    by_name = {e.name: e for e in elements}
    built: dict[str, list[Element]] = {e.name: [] for e in couplings}
    for coupling in couplings:
        assert coupling.model is not None
        try:
            fit = _fit(coupling.model, fits, findings)
            coils = [by_name[name] for name in coupling.controls if name in by_name]
            taken = [coil.name for coil in coils if coil.name in built]
            if taken:
                message = f"{coupling.name}: {taken[0]} is wound on another core"
                raise Unreadable("NS2010", message, coupling.span, "give it one core")
            built.update(_windings(coupling, coils, fit))
        except Unreadable as found:
            findings.record(found)
    return [part for e in elements for part in built.get(e.name, [e])]


def _fit(model: Model, fits: dict[str, Fit], findings: Findings) -> Fit:
    if model.type != "core":
        message = f"model {model.name} is of type {model.type}, not CORE"
        raise Unreadable("NS2001", message, model.span, "write .model name CORE(MS= A= K= C= ...)")
    from ..elements.jiles_atherton import fitted

    if model.name not in fits:
        fit = fits[model.name] = fitted(model)
        message = f"core {model.name} is fitted by a table and {len(fit.levels)} stops; flux "
        message += f"densities differ by up to {fit.loop:.1%} of the largest on the major loop, "
        message += f"and by {fit.first:.1%} on the initial curve"
        hint = "minor loops close, other than those of Jiles and Atherton"
        findings.warning("NS1101", message, model.span, hint)
    return fits[model.name]


def _windings(
    coupling: Element, coils: Sequence[Element], fit: Fit
) -> Iterator[tuple[str, list[Element]]]:
    """Yield the elements of each winding, by its name."""
    k = coupling.value
    if not (isinstance(k, float) and 0.0 < k <= 1.0):
        message = f"{coupling.name}: a coupling by a core is a number above 0, at most 1"
        raise Unreadable("NS2010", message, coupling.span, "1 is a perfect transformer")
    turns = [_turns(coil) for coil in coils]
    permeance, inner = _permeance(fit), ""
    for coil, n in zip(coils, turns, strict=True):
        name, where, ends = coil.name, coil.span, coil.node_spans
        a, b = coil.nodes
        parts = [Element(name, "v", (a, f"{name}#w"), where, source=_zero(coil), node_spans=ends)]
        y = f"{name}#w"
        if k < 1.0 and len(coils) > 1:
            y = f"{name}#k"
            leakage = (1.0 - k) * n**2 * permeance
            parts.append(Element(f"{name}.leak", "l", (f"{name}#w", y), where, value=leakage))
        if not inner:
            inner = y
            core = Element(f"{name}.core", "l", (y, b), where, node_spans=ends)
            parts += hysteretic(core, fit.table(n), fit.stops(n))
        else:
            first = coils[0]
            ratio = n / turns[0]
            back = (inner, first.nodes[1])
            parts.append(Element(f"{name}.e", "e", (y, b), where, back, ratio))
            parts.append(Element(f"{name}.f", "f", back, where, (name,), -ratio))
        yield name, parts


def _permeance(fit: Fit) -> float:
    """Return the inductance of one turn at small currents [H]: table and all stops."""
    current, flux = fit.table(1.0)[len(fit.curve)]
    return 1.0 / (current / flux + sum(1.0 / inductance for _, inductance in fit.stops(1.0)))


def _turns(coil: Element) -> float:
    if not isinstance(coil.value, float) or not coil.value > 0.0:
        message = f"{coil.name}: a winding on a core has a number of turns"
        raise Unreadable("NS1025", message, coil.span, "write L1 a b 20 for 20 turns")
    if coil.params:
        key, param = next(iter(coil.params.items()))
        message = f"{coil.name}: {key} of a winding on a core is not simulated"
        raise Unreadable("NS1002", message, param.span, "leave it out")
    return coil.value


def _zero(coil: Element) -> Source:
    return Source(0.0, None, "", (), {}, coil.span)
