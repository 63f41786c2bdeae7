"""``nsspice plecs``: a vendor's thermal description for PLECS as a model card."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import click

from ...errors import Diagnostic, UsageError
from ...output.files import output_error
from ..options import json_option
from ..report import print_json, show

_WIDTH = 92


class Energies(NamedTuple):
    """Energies of a switching on a grid.

    Parameters
    ----------
    currents, voltages, temperatures : tuple of float
        [A], [V], [C]
    values : list
        [J], by temperature, then voltage, then current.
    formula : str
        What PLECS would multiply the table by, empty if nothing.
    """

    currents: tuple[float, ...]
    voltages: tuple[float, ...]
    temperatures: tuple[float, ...]
    values: list[list[list[float]]]
    formula: str

    def quadrant(self, current: int, voltage: int) -> Energies | None:
        """Return the part with these signs of current and voltage, None if it is zero."""
        i = sorted((abs(x), k) for k, x in enumerate(self.currents) if x * current >= 0.0)
        v = sorted((abs(x), k) for k, x in enumerate(self.voltages) if x * voltage >= 0.0)
        values = [[[t[b][a] for _, a in i] for _, b in v] for t in self.values]
        if not any(e for t in values for row in t for e in row):
            return None
        sizes = tuple(x for x, _ in i), tuple(x for x, _ in v)
        return Energies(*sizes, self.temperatures, values, self.formula)

    def text(self) -> str:
        """Return the table of a model card."""
        axes = [("i", self.currents), ("v", self.voltages), ("t", self.temperatures)]
        shown = [f"{name}={_numbers(axis)}" for name, axis in axes if len(axis) > 1]
        flat = [e for t in self.values for row in t for e in row]
        return f"table({' '.join([*shown, f'e={_numbers(flat)}'])})"


@click.command("plecs", short_help="turn a PLECS thermal description into a model card")
@click.argument("file", metavar="FILE.xml")
@json_option
def command(file: str, as_json: bool) -> None:
    """Print the .model card of a thermal description (.xml) as vendors offer them for PLECS.

    Switching energies become Eon, Eoff and Err tables, the thermal model a Foster or Cauer chain.
    The on-state drop becomes a threshold and a resistance: the line of least squares at the highest
    temperature.
    """
    try:
        text = Path(file).read_text("utf-8")
    except OSError as error:
        raise output_error(error, file) from error
    found = card(text, file)
    if as_json:
        print_json({"card": found})
    else:
        show(found)


def card(text: str, file: str = "the description") -> str:
    """Return model cards: of the switch, and of the diode where the description has one.

    Parameters
    ----------
    text : str
        The XML.
    file : str
        Its name, for messages.

    Raises
    ------
    UsageError
        NS4008 if it is not such a description.
    """
    try:
        root = ET.fromstring(text)
    except ET.ParseError as error:
        raise _wrong(file, str(error)) from error
    for node in root.iter():
        node.tag = node.tag.rpartition("}")[2]
    package = root if root.tag == "Package" else root.find("Package")
    data = None if package is None else package.find("SemiconductorData")
    if package is None or data is None:
        raise _wrong(file, "it has no Package with SemiconductorData")
    kind = package.get("class") or data.get("type") or ""
    name = re.sub(r"\W+", "_", package.get("partnumber") or "DEVICE")
    if not kind.startswith(("IGBT", "MOSFET", "Diode")):
        raise _wrong(file, f"a description of class {kind!r} is neither switch nor diode")
    on, off = (_energies(data.find(tag), file) for tag in ("TurnOnLoss", "TurnOffLoss"))
    heat = _thermal(package.find("ThermalModel"))
    lines = [f"* {package.get('vendor', '')} {package.get('partnumber', '')}, {kind}".rstrip()]
    if any(table and table.formula for table in (on, off)):
        lines.append("* a formula of the gate resistance is not evaluated: the table is as it is")
    if not kind.startswith("Diode"):
        drop, resistance = _line(data, 1.0, file)
        first = f"NIGBT(ideal VTO=0.5 Vce0={drop:.6g}" if kind.startswith("IGBT") else "SW(VT=0.5"
        tables = [
            f"{word}={found.text()}"
            for word, table in (("Eon", on), ("Eoff", off))
            if table and (found := table.quadrant(1, 1)) is not None
        ]
        lines.append(_card(name, [first, f"Ron={resistance:.6g}", *tables, *heat]))
    diode = kind.startswith("Diode")
    recovery = off.quadrant(1, -1) if off and diode else off.quadrant(-1, 1) if off else None
    if diode or recovery is not None:
        drop, resistance = _line(data, 1.0 if diode else -1.0, file)
        err = [] if recovery is None else [f"Err={recovery.text()}"]
        parts = [f"D(Vfwd={drop:.6g}", f"Ron={resistance:.6g}", *err, *(heat if diode else [])]
        lines.append(_card(name if diode else f"{name}_D", parts))
    return "\n".join(lines)


def _energies(node: ET.Element | None, file: str) -> Energies | None:
    """Return a table of energies, None without one."""
    if node is None or node.find("Energy") is None:
        return None
    axes = [_list(node, tag) for tag in ("CurrentAxis", "VoltageAxis", "TemperatureAxis")]
    energy = node.find("Energy")
    assert energy is not None
    scale = float(energy.get("scale", "1"))
    values = [
        [[scale * float(x) for x in (v.text or "").split()] for v in t.findall("Voltage")]
        for t in energy.findall("Temperature")
    ]
    i, v, t = map(len, axes)
    if [[len(row) for row in part] for part in values] != [[i] * v] * t:
        raise _wrong(file, f"{node.tag} has no energy for each current, voltage and temperature")
    formula = node.findtext("Formula", "") or ""
    plain = node.findtext("ComputationMethod", "Table only") == "Table only"
    return Energies(axes[0], axes[1], axes[2], values, "" if plain else formula)


def _line(data: ET.Element, sign: float, file: str) -> tuple[float, float]:
    """Return threshold [V] and resistance [Ohm] of the on-state at the highest temperature."""
    for node in data.findall("ConductionLoss"):
        drop = node.find("VoltageDrop")
        if drop is None or node.get("gate", "on") == "off":
            continue
        scale, rows = float(drop.get("scale", "1")), drop.findall("Temperature")
        currents, hottest = _list(node, "CurrentAxis"), (rows[-1].text or "").split()
        pairs = [
            (sign * i, sign * scale * float(v))
            for i, v in zip(currents, hottest, strict=True)
            if sign * i > 0.0
        ]
        if len(pairs) > 1:
            n = len(pairs)
            x, y = sum(p[0] for p in pairs) / n, sum(p[1] for p in pairs) / n
            slope = sum((a - x) * (b - y) for a, b in pairs)
            slope /= sum((a - x) ** 2 for a, _ in pairs)
            threshold = y - slope * x
            if threshold >= 0.0 and slope >= 0.0:
                return threshold, slope
            # no threshold: the line through zero
            return 0.0, sum(a * b for a, b in pairs) / sum(a * a for a, _ in pairs)
    raise _wrong(file, "it has no on-state drop for two currents")


def _thermal(node: ET.Element | None) -> list[str]:
    """Return the chain from junction to case."""
    branch = None if node is None else node.find("Branch")
    if branch is None:
        return []
    foster = [(e.get("R", ""), e.get("Tau", "")) for e in branch.findall("RTauElement")]
    cauer = [(e.get("R", ""), e.get("C", "")) for e in branch.findall("RCElement")]
    for word, second, pairs in (("Foster", "tau", foster), ("Cauer", "c", cauer)):
        if pairs:
            r, other = (_numbers(map(float, column)) for column in zip(*pairs, strict=True))
            return [f"{word}=table(r={r} {second}={other})"]
    return []


def _list(node: ET.Element, tag: str) -> tuple[float, ...]:
    return tuple(float(x) for x in (node.findtext(tag) or "").split())


def _numbers(values: Sequence[float] | map[float]) -> str:
    return " ".join(f"{x:.10g}" for x in values)


def _card(name: str, parts: Sequence[str]) -> str:
    """Return a card in lines that continue with +."""
    lines = [f".model {name} {parts[0]}"]
    for word in " ".join(parts[1:]).split(" "):
        if len(lines[-1]) + len(word) > _WIDTH:
            lines.append("+")
        lines[-1] += f" {word}"
    return "\n".join(lines) + ")"


def _wrong(file: str, why: str) -> UsageError:
    hint = "vendors offer them as .xml files with a SemiconductorLibrary or a Package"
    message = f"{file} is not a thermal description for PLECS: {why}"
    return UsageError(Diagnostic("NS4008", message, hint=hint))
