"""Cross-checks of all netlists with ngspice: docs/reference/ngspice.md, by `make cross-check`.

usage: python tools/ngspice_table.py [--only WORD] [--write docs/reference/ngspice.md]
"""

from __future__ import annotations

import argparse
import platform
import sys
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import nsspice
from nsspice.analyses import Request
from nsspice.analyses.request.load import read_deck
from nsspice.analyses.signals.signal_names import unit
from nsspice.circuit import Circuit, ProblemClass, build
from nsspice.compare.expectation import read_expectation
from nsspice.compare.ngspice import (
    CrossCheck,
    NgspiceError,
    NgspiceRun,
    Options,
    cross_check,
    run,
)
from nsspice.devices.diodes.diode import SET_VALUED
from nsspice.errors import NsspiceError
from nsspice.netlist.deck import Model, Param, TranCard
from nsspice.output.si import number

ROOT = Path(__file__).resolve().parents[1]
#: emission coefficients of sharp junctions
SHARP = (1.0, 0.1, 0.01, 0.001)
MARKER = "<!-- written by tools/ngspice_table.py: do not edit below -->\n"
SMOOTH = (ProblemClass.GE, ProblemClass.DNCP)
#: tolerance of nsspice for smooth laws with storage, and least number of ngspice's steps there,
#: the largest with which it finishes
RELTOL, POINTS = 1e-7, (1_000_000, 100_000, 10_000)
#: what some decks need, found by trying.  Bridge: everything sharper takes ngspice minutes before
#: it fails.  Compliance: its ground has 0.1 mOhm, beside which that of the substitute must vanish
NEEDS = {
    "smooth/bridge": {"method": "gear", "rshunt": 1e7},
    "thesis/ex413_normal_compliance": {
        "method": "trap",
        "max_step": 5e-5,
        "ron": 1e-9,
        "roff": 1e12,
    },
}
#: how long ngspice may take for one run [s]: many of the first table fail, those of the second pass
PATIENCE, LONGER = 100.0, 300.0
#: a benchmark (bench_smooth.py), too large for the tight tolerances of these tables
LARGE = ("adder_4bit.net",)
#: what a smooth deck is held to, as a share of the range of each signal
SMOOTH_TOLERANCE = 1e-4


def netlists(only: str) -> list[Path]:
    """Return all netlists that are meant to run, without those made to break simulators."""
    found = []
    for path in sorted((ROOT / "netlists").rglob("*.net")):
        if "pathological" in path.parts or path.name in LARGE or only not in path.as_posix():
            continue
        expected = path.with_suffix(".expect.toml").exists()
        if not expected or read_expectation(path).refused is None:
            found.append(path)
    return found


def name_of(path: Path) -> str:
    """Return folder and name of a netlist."""
    return path.relative_to(ROOT / "netlists").with_suffix("").as_posix()


def is_smooth(circuit: Circuit) -> bool:
    """Return whether a circuit has smooth nonlinear laws."""
    return any(island.problem_class in SMOOTH for island in circuit.islands)


def stores(circuit: Circuit) -> bool:
    """Return whether a circuit stores energy."""
    stepped = (ProblemClass.DLCP, ProblemClass.DNCP, ProblemClass.LINEAR_DAE)
    return any(island.problem_class in stepped for island in circuit.islands)


def checked(path: Path) -> CrossCheck | NsspiceError:
    """Return the cross-check of a netlist, or why there is none.

    nsspice runs without an error of its own that would be seen: without storage every row is
    exact, the mode-wise engine is exact, and with error control the tolerance is small.
    """
    circuit = nsspice.read(path)
    smooth = is_smooth(circuit)
    tries = [Options(timeout=PATIENCE)]
    request = Request()
    if stores(circuit) and smooth:
        request = Request(method="sdirk", reltol=RELTOL)
        # a junction takes over within less than a microsecond: ngspice needs as short a step
        stop = circuit.deck.analyses[0].tstop  # type: ignore[union-attr]
        tries = [Options(timeout=LONGER, method="trap", max_step=stop / count) for count in POINTS]
    elif stores(circuit):
        request = Request(method="modewise")
    elif smooth and isinstance(card := circuit.deck.analyses[0], TranCard):
        # ngspice changes a substitute over during a step: the error is that of its step
        tries = [Options(timeout=LONGER, max_step=card.tstop / POINTS[1])]
    if name_of(path) in NEEDS:
        tries = [Options(timeout=PATIENCE, **NEEDS[name_of(path)])]  # type: ignore[arg-type]
    for options in tries:
        try:
            return cross_check(circuit, request=request, options=options)
        except NgspiceError as error:
            failure: NsspiceError = error
        except NsspiceError as error:
            return error
    return failure


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines]


def worst(check: CrossCheck, symbol: str) -> str:
    """Return the signal of a unit that differs most, and by how much of its range."""
    rows = [row for row in check.rows if unit(row.signal) == symbol]
    if not rows:
        return ""
    row = max(rows, key=lambda one: one.share("max"))
    return f"{row.share('max'):.1e} `{row.signal}`" if row.share("max") else "0"


def needed(found: NgspiceRun) -> str:
    """Return what ngspice was given in place of the laws it does not have, and what else."""
    options = found.translation.options
    words = []
    laws = " ".join(s.used for s in found.translation.substitutes)
    if "sidiode" in laws or "ron=" in laws:
        words.append(f"ron {options.ron:g}, roff {options.roff:g}")
    if any(s.law == "ideal edge" for s in found.translation.substitutes):
        words.append(f"ramps of {number(options.edge or 0.0, 's', 2)}")
    if any("B source" in s.used for s in found.translation.substitutes):
        words.append("B sources")
    if any("F sources" in s.used for s in found.translation.substitutes):
        words.append("diodes and F sources")
    if found.attempts and options.reltol > found.attempts[0].translation.options.reltol:
        words.append(f"reltol {options.reltol:g}")
    if options.rshunt:
        words.append(f"rshunt {options.rshunt:g}")
    return "; ".join(words) or "nothing"


def failures(attempts: Iterable[NgspiceError]) -> str:
    """Return how often ngspice failed before, and how."""
    reasons: dict[str, int] = {}
    for error in attempts:
        reasons[error.reason] = reasons.get(error.reason, 0) + 1
    return "; ".join(f"{reason} ({count})" for reason, count in reasons.items())


def overview(found: dict[Path, CrossCheck | NsspiceError]) -> list[str]:
    """Return the table of the decks with set-valued or linear elements."""
    rows = []
    for path, check in found.items():
        if isinstance(check, CrossCheck):
            run_ = check.run
            rows.append(
                [
                    name_of(path),
                    needed(run_),
                    failures(run_.attempts),
                    worst(check, "V"),
                    worst(check, "A"),
                ]
            )
        else:
            why = check.diagnostics[0].message.split("\n")[0]
            rows.append([name_of(path), "", why, "", ""])
    head = ("netlist", "ngspice needed", "it failed before that", "voltages", "currents")
    return table(head, rows)


def smooth_table(found: dict[Path, CrossCheck | NsspiceError]) -> list[str]:
    """Return the table of the decks with smooth laws."""
    rows = []
    for path, check in found.items():
        if not isinstance(check, CrossCheck):
            rows.append([name_of(path), "", check.diagnostics[0].message, "", "", "no"])
            continue
        options = check.run.translation.options
        step = number(options.max_step, "s", 3) if options.max_step else "sweep"
        within = check.worst.share("max") <= SMOOTH_TOLERANCE
        rows.append(
            [
                name_of(path),
                step,
                needed(check.run),
                worst(check, "V"),
                worst(check, "A"),
                "yes" if within else "no",
            ]
        )
    head = ("netlist", "largest step", "ngspice needed", "voltages", "currents", "within 1e-4")
    return table(head, rows)


def sharpened(path: Path, n: float) -> Circuit:
    """Return a deck whose smooth junctions have another emission coefficient."""
    deck = read_deck(path)
    for element in deck.elements:
        for model in (element.model, *getattr(element, "models", {}).values()):
            if model is None or not _is_junction(model):
                continue
            keys = {"d": ("n",), "npn": ("nf", "nr"), "pnp": ("nf", "nr")}.get(model.type, ())
            for key in keys:
                model.params[key] = Param(key, n, model.span)
    return build(deck)


def sharp_table(paths: Sequence[Path]) -> list[str]:
    """Return the table of sharp junctions: who gets through."""
    rows = []
    for path in paths:
        for n in SHARP:
            row = [name_of(path), f"{n:g}", _own(path, n)]
            try:
                found = run(sharpened(path, n), once=True, timeout=30.0)
                points = f"{found.points} points, {found.rejected} rejected"
                row.append(points if found.points else f"done, {found.axis.size} values")
            except NsspiceError as error:
                reason = getattr(error, "reason", error.diagnostics[0].message)
                at = getattr(error, "time", None)
                row.append(reason + (f" at {number(at, 's', 3)}" if at is not None else ""))
            rows.append(row)
            print(" ".join(row), file=sys.stderr)
    return table(("netlist", "N", "nsspice", "ngspice, reltol 1e-6"), rows)


def _own(path: Path, n: float) -> str:
    circuit = sharpened(path, n)
    try:
        solution = circuit.run()[0]
    except NsspiceError as error:
        return error.diagnostics[0].message.split("\n")[0]
    steps = solution.stats.get("steps", solution.row_count)
    return f"done, {steps:g} steps"


def tables(only: str) -> str:
    """Return what stands below the marker of the page."""
    found: dict[Path, CrossCheck | NsspiceError] = {}
    smooth: dict[Path, CrossCheck | NsspiceError] = {}
    for path in netlists(only):
        check = checked(path)
        (smooth if is_smooth(nsspice.read(path)) else found)[path] = check
        shown = f"{check.worst}" if isinstance(check, CrossCheck) else str(check)
        print(f"{name_of(path)}: {shown}", file=sys.stderr)
    checks = [c for c in (*found.values(), *smooth.values()) if isinstance(c, CrossCheck)]
    version = checks[0].run.version if checks else "no ngspice"
    versions = f"nsspice {nsspice.__version__}, {version}, Python {platform.python_version()}"
    card = replace(Options(), ron=1.0, roff=1.0).card().removeprefix(".options ")
    junctions = [path for path in smooth if _has_junctions(path)]
    lines = [
        f"\n{versions}. ngspice runs with `{card}`",
        "and the largest step that `nsspice compare` chooses: the smallest of the deck's own, half",
        "the distance of its rows, and a 10 000th of the run. nsspice runs with its mode-wise",
        "engine, which is exact. Numbers are the largest difference of any voltage and of any",
        "current as a share of the signal's range.\n",
        "## Set-valued and linear laws\n",
        *overview(found),
        "\n## Smooth laws\n",
        f"Where something is stored ngspice runs with `method=trap` and at least {POINTS[0]} steps",
        f"({POINTS[1]} or {POINTS[2]} where it fails with more),",
        f"nsspice with `method=sdirk` and reltol = {RELTOL:g}; elsewhere nsspice goes point by",
        "point.",
        "The aim is 1e-4 of the range.\n",
        *smooth_table(smooth),
        "\n## Sharp junctions\n",
        "The same decks with the emission coefficients of all junctions set to N, ngspice without",
        "help: no resistor to ground, no second try.\n",
        *sharp_table(junctions),
        "",
    ]
    return "\n".join(lines)


def _is_junction(model: Model) -> bool:
    """Return whether a card is a smooth junction or SPICE's transistor."""
    if model.type == "d":
        return not any(key in model.params for key in SET_VALUED)
    return model.type in ("npn", "pnp") and "alphan" not in model.params


def _has_junctions(path: Path) -> bool:
    """Return whether a deck has smooth junctions whose sharpness can be changed."""
    models = [element.model for element in read_deck(path).elements]
    return any(model is not None and _is_junction(model) for model in models)


def main() -> None:
    """Write the page, or print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="only netlists whose path holds this word")
    parser.add_argument("--write", type=Path, help="file to write; standard output if left out")
    given = parser.parse_args()
    text = tables(given.only)
    if given.write is None:
        print(text)
        return
    kept, marker, _ = given.write.read_text(encoding="utf-8").partition(MARKER)
    given.write.write_text(kept + marker + text, encoding="utf-8")


if __name__ == "__main__":
    main()
