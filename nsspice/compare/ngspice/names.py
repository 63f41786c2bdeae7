"""Names of nodes and elements in a form that ngspice can read."""

from __future__ import annotations

import re

# a word that is not a number with a suffix and holds nothing that ngspice takes for an operator
_NODE = re.compile(r"[a-z_][a-z0-9_]*|[1-9][0-9]*")
_PLAIN = re.compile(r"[a-z][a-z0-9_]*")
#: words with a meaning of their own in ngspice's expressions
_RESERVED = frozenset(("time", "temper", "hertz", "temp", "gnd", "all", "null", "params"))


class Names:
    """Spells the nodes, elements and models of a flat deck for ngspice.

    The path of a subcircuit (``x1.r1``) and signs that ngspice takes for operators are replaced, so
    that no two names become one.

    Examples
    --------
    >>> names = Names()
    >>> names.node("out"), names.node("x1.m"), names.node("x1_m"), names.element("r", "x1.r7")
    ('out', 'x1_m', 'x1_m_2', 'r_x1_r7')
    """

    def __init__(self) -> None:
        self._nodes: dict[str, str] = {"0": "0"}
        self._elements: dict[str, str] = {}
        self._models: dict[int, str] = {}
        self._used_nodes: set[str] = {"0"}
        self._used: set[str] = set()

    def node(self, name: str) -> str:
        """Return the spelling of a node."""
        if name not in self._nodes:
            good = _NODE.fullmatch(name) and name not in _RESERVED
            plain = name if good else _clean(name)
            if not good and (plain in _RESERVED or not plain[0].isalpha()):
                plain = f"n_{plain}"
            self._nodes[name] = _unique(plain, self._used_nodes)
        return self._nodes[name]

    def inner(self, name: str) -> str:
        """Return a new node that the deck does not have."""
        return _unique(_clean(name), self._used_nodes)

    def element(self, letter: str, name: str) -> str:
        """Return the spelling of an element that begins with the given letter."""
        key = f"{letter} {name}"
        if key not in self._elements:
            good = name[0] == letter and _PLAIN.fullmatch(name)
            self._elements[key] = _unique(name if good else f"{letter}_{_clean(name)}", self._used)
        return self._elements[key]

    def model(self, key: int, name: str) -> tuple[str, bool]:
        """Return the spelling of a model by its identity, and whether it is asked for first."""
        new = key not in self._models
        if new:
            self._models[key] = _unique("m_" + _clean(name), self._used)
        return self._models[key], new


def _clean(name: str) -> str:
    return re.sub(r"[^a-z0-9_]", "_", name)


def _unique(name: str, used: set[str]) -> str:
    found, k = name, 1
    while found in used:
        k += 1
        found = f"{name}_{k}"
    used.add(found)
    return found
