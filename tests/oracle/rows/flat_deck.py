"""Reads flat decks: element lines, model cards, ``.tran`` and ``.ic``; no subcircuits.

A reader of its own, so that a line that the package misreads is not judged as misread.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from decimal import Decimal

#: powers of ten
SUFFIXES = {"t": 12, "g": 9, "meg": 6, "k": 3, "m": -3, "u": -6, "n": -9, "p": -12, "f": -15}
_NUMBER = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)(meg|[tgkmunpf])?[a-z]*$")
_SETTING = re.compile(r"(\w+)\s*=\s*(\{[^}]*\}|[^\s,()]+)")
#: terminals of each letter, and how many nodes it reads beside them
_TERMINALS = {**dict.fromkeys("rclvidbfh", 2), "e": 2, "g": 2, "s": 2, "w": 2, "q": 3}


class Unreadable(ValueError):
    """The deck has something that this judge does not know."""


def number(text: str) -> float:
    """Return a SPICE number.

    Examples
    --------
    >>> number("2.5meg"), number("10u"), number("1e-3")
    (2500000.0, 1e-05, 0.001)
    """
    found = _NUMBER.match(text.lower())
    if not found:
        raise Unreadable(f"{text!r} is no number")
    return float(Decimal(found[1]).scaleb(SUFFIXES.get(found[2], 0)))


@dataclass
class Element:
    """One element line: terminals, what follows them as text, its settings and its model."""

    name: str
    nodes: list[str]
    rest: str
    settings: dict[str, str] = field(default_factory=dict)
    model: Model | None = None

    @property
    def letter(self) -> str:
        return self.name[0]

    @property
    def words(self) -> list[str]:
        """What follows the terminals, without settings."""
        return _SETTING.sub(" ", self.rest).split()

    def setting(self, key: str, default: float) -> float:
        return number(self.settings[key]) if key in self.settings else default


@dataclass
class Model:
    """A model card: its type and parameters; ``flags`` are words without a value."""

    type: str
    card: dict[str, float]
    flags: set[str]


@dataclass
class FlatDeck:
    """Elements by name, and how the transient begins."""

    elements: list[Element]
    #: distance of rows and end of the run [s]
    step: float
    stop: float
    uic: bool
    #: voltages of ``.ic`` cards by node [V]
    initial: dict[str, float]

    def named(self, name: str) -> Element:
        return next(e for e in self.elements if e.name == name.lower())

    @property
    def nodes(self) -> list[str]:
        """All nodes but ground."""
        ends = (n for e in self.elements if e.letter != "k" for n in e.nodes)
        return [n for n in dict.fromkeys(ends) if n != "0"]

    def signals(self) -> list[str]:
        """Return the columns that a run should write to be judged: all voltages and currents."""
        flows = [f"i({e.name})" for e in self.elements if e.letter not in "kq"]
        return [f"v({n})" for n in self.nodes] + flows


def read(text: str) -> FlatDeck:
    """Return the deck of a text.

    Examples
    --------
    >>> deck = read("RC\\nV1 a 0 5\\nR1 a b 1k\\nC1 b 0 1u IC=2\\n.tran 1u 1m uic\\n")
    >>> [e.name for e in deck.elements], deck.nodes, deck.named("c1").setting("ic", 0.0)
    (['v1', 'r1', 'c1'], ['a', 'b'], 2.0)
    """
    elements: list[Element] = []
    models: dict[str, Model] = {}
    wanted: list[tuple[Element, str]] = []
    deck = FlatDeck(elements, 0.0, 0.0, False, {})
    for line in _lines(text):
        head, _, rest = line.partition(" ")
        if head == ".model":
            name, model = _model(rest)
            models[name] = model
        elif head == ".tran":
            words = rest.split()
            deck.uic = "uic" in words
            deck.step, deck.stop = (number(w) for w in words[:2])
        elif head == ".ic":
            for node, value in re.findall(r"v\(\s*([^\s)]+)\s*\)\s*=\s*(\S+)", rest):
                deck.initial[node] = number(value)
        elif head in (".subckt", ".include", ".lib", ".param", ".if", ".step"):
            raise Unreadable(f"{head} in a flat deck")
        elif head == ".end":
            break
        elif not head.startswith("."):
            element, model_name = _element(head, rest)
            elements.append(element)
            if model_name:
                wanted.append((element, model_name))
    for element, name in wanted:
        if name not in models:
            raise Unreadable(f"{element.name}: no model {name}")
        element.model = models[name]
    return deck


def _lines(text: str) -> list[str]:
    """Return the lines behind the title, in lower case, without comments, continued ones joined."""
    out: list[str] = []
    for line in text.splitlines()[1:]:
        line = re.split(r";|\$ ", line)[0].strip().lower()
        if line.startswith("+") and out:
            out[-1] += " " + line[1:]
        elif line and not line.startswith("*"):
            out.append(re.sub(r"\s+", " ", line))
    return out


def _model(rest: str) -> tuple[str, Model]:
    words = re.sub(r"[(),]", " ", re.sub(r"\s*=\s*", "=", rest)).split()
    card = {k: number(v) for k, v in (w.split("=") for w in words[2:] if "=" in w)}
    return words[0], Model(words[1], card, {w for w in words[2:] if "=" not in w})


def _element(name: str, rest: str) -> tuple[Element, str]:
    """Return an element and the name of its model, empty if it has none."""
    words, letter = rest.split(), name[0]
    if letter == "k":
        return Element(name, words[:2], " ".join(words[2:])), ""
    if letter not in _TERMINALS:
        raise Unreadable(f"element {name}")
    count = _TERMINALS[letter]
    nodes, tail = words[:count], words[count:]
    model = ""
    if letter in "sw":
        model = tail[2] if letter == "s" else tail[1]
    elif letter == "d":
        plain = [w for w in tail if "=" not in w]
        # a third node is the gate of a thyristor
        model = plain[-1] if plain else ""
        nodes += plain[:-1]
    elif letter == "q":
        model = next(w for w in tail if "=" not in w)
    text = " ".join(tail)
    settings = dict(_SETTING.findall(re.sub(r"\s*=\s*", "=", text)))
    return Element(name, nodes, text, settings), model
