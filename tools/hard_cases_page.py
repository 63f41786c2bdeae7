"""Writes docs/reference/hard-cases.md and its pictures from what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import nsspice
from nsspice.compare.expectation import read_expectation

#: heading by the first word of a deck's name
GROUPS = {
    "jump": "Jumps and impulses",
    "slide": "Zeno points, sliding and chattering",
    "several": "Several solutions",
    "degenerate": "Degenerate, but solvable",
    "refused": "Infeasible, refused by name",
    "extreme": "Extremes",
    "report": "Reported by users of other programs",
}
INTRO = """# Hard cases, measured

Every netlist in `netlists/pathological` with nsspice and with ngspice;
[the hard cases](../explanation/stability.md) explains how nsspice treats each class.

The column *ngspice* was measured with ngspice-39 on the same circuit, ideal laws replaced
by sharp smooth ones as in `nsspice compare`, {patience} s for each attempt. "Right" means that
ngspice agrees with every known answer that it can give (it has no impulses) within 2 % of the
range of the signals. For Siconos and Pulsim see [below](#siconos-and-pulsim).

| | cases |
|---|---|
{tally}

`python tools/hard_cases.py` repeats the measurements and writes this page.
"""
PEERS = """
## Siconos and Pulsim

Siconos 4.4 (Debian's `python3-siconos`) steps complementarity systems that the user has
derived by hand; Pulsim has its own circuit description, with diodes as conductances of 1e9 and
1e-12 S. Neither reads netlists, so the cases above are represented by five that they can express,
`python tools/hard_cases.py peers`:

| case | right at the end | Siconos, implicit Euler | Pulsim |
|---|---|---|---|
{rows}

What cannot be expressed: Siconos takes matrices, so inconsistent initial states, a loop of
capacitors, a switch with a threshold or a source with breakpoints must be derived and programmed
by the user, and an infeasible problem cannot be refused by element name. The elements of Pulsim 2
are R, L, C, sources, switches, diodes and transistors: it has no friction, no relay without
hysteresis and no report of impulses, and its event engine refuses initial values with a message
(its fixed step of 100 ns was used for the two cases that have them).
"""


def write(found: dict[str, Any], peers: dict[str, Any], root: Path) -> None:
    """Write the page and the pictures."""
    images = root / "docs" / "images" / "hard"
    images.mkdir(parents=True, exist_ok=True)
    verdicts = [entry["ngspice"]["verdict"] for entry in found.values()]
    held = sum(entry["nsspice"]["passed"] for entry in found.values())
    tally = [
        ("nsspice: known answer found, or refused by name", held),
        ("ngspice: right", verdicts.count("right") + verdicts.count("runs")),
        ("ngspice: stops with an error or runs out of time", verdicts.count("fails")),
        ("ngspice: a wrong answer without any message", verdicts.count("wrong")),
        ("ngspice: an answer for a circuit that has none", verdicts.count("silent")),
    ]
    counts = [f"| {what} | {number} |" for what, number in tally]
    lines = [INTRO.format(patience=12, tally="\n".join(counts))]
    for prefix, heading in GROUPS.items():
        lines += [f"\n## {heading}\n", "| case | nsspice | ngspice | |", "|---|---|---|---|"]
        for name, entry in found.items():
            if name.startswith(prefix + "_"):
                title = entry["title"].partition(": ")[2] or entry["title"]
                picture = draw(root / "netlists" / "pathological" / f"{name}.net", images)
                shown = f"![{name}](../images/hard/{picture})" if picture else ""
                text = entry["ngspice"]["text"].replace("|", "/")
                lines.append(
                    f"| {title} (`{name}`) | {entry['nsspice']['text']} | {text} | {shown} |"
                )
    rows = [
        f"| {case} | {told(here, 'right')} | {told(here.get('siconos', {}))} "
        f"| {told(here.get('pulsim', {}))} |"
        for case, both in peers.items()
        for here in [{**both, **next(iter(both.values()))}]
    ]
    lines.append(PEERS.format(rows="\n".join(rows)))
    page = root / "docs" / "reference" / "hard-cases.md"
    page.write_text("\n".join(lines).rstrip() + "\n")


def told(result: dict[str, Any], what: str = "found") -> str:
    """Return a number, or what hindered it."""
    if "error" in result and what == "found":
        return "refuses: " + str(result["error"]).replace("|", "/")[:80]
    return f"{result[what]:.6g}" if what in result else "cannot be expressed"


def draw(netlist: Path, folder: Path) -> str | None:
    """Draw the signals that the checks read; return the name of the picture."""
    expectation = read_expectation(netlist)
    if expectation.refused is not None:
        return None
    checked = [c for c in expectation.checks if hasattr(c, "signal")]
    (solution, *_) = nsspice.read(netlist).run(extra=checks_of(checked))
    if solution.analysis == "op":
        return None
    names = list(dict.fromkeys(checks_of(checked)))[:3] or solution.columns[:2]
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(2.9, 1.5), dpi=72)
    rows = solution.with_jumps()
    for name in names:
        axes.plot(rows.axis, rows[name], linewidth=1, label=name)
    axes.tick_params(labelsize=6)
    axes.legend(fontsize=6, frameon=False)
    figure.tight_layout(pad=0.3)
    figure.savefig(folder / f"{netlist.stem}.png")
    pyplot.close(figure)
    return f"{netlist.stem}.png"


def checks_of(checks: list[Any]) -> list[str]:
    """Return the signals of checks, in order."""
    return [name for check in checks for name in check.signals()]
