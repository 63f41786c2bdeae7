"""The effects of a circuit that may be left out, to see whether they matter."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from ..circuit import Circuit
from ..circuit.line_settings import TOLERANCE
from ..devices.device import Device
from ..devices.diodes.junction_diode import JunctionDiode
from ..devices.mosfets.smooth_mosfet import SmoothMosfet
from ..netlist.deck import Element
from .edits import SET_VALUED, Edit

#: what makes a device what it is: it stays, at any cost
_ESSENTIAL = frozenset(
    ["", "value", "ic", "is", "n", "vt", "it", "von", "voff", "ion", "ioff", "bf", "br", "nf", "nr",
     "alphan", "alphai", "vto", "kp", "mtriode", "ksubthres", "subshift", "theta", "ideal"]
)  # fmt: skip
#: elements so much larger (resistors) or smaller (capacitors) than others of their kind are tried
#: as parasitics; what they do is measured, so that this decides about nothing but the time it takes
_APART = 1e4
#: a measure sees the difference of a law as so much less, since few parts are junctions;
#: a line of hundreds of pieces saves nothing
_LAWS, _FINEST = 5.0, 2e-3


def candidates(circuit: Circuit, names: Iterable[str] = (), tol: float = 1e-3) -> list[Edit]:
    """Return the effects that can be left out, in deck order.

    Parameters
    ----------
    circuit : Circuit
    names : iterable of str
        Elements to try as open circuits besides, such as ``rsnub``.
    tol : float
        Largest relative change of a measure.
    """
    found: dict[tuple[str, str, str], Edit] = {}
    elements = {e.name: e for e in circuit.deck.elements}
    asked = {name.lower() for name in names}
    for device in circuit.devices:
        element = elements.get(device.name)
        if element is None:
            continue
        for edit in (*_of_model(device, element), *_of_parasitic(device, element)):
            found.setdefault((edit.target, edit.kind, edit.key), edit)
    lines = _lines(circuit, tol)
    if lines is not None:
        found[lines.target, lines.kind, lines.key] = lines
    for element in _apart(circuit.deck.elements):
        found.setdefault((element.name, "open", ""), _open(element, "leakage or stray element"))
    for element in _side_by_side(circuit.deck.elements):
        found.setdefault((element.name, "open", ""), _open(element, "parallel diode"))
    for name in asked & elements.keys():
        found.setdefault((name, "open", ""), _open(elements[name], "element"))
    return list(found.values())


def _lines(circuit: Circuit, tol: float) -> Edit | None:
    """Return all junctions as broken lines, where that is possible and new."""
    smooth = [d for d in circuit.devices if d.smooth and d.letter in "dmqjz"]
    if not smooth or not all(isinstance(d, JunctionDiode) and d.leg.drop is None for d in smooth):
        return None
    law = f"lines:{min(TOLERANCE, max(_LAWS * tol, _FINEST)):g}"
    name = "curvature of currents and charges"
    return Edit("junctions", name, f"junctions={law}", "lines", "junctions", smooth[0].span, law)


def _of_model(device: Device, element: Element) -> Iterator[Edit]:
    """Yield the parameters of a model card that call for effects."""
    model = element.model
    if model is None:
        return
    owner = f"model {model.name}"
    smooth = model.type == "d" and not any(k in SET_VALUED for k in model.params)
    if smooth:
        text = "exponential junction"
        yield Edit(owner, text, "is, n and all others", "ideal", model.name, model.span)
    if isinstance(device, SmoothMosfet) and device.letter == "m":
        text = "channel, body diode and charges"
        yield Edit(owner, text, "all: a switch", "switch", model.name, model.span)
    for effect in device.effects:
        key = effect.parameter
        if key in _ESSENTIAL or key not in model.params:
            continue
        value = model.params[key]
        text = f"{key}={value.value:g}" if isinstance(value.value, int | float) else key
        yield Edit(owner, effect.name, text, "parameter", model.name, value.span, key)


def _of_parasitic(device: Device, element: Element) -> Iterator[Edit]:
    """Yield what is written on the line of another element: series ones vanish, others open."""
    _, _, key = element.name.rpartition(".")
    if key in ("rser", "lser"):
        effect = "series resistance" if key == "rser" else "series inductance"
        yield Edit(element.name, effect, _value(element), "short", element.name, element.span)
    elif key in ("rpar", "cpar", "rlshunt"):
        effect = "parallel capacitance" if key == "cpar" else "parallel resistance"
        yield Edit(element.name, effect, _value(element), "open", element.name, element.span)


def _value(element: Element) -> str:
    _, _, key = element.name.rpartition(".")
    value = element.value
    return f"{key}={value:g}" if isinstance(value, int | float) else key


def _open(element: Element, effect: str) -> Edit:
    value = f"{element.value:g}" if isinstance(element.value, int | float) else ""
    return Edit(element.name, effect, value, "open", element.name, element.span)


def _apart(elements: list[Element]) -> Iterator[Element]:
    """Yield resistors far above the least one, and capacitors far below the largest one."""
    for letter, sign in (("r", 1.0), ("c", -1.0)):
        sizes = {
            e.name: float(e.value)
            for e in elements
            if e.letter == letter and "." not in e.name and isinstance(e.value, int | float)
            and e.value > 0.0
        }  # fmt: skip
        if not sizes:
            continue
        bound = min(sizes.values()) * _APART if sign > 0.0 else max(sizes.values()) / _APART
        for element in elements:
            size = sizes.get(element.name)
            if size is not None and sign * (size - bound) >= 0.0:
                yield element


def _side_by_side(elements: list[Element]) -> Iterator[Element]:
    """Yield diodes that conduct between the same nodes as another one, junctions only."""
    diodes = [e for e in elements if e.letter == "d"]
    for element in diodes:
        twins = [e for e in diodes if e is not element and e.nodes == element.nodes]
        smooth = element.model is not None and not any(
            k in SET_VALUED for k in element.model.params
        )
        if twins and smooth:
            yield element
