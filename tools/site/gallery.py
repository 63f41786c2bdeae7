"""The pages of the gallery: every netlist with its waveforms and its expected results."""

from __future__ import annotations

import io
from functools import cache
from pathlib import Path

import nsspice
from nsspice.compare.expect import check
from nsspice.output.report import page_of
from nsspice.output.schematic import schematic

try:
    import tomllib
except ImportError:  # Python 3.10
    import tomli as tomllib

#: where the page of the gallery shows them
THUMBNAILS = "<!-- thumbnails -->"
#: bytes of the curves of a report
CURVES = 150_000
#: elements of a schematic that can be read
PARTS = 40

HEADINGS = {
    "basics": "Basics: one idea each",
    "rectifiers": "Rectifiers, clamps and multipliers",
    "converters": "Switching converters",
    "control": "Control",
    "steady": "Periodic steady states",
    "smooth": "Rectifiers with SPICE's smooth diodes",
    "bipolar": "Bipolar transistors",
    "devices": "MOSFETs, IGBTs, hysteresis",
    "thesis": "The thesis as circuits",
    "pathological": "Hard cases",
}


def pages(root: Path) -> dict[str, str | bytes]:
    """Return the pages and their pictures by the name of their file in the site."""
    made: dict[str, str | bytes] = {}
    for folder, heading in HEADINGS.items():
        parts = [f"# {heading}\n"]
        for netlist in sorted((root / folder).glob("*.net")):
            picture = draw(netlist)
            name = f"gallery/{folder}/{netlist.stem}.svg"
            if picture is not None:
                made[name] = picture
            scheme = draw_schematic(netlist)
            shape = f"{folder}/{netlist.stem}.schematic.svg" if scheme else None
            if scheme is not None:
                made[f"gallery/{shape}"] = scheme
            shown = name.removeprefix("gallery/") if picture else None
            explored = report(netlist) if picture is not None else None
            if explored is not None:
                made[f"gallery/{folder}/{netlist.stem}.report.html"] = explored
            runs.cache_clear()
            parts.append(entry(netlist, shown, shape))
        made[f"gallery/{folder}.md"] = "\n".join(parts)
    return made


def thumbnails(root: Path) -> str:
    """Return small schematics of all folders, each a link to its section."""
    parts = []
    for folder, heading in HEADINGS.items():
        cards = []
        for netlist in sorted((root / folder).glob("*.net")):
            if draw_schematic(netlist) is not None:
                name = netlist.stem.replace("_", " ")
                image = f"![]({folder}/{netlist.stem}.schematic.svg){{ loading=lazy }}"
                cards.append(f"- [{image} {name}]({folder}.md#{netlist.stem.lower().replace('_', '-')})")
        if cards:
            parts.append(f"## [{heading}]({folder}.md)\n\n<div class=\"thumbnails\" markdown>\n")
            parts.append("\n".join(cards) + "\n\n</div>\n")
    return "\n".join(parts)


def draw_schematic(netlist: Path) -> bytes | None:
    """Return the schematic of a netlist, None for one that is refused or too large to read."""
    try:
        circuit = nsspice.read(netlist)
    except nsspice.NsspiceError:
        return None
    if not 1 < len(circuit.deck.elements) <= PARTS:
        return None
    return schematic(circuit).encode()


@cache
def runs(netlist: Path) -> tuple[nsspice.Circuit, list[nsspice.Solution]] | None:
    """Return the circuit of a netlist and its runs, None where it is refused."""
    try:
        circuit = nsspice.read(netlist)
        return circuit, circuit.run()
    except nsspice.NsspiceError:
        return None


def draw(netlist: Path) -> bytes | None:
    """Return the default picture of a netlist's last analysis, None where there is none."""
    found = runs(netlist)
    drawable = [s for s in found[1] if s.axis.size > 1] if found else []
    if not drawable:
        return None
    try:
        figure = drawable[-1].plot()
    except nsspice.NsspiceError:
        return None
    stream = io.BytesIO()
    figure.savefig(stream, format="svg", bbox_inches="tight")
    return stream.getvalue()


def report(netlist: Path) -> bytes | None:
    """Return the interactive page of a netlist's runs, with fewer points than usual."""
    found = runs(netlist)
    if found is None:
        return None
    return page_of(*found, CURVES).encode()


def entry(netlist: Path, picture: str | None, drawing: str | None) -> str:
    """Return the section of a netlist: title, schematic, waveforms, expected results, deck."""
    text = netlist.read_text("utf-8")
    title = text.splitlines()[0].lstrip("* ")
    expected = tomllib.loads(netlist.with_suffix(".expect.toml").read_text("utf-8"))
    report = check(netlist.with_suffix(".expect.toml"))
    parts = [f"## {netlist.stem.replace('_', ' ')}\n", f"{title}.\n"]
    if drawing:
        parts.append(f"![schematic of {netlist.stem}]({drawing}){{ .schematic loading=lazy }}\n")
    if picture:
        parts.append(f"![waveforms of {netlist.stem}]({picture}){{ .waveform loading=lazy }}\n")
        parts.append(f"[Explore the waveforms]({picture.removesuffix('.svg')}.report.html) ·")
    if "refused" not in expected:
        deck = f"{netlist.parent.name}/{netlist.stem}"
        # no link of Markdown: the part behind # is for the page's script
        parts.append(f'<a href="../../playground/#deck={deck}">Run it in the browser</a>\n')
    else:
        parts.append(f"Must be refused with `{expected['refused']['code']}`.\n")
    rows = [f"| {line(c)} | {'met' if report.passed else 'MISSED'} |" for c in checks(expected)]
    if rows:
        head = "| expected | tolerance | why | |\n|---|---|---|---|"
        parts.append(f'??? note "Expected results"\n\n{indent(head)}\n{indent(chr(10).join(rows))}\n')
    source = " ".join(str(expected.get("source", "")).split())
    if source:
        parts.append(f"Source: {source}\n")
    parts.append(f'??? example "The deck, {netlist.name}"\n\n{indent(f"```spice{chr(10)}{text.strip()}{chr(10)}```")}\n')
    return "\n".join(parts)


def checks(expected: dict[str, object]) -> list[dict[str, object]]:
    """Return the checks of an expectation."""
    found = expected.get("check", [])
    assert isinstance(found, list)
    return found


def line(check: dict[str, object]) -> str:
    """Return what a check asks for, its tolerance and the reason, as cells of a table."""
    what = next((f"{k} `{check[k]}`" for k in ("signal", "measure", "impulse") if k in check), "")
    where = f" at {check['at']}" if "at" in check else f" {check.get('statistic', '')}"
    value = check.get("value", f"as in `{check['reference']}`" if "reference" in check else "")
    why = str(check.get("why", "")).replace("|", "/")
    return f"{what}{where} = {value} | {check.get('tolerance', '')} | {why}"


def indent(text: str) -> str:
    """Return lines moved in by four columns, as the folded parts of a page need."""
    return "\n".join("    " + row for row in text.splitlines())
