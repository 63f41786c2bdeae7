"""What the worker of the playground calls: a deck's text in, its report and messages out."""

from __future__ import annotations

import json
from pathlib import Path

import nsspice
from nsspice.output.report import page_of

#: packages that few decks need: the worker loads them when they are missing
LATER = ("scipy",)


def run(text: str, name: str) -> str:
    """Run a deck next to the files of the gallery's deck with this name, as JSON.

    The report is ``page``, errors and warnings are ``messages``; if a package is missing, it is
    ``missing``, and the caller tries again with it.
    """
    home = Path(nsspice.__file__).parent / "netlists"
    deck = home / f"{name}.net"
    deck.parent.mkdir(parents=True, exist_ok=True)
    deck.write_text(text, "utf-8")
    try:
        circuit = nsspice.read(deck)
        page = page_of(circuit, circuit.run())
    except (nsspice.NsspiceError, ModuleNotFoundError) as error:
        missing = missing_package(error)
        if missing in LATER:
            return json.dumps({"missing": missing})
        if not isinstance(error, nsspice.NsspiceError):
            raise
        return json.dumps({"messages": "\n".join(d.render() for d in error.diagnostics)})
    return json.dumps({"page": page, "messages": "\n".join(w.render() for w in circuit.warnings)})


def missing_package(error: BaseException | None) -> str:
    """Return the package whose absence is behind an error, empty if there is none."""
    while error is not None and not isinstance(error, ModuleNotFoundError):
        error = error.__cause__ or error.__context__
    return "" if error is None else str(error.name).partition(".")[0]
