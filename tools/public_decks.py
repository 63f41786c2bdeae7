"""What nsspice does with decks that others have written: a table of what runs and what is refused.

usage: python tools/public_decks.py FOLDER|LIST [--root FOLDER] [--seconds 20] [--read]
                                    [--ngspice] [--json FILE] [--page FILE]

A list has one path of a deck in each line, relative to the root (by default the folder of the
list), and after a # what is to be said of it; other lines with # are comments.  The decks stay
where they are: public collections are not part of this repository.  `public_decks.txt` lists those
of ngspice: `git clone https://git.code.sf.net/p/ngspice/ngspice`, and give its folder as the root.
With --ngspice one analysis of each kind is compared with ngspice at cut steps.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import re
import signal
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from ngspice_judge import judged

import nsspice
from nsspice.analyses.studies.batch import jobs_of
from nsspice.errors import NsspiceError

ENDINGS = (".cir", ".net", ".sp", ".spi", ".ckt", ".deck")
#: what distinguishes two messages of one kind: names, numbers, texts
_NAMES = re.compile(r"'[^']*'|\b[\w#]*\d[\w.#]*\b|(?<=: ).*(?= is not)")

#: an analysis in a program: such a deck is whole, even if it is not understood
_COMMAND = re.compile(r"(?im)^\s*(tran|ac|dc|op|sens|noise|pz|tf|run)\b")


def main() -> None:
    """Run what the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("source", type=Path, help="folder of decks, or list of paths")
    parser.add_argument("--seconds", type=int, default=20, help="CPU time for one deck")
    parser.add_argument("--read", action="store_true", help="only read the decks")
    parser.add_argument("--ngspice", action="store_true", help="compare each kind of analysis")
    parser.add_argument("--json", type=Path, help="write what was found for each deck")
    parser.add_argument("--root", type=Path, help="what the paths of a list are relative to")
    parser.add_argument("--page", type=Path, help="write a page with tables")
    given = parser.parse_args()
    found, remarks = {}, {}
    what = "read" if given.read else "judge" if given.ngspice else "run"
    root = given.root or (given.source if given.source.is_dir() else given.source.parent)
    for path, remark in decks(given.source, root):
        name = os.path.relpath(path, root)
        found[name] = entry = in_a_child(path, given.seconds, what)
        remarks[name] = remark
        shown = entry.get("message", entry.get("ngspice", ""))
        print(f"{entry['verdict']:<9}{name}  {shown}"[:200], flush=True)
    if given.json:
        given.json.write_text(json.dumps(found, indent=1))
    if given.page:
        given.page.write_text(page(found, remarks), "utf-8")
    print()
    print(table(found))


def decks(source: Path, root: Path) -> list[tuple[Path, str]]:
    """Return the decks of a folder, or of a list, and what is said of them there."""
    if source.is_dir():
        found = sorted(p for p in source.rglob("*") if p.suffix.lower() in ENDINGS)
        return [(path, "") for path in found]
    parts = (line.partition("#") for line in source.read_text("utf-8").splitlines())
    return [(root / path.strip(), remark.strip()) for path, _, remark in parts if path.strip()]


def in_a_child(path: Path, seconds: int, what: str) -> dict[str, Any]:
    """Return what happens to a deck, in a process of its own that may take some time."""
    with tempfile.NamedTemporaryFile() as store:
        child = os.fork()
        if child == 0:
            signal.setitimer(signal.ITIMER_PROF, seconds)
            with open(os.devnull, "w") as nothing, contextlib.redirect_stdout(nothing):
                entry = outcome(path, what)
            Path(store.name).write_text(json.dumps(entry))
            os._exit(0)
        _, status = os.waitpid(child, 0)
        if status == 0:
            return dict(json.loads(Path(store.name).read_text()))
        late = os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGPROF
        return {"verdict": "late" if late else "crashed", "message": f"status {status}"}


def outcome(path: Path, what: str) -> dict[str, Any]:
    """Return verdict and findings of one deck."""
    entry: dict[str, Any] = {"verdict": "refused"}
    try:
        circuit = nsspice.read(path)
        entry["warnings"] = [f"{w.code} {w.message}" for w in circuit.warnings]
        jobs_of(circuit.deck)
        entry["verdict"] = "failed"
        if what == "run":
            circuit.run()
        elif what == "judge":
            entry["ngspice"] = judged(path, circuit)
        entry["verdict"] = "read" if what == "read" else "runs"
    except NsspiceError as error:
        entry["errors"] = [f"{d.code} {d.message}" for d in error.diagnostics]
        entry["message"] = entry["errors"][0]
        entry["commands"] = bool(_COMMAND.search(path.read_text("utf-8", "replace")))
    except Exception as error:  # a fault of the program itself is a row of the table, too
        entry |= {"verdict": "crashed", "message": repr(error)}
    return entry


def table(found: dict[str, Any]) -> str:
    """Return how many decks have which verdict, and what stops them: all, and alone."""
    verdicts = Counter(entry["verdict"] for entry in found.values())
    lines = [", ".join(f"{count} {verdict}" for verdict, count in verdicts.most_common())]
    touched: Counter[str] = Counter()
    alone: Counter[str] = Counter()
    for entry in found.values():
        kinds = {_NAMES.sub("_", text)[:90] for text in entry.get("errors", [])}
        touched.update(kinds)
        if len(kinds) == 1:
            alone.update(kinds)
    lines += ["", "| decks | alone | what stops them |", "|---|---|---|"]
    lines += [f"| {count} | {alone[kind]} | {kind} |" for kind, count in touched.most_common()]
    return "\n".join(lines)


#: what no reader could run, by what the errors say
_APART = (
    ("parts of decks, without elements or an analysis", ("no elements", "asks for no analysis")),
    ("files or models that are missing", ("does not exist", "there is no model")),
    ("compact models (BSIM, MOS6)", ("mos, level",)),
)


def page(found: dict[str, Any], remarks: dict[str, str]) -> str:
    """Return the page of the documentation."""
    apart = {label: 0 for label, _ in _APART}
    own: Counter[str] = Counter()
    for entry in found.values():
        text = " ".join([*entry.get("errors", []), entry.get("message", "")])
        label = next((k for k, signs in _APART if any(sign in text for sign in signs)), None)
        if "asks for no analysis" in text and entry.get("commands"):
            label = None
        if entry["verdict"] == "runs":
            own["runs"] += 1
        elif label is not None:
            apart[label] += 1
        else:
            own[_cause(entry)] += 1
    ran, rest = own.pop("runs", 0), len(found) - sum(apart.values())
    lines = [
        "# Public decks",
        "",
        f"ngspice's own `examples` and `tests` (`tools/public_decks.txt`): {len(found)} decks, of",
        f"which {rest} are whole and without compact models. **{ran} run: {ran / rest:.0%}** of",
        f"these, {ran / len(found):.0%} of all.",
        "",
        "| counted apart | decks |",
        "|---|---|",
        *(f"| {label} | {count} |" for label, count in apart.items()),
        "",
        "| what stops the others, each in one run of error messages | decks |",
        "|---|---|",
        *(f"| {cause} | {count} |" for cause, count in own.most_common()),
        "",
        *_judgement(found, remarks),
    ]
    return "\n".join(lines) + "\n"


def _cause(entry: dict[str, Any]) -> str:
    """Return what stops a deck, in words that others share."""
    text = " ".join([*entry.get("errors", []), entry.get("message", "")])
    if entry["verdict"] in ("late", "crashed"):
        return {"late": "more than the given time", "crashed": "a fault of nsspice"}[
            entry["verdict"]
        ]
    for cause, pattern in _CAUSES:
        if re.search(pattern, text):
            return cause
    return "no solution found" if "NS3002" in text else "others"


_CAUSES = (
    ("lossy and coupled transmission lines", "transmission line|RC line"),
    ("code models: tables of two and three variables", "table2d|table3d"),
    ("code models of XSPICE, others", "code model"),
    ("noise in time that is not white", "trnoise"),
    ("self-heating, quasi-saturation", r"IRFP?\d+ is not expected|quasi-saturation|thermal"),
    ("logic expressions and states in files", "not expected here in the expression"),
    ("ngspice's form of `.pss`", r"\.pss takes"),
    ("programs in `.control` that are not understood", "asks for no analysis|endc"),
)


def _judgement(found: dict[str, Any], remarks: dict[str, str]) -> list[str]:
    """Return the comparison: how many agree, and those that do not."""
    agreed, lines = 0, []
    for name, entry in found.items():
        for kind, result in entry.get("ngspice", {}).items():
            if isinstance(result, str):
                continue
            if result[0] <= _AGREE:
                agreed += 1
                continue
            remark = remarks[name] or "not looked into"
            lines.append(f"| `{name}`, .{kind} | {result[0]:.1g} of {result[1]} | {remark} |")
    if not agreed:
        return []
    return [
        "The text of each deck was also run by ngspice 39, at steps of a 20,000th of the run:",
        f"{agreed} analyses agree within {_AGREE:.1%} of the range of every signal that both have,",
        f"{len(lines)} do not:",
        "",
        "| deck | difference | who is right |",
        "|---|---|---|",
        *lines,
    ]


#: difference that is none, as a part of the range of a signal
_AGREE = 0.005


if __name__ == "__main__":
    sys.exit(main())
