"""``nsspice explain``: what a netlist is and how it would be solved, without solving it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from ..errors import NsspiceError
from .options import json_option, read_params
from .report import print_json, report_warnings

_LISTED = 40


@click.command("explain", short_help="tell how a netlist would be solved")
@click.argument("netlist")
@click.option("--matrices", is_flag=True, help="Print the matrices of the complementarity form.")
@click.option("--param", "params", multiple=True, metavar="NAME=VALUE", help="Replace a .param.")
@json_option
def command(netlist: str, matrices: bool, params: Sequence[str], as_json: bool) -> None:
    """Print islands, unknowns, problem class and active effects of NETLIST, not simulating it."""
    from ..analyses.load import read

    circuit = read(Path(netlist), read_params(params))
    islands = [explain_island(k, island, matrices) for k, island in enumerate(circuit.islands, 1)]
    if as_json:
        print_json(
            {
                "netlist": netlist,
                "title": circuit.deck.title,
                "islands": islands,
                "warnings": [w.to_dict() for w in circuit.warnings],
            }
        )
        return
    report_warnings(circuit.warnings)
    click.echo(f"{netlist}: {circuit.deck.title}")
    count = len(islands)
    click.echo(f"{len(circuit.devices)} elements in {count} island{'s' * (count != 1)}")
    for island in islands:
        click.echo("\n" + _text(island))


def explain_island(number: int, island: Any, matrices: bool) -> dict[str, Any]:
    """Return everything known about an island without solving it, JSON-ready.

    Parameters
    ----------
    number : int
        Counted from 1.
    island : Island
    matrices : bool
        Add the DLCP form.
    """
    mna = island.assemble()
    static = mna.system.static
    data: dict[str, Any] = {
        "number": number,
        "class": island.problem_class.name,
        "class_name": island.problem_class.value,
        "reason": island.reason,
        "solved_by": _solved_by(static),
        "unknowns": mna.unknowns,
        "pairs": mna.pairs,
        "switches": [mna.pairs[s.pair] for s in mna.system.switches],
        "nodes": island.nodes,
        "elements": [
            {
                "name": device.name,
                "kind": device.KIND,
                "effects": [
                    {
                        "name": e.name,
                        "parameter": e.parameter or None,
                        "value": e.value,
                        "unit": e.unit,
                        "text": str(e),
                    }
                    for e in device.effects
                ],
            }
            for device in island.devices
        ],
    }
    if matrices:
        from ..circuit.dlcp import dlcp_form

        try:
            data["dlcp"] = dlcp_form(mna).to_dict()
        except NsspiceError as error:  # the rest of the explanation stands without it
            data["dlcp"] = None
            data["dlcp_problem"] = [d.to_dict() for d in error.diagnostics]
    return data


def _solved_by(static: bool) -> str:
    if static:
        return "point by point: one complementarity problem for each output time, no time stepping"
    return "Moreau time stepping (method moreau): one complementarity problem for each step"


def _text(island: dict[str, Any]) -> str:
    lines = [f"island {island['number']}: {island['class']}, {island['class_name']}"]
    lines.append(f"  why        {island['reason']}")
    lines.append(f"  solved     {island['solved_by']}")
    lines.append(f"  unknowns   {_list(island['unknowns'])}")
    lines.append(f"  pairs      {_list(island['pairs'])}")
    if island["switches"]:
        lines.append(f"  switched   {_list(island['switches'])}")
    lines.append("  effects")
    elements = island["elements"]
    width = max((len(e["name"]) for e in elements[:_LISTED]), default=0)
    for element in elements[:_LISTED]:
        effects = ", ".join(e["text"] for e in element["effects"]) or "-"
        lines.append(f"    {element['name']:<{width}}  {element['kind']}: {effects}")
    if len(elements) > _LISTED:
        lines.append(f"    ... and {len(elements) - _LISTED} more (all with --json)")
    if island.get("dlcp"):
        lines += _matrices(island["dlcp"])
    for problem in island.get("dlcp_problem", ()):
        lines.append(f"  no DLCP form: {problem['message']}")
    return "\n".join(lines)


def _list(names: Sequence[str], most: int = 24) -> str:
    text = ", ".join(names[:most]) or "none"
    return f"{len(names)}: {text}" + (", ..." if len(names) > most else "") if names else "none"


def _matrices(form: dict[str, Any]) -> list[str]:
    """Return the DLCP form as a block of text."""
    lines = [
        "  DLCP form",
        "    x' = A x + B u + F s + F1 s' + a,  y = C x + D u + G s + c,  0 <= u _|_ y >= 0",
    ]
    names = {"x": form["states"], "u": form["inputs"], "y": form["outputs"], "s": form["sources"]}
    lines += [f"    {letter} = ({', '.join(items)})" for letter, items in names.items()]
    sides = {
        "A": ("states", "states"),
        "B": ("states", "inputs"),
        "C": ("outputs", "states"),
        "D": ("outputs", "inputs"),
        "F": ("states", "sources"),
        "G": ("outputs", "sources"),
        "F1": ("states", "sources"),
    }
    for name, (rows, columns) in sides.items():
        if not form[rows] or not form[columns]:
            continue
        if name == "F1" and not any(map(any, form[name])):
            continue
        lines += _matrix(name, form[name])
    for name in ("a", "c"):
        if any(form[name]):
            lines += _matrix(name, [[value] for value in form[name]])
    return lines


def _matrix(name: str, rows: Sequence[Sequence[float]]) -> list[str]:
    cells = [[f"{value:.10g}" for value in row] for row in rows]
    width = max(len(cell) for row in cells for cell in row)
    lines = []
    for k, row in enumerate(cells):
        head = f"    {name:>2} = " if k == 0 else " " * 9
        lines.append(f"{head}[ {'  '.join(cell.rjust(width) for cell in row)} ]")
    return lines
