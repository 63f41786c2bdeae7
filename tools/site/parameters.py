"""The reference page of devices, from the parameter tables that read the decks."""

from __future__ import annotations

import importlib
import math
import pkgutil

import nsspice.devices
from nsspice.devices.parameter import Parameter, Table

INTRO = """# Devices and parameters

Every parameter that a deck may give, read from the tables that the program itself reads decks with.
A parameter without a default adds an effect only where it is given. Parameters of the last two kinds
are never dropped in silence: *ignored* ones cannot change a result and are listed in a warning,
*refused* ones are an error unless they have the value that means "no such effect".
"""


def page() -> str:
    """Return the page: a section for each device with the tables of its line and its model card."""
    parts = [INTRO]
    for info in pkgutil.walk_packages(nsspice.devices.__path__, "nsspice.devices."):
        module = importlib.import_module(info.name)
        tables = _tables(module)
        if not tables:
            continue
        title = (module.__doc__ or info.name).strip().splitlines()[0].rstrip(".:")
        parts.append(f"## {title}\n")
        for name, table in tables:
            parts.append(f"**{name}**\n\n{_rows(table)}\n")
    return "\n".join(parts)


def _tables(module: object) -> list[tuple[str, Table]]:
    """Return the tables that a module defines, each once, with the words for them."""
    words = {"INSTANCE": "On the element line", "MODEL": "On the model card", "CARD": "Model card"}
    found: dict[int, tuple[str, Table]] = {}
    holders = [module, *(v for v in vars(module).values() if isinstance(v, type))]
    for holder in holders:
        own = holder is module or getattr(holder, "__module__", "") == module.__name__  # type: ignore[attr-defined]
        for name, value in vars(holder).items() if own else ():
            if isinstance(value, Table) and value.parameters:
                word = words.get(name.strip("_"), name.strip("_").replace("_", " ").capitalize())
                suffix = "" if holder is module else f" ({holder.__name__})"  # type: ignore[attr-defined]
                found.setdefault(id(value), (word + suffix, value))
    return list(found.values())


def _rows(table: Table) -> str:
    lines = ["| parameter | meaning | unit | default |", "|---|---|---|---|"]
    for p in table.parameters:
        names = ", ".join(f"`{n}`" for n in (p.name, *p.aliases))
        lines.append(f"| {names} | {p.meaning} | {p.unit or ''} | {_default(p)} |")
    return "\n".join(lines) + "\n"


def _default(p: Parameter) -> str:
    if p.status == "inert":
        return "*ignored*"
    if p.status == "omitted":
        return "*left out* with a warning, unless 0"
    if p.status == "refused":
        neutral = ", ".join(f"{v:g}" for v in p.neutral)
        return f"*refused* unless {neutral}" + (f"; {p.hint}" if p.hint else "")
    if p.default is None:
        return "no such effect"
    return "∞" if math.isinf(p.default) else f"{p.default:g}"
