"""A deck with all files that it includes, copied into a folder."""

from __future__ import annotations

import os
from pathlib import Path

from ..netlist.deck import Deck

#: the program's own decks and libraries belong to its version
PACKAGE = Path(__file__).parents[1]


def store_deck(folder: Path, deck: Deck) -> list[str]:
    """Copy a deck and what it includes into a folder, which is made if it is not there.

    Files keep their places next to each other, so that relative paths of ``.include`` hold.

    Parameters
    ----------
    folder : Path
    deck : Deck

    Returns
    -------
    list of str
        Names of the copies in the folder, the deck's first.

    Raises
    ------
    OSError

    Examples
    --------
    >>> import tempfile
    >>> import nsspice
    >>> deck = nsspice.read("text\\nV1 a 0 1\\nR1 a 0 1\\n").deck
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     store_deck(Path(folder), deck)
    ['netlist.net']
    """
    if deck.source:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "netlist.net").write_text(deck.source, "utf-8")
        return ["netlist.net"]
    main = Path(deck.file).resolve()
    included = [p.resolve() for p in deck.included]
    files = [main, *(p for p in included if not p.is_relative_to(PACKAGE))]
    root = Path(os.path.commonpath([p.parent for p in files]))
    names = []
    for path in dict.fromkeys(files):
        target = folder / path.relative_to(root)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(path.read_bytes())
        names.append(target.relative_to(folder).as_posix())
    return names
