"""What nsspice does with decks that others have written: a table of what runs and what is refused.

usage: python tools/public_decks.py FOLDER|LIST [--seconds 20] [--read] [--ngspice] [--json FILE]

A list has one path of a deck in each line, relative to its folder; lines with # are comments.  The
decks stay where they are: public collections are not part of this repository.
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


def main() -> None:
    """Run what the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("source", type=Path, help="folder of decks, or list of paths")
    parser.add_argument("--seconds", type=int, default=20, help="time for one deck")
    parser.add_argument("--read", action="store_true", help="only read the decks")
    parser.add_argument("--ngspice", action="store_true", help="compare each kind of analysis")
    parser.add_argument("--json", type=Path, help="write what was found for each deck")
    given = parser.parse_args()
    found = {}
    what = "read" if given.read else "judge" if given.ngspice else "run"
    for path in decks(given.source):
        name = os.path.relpath(path, given.source if given.source.is_dir() else ".")
        found[name] = entry = in_a_child(path, given.seconds, what)
        print(
            f"{entry['verdict']:<9}{name}  {entry.get('message', entry.get('ngspice', ''))}"[:200],
            flush=True,
        )
    if given.json:
        given.json.write_text(json.dumps(found, indent=1))
    print()
    print(table(found))


def decks(source: Path) -> list[Path]:
    """Return the decks of a folder, or of a list."""
    if source.is_dir():
        return sorted(p for p in source.rglob("*") if p.suffix.lower() in ENDINGS)
    lines = (line.partition("#")[0].strip() for line in source.read_text().splitlines())
    return [source.parent / line for line in lines if line]


def in_a_child(path: Path, seconds: int, what: str) -> dict[str, Any]:
    """Return what happens to a deck, in a process of its own that may take some time."""
    with tempfile.NamedTemporaryFile() as store:
        child = os.fork()
        if child == 0:
            signal.alarm(seconds)
            with open(os.devnull, "w") as nothing, contextlib.redirect_stdout(nothing):
                entry = outcome(path, what)
            Path(store.name).write_text(json.dumps(entry))
            os._exit(0)
        _, status = os.waitpid(child, 0)
        if status == 0:
            return dict(json.loads(Path(store.name).read_text()))
        late = os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGALRM
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


if __name__ == "__main__":
    sys.exit(main())
