"""What code models read from files, as numbers in a row."""

from __future__ import annotations

import re

#: a state of a digital vector: 0, 1 or unknown, and its strength
_STATE = re.compile(r"([01u])[surzu]", re.IGNORECASE)


def numbers_of(kind: str, rows: list[str]) -> list[str]:
    """Return the numbers of a file, without its comments.

    Parameters
    ----------
    kind : str
        Type of the code model that reads it.
    rows : list of str

    Examples
    --------
    >>> numbers_of("d_source", ["* time a b", "1n 0s Us"])
    ['1n', '0', '0']
    >>> numbers_of("d_state", ["0 1s 0s 0 -> 3", "        1 -> 1"])  # both of state 0
    ['0', '1', '0', '0', '3', '0', '1', '0', '1', '1']
    """
    found = [row.split() for row in rows if row.strip()[:1] not in ("*", "#", ";", "")]
    if kind == "d_state":
        return _transitions(found)
    return [_value(word) if kind == "d_source" else word for words in found for word in words]


def _value(word: str) -> str:
    """Return 0 or 1 for a digital state; unknown is 0."""
    state = _STATE.fullmatch(word)
    return word if state is None else f"{int(state[1] == '1')}"


def _transitions(rows: list[list[str]]) -> list[str]:
    """Return rows of a state, its outputs, the inputs and the next state; ``x`` of an input is -1.

    A row without state and outputs belongs to the one before.
    """
    values: list[str] = []
    header: list[str] = []
    for words in rows:
        own = [k for k, word in enumerate(words) if _STATE.fullmatch(word)]
        count = own[-1] + 1 if own else 0
        if count:
            header = [words[0], *(_value(word) for word in words[1:count])]
        rest = [word for word in words[count:] if word != "->"]
        values += [*header, *("-1" if word in "xX" else word for word in rest)]
    return values
