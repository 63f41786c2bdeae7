"""Seeded random passive networks of R, L, C, sources and set-valued diodes, as netlist text.

Eight classes, each hard in its own way:

======================  ==========================================================================
``regular``             mixed elements, every node tied down by resistors
``floating``            groups of nodes that hang on diodes alone
``degenerate``          diodes parallel, in series, antiparallel, in directed loops, across sources
``impulsive``           loops of C and V, cut-sets of L and I, without a resistor in them
``stiff``               R 1e-6..1e6 Ohm, C 1e-12..1 F, L 1e-9..10 H in one network
``bridge``              m-phase rectifier bridges
``multiplier``          Cockcroft-Walton ladders
``large``               25-60 nodes with up to 80 diodes
======================  ==========================================================================
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np

CLASSES = (
    "regular", "floating", "degenerate", "impulsive", "stiff", "bridge", "multiplier", "large",
)  # fmt: skip

#: diode models of the generated decks: card text by name
MODELS = {
    "did": ".model did D(ideal)",
    "dvf": ".model dvf D(Vfwd=0.7)",
    "dron": ".model dron D(Ron=0.05 Vfwd=0.3)",
    "dzen": ".model dzen D(Vfwd=0.6 Vrev=5.1)",
}
STEPS = 6


@dataclass
class Draft:
    """A netlist under construction."""

    rng: np.random.Generator
    lines: list[str] = field(default_factory=list)
    degree: dict[str, int] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    models: set[str] = field(default_factory=set)
    sourced: dict[str, str] = field(default_factory=dict)

    def add(self, letter: str, a: str, b: str, rest: str) -> None:
        """Append one element line with the next free number of its letter."""
        number = self.counts.get(letter, 0) + 1
        self.counts[letter] = number
        self.lines.append(f"{letter}{number} {a} {b} {rest}")
        for node in (a, b):
            self.degree[node] = self.degree.get(node, 0) + 1

    def value(self, low: float, high: float) -> str:
        """Return a log-uniform value with four digits."""
        return f"{math.exp(self.rng.uniform(math.log(low), math.log(high))):.4g}"

    def pair(self, nodes: list[str]) -> tuple[str, str]:
        """Return two different nodes."""
        i, j = self.rng.choice(len(nodes), size=2, replace=False)
        return nodes[int(i)], nodes[int(j)]

    def diode(self, a: str, b: str, model: str | None = None) -> None:
        """Append a diode; four of five are ideal."""
        if model is None:
            model = "did" if self.rng.random() < 0.8 else str(self.rng.choice(list(MODELS)))
        self.models.add(model)
        self.add("D", a, b, model)

    def loose_diode(self, nodes: list[str]) -> None:
        """Append a diode, as a rule not across a chain of sources, where it may be in conflict."""
        a, b = self.pair(nodes)
        if self._root(a) == self._root(b) and self.rng.random() < 0.9:
            a, b = self.pair(nodes)
        self.diode(a, b)

    def resistor(self, a: str, b: str, low: float = 1.0, high: float = 1e4) -> None:
        """Append a resistor [Ohm]."""
        self.add("R", a, b, self.value(low, high))

    def capacitor(self, a: str, b: str, low: float = 1e-9, high: float = 1e-4) -> None:
        """Append a capacitor [F] with a random initial voltage, often zero."""
        ic = 0.0 if self.rng.random() < 0.4 else round(float(self.rng.normal(0, 5)), 3)
        self.add("C", a, b, f"{self.value(low, high)} IC={ic:g}")

    def inductor(self, a: str, b: str, low: float = 1e-6, high: float = 1e-1) -> None:
        """Append an inductor [H] with a random initial current, often zero."""
        ic = 0.0 if self.rng.random() < 0.4 else round(float(self.rng.normal(0, 1)), 3)
        self.add("L", a, b, f"{self.value(low, high)} IC={ic:g}")

    def drive(self, amplitude: float, phase: float | None = None) -> str:
        """Return a DC or SIN source specification."""
        if phase is None and self.rng.random() < 0.5:
            return f"DC {amplitude * self.rng.choice([-1.0, 1.0]):.4g}"
        phase = float(self.rng.uniform(0, 360)) if phase is None else phase
        return f"SIN(0 {amplitude:.4g} {self.value(50, 1e5)} 0 0 {phase:.4g})"

    def voltage(self, a: str, b: str) -> bool:
        """Append a voltage source unless it would close a loop of voltage sources."""
        ra, rb = self._root(a), self._root(b)
        if ra == rb:
            return False
        self.sourced[ra] = rb
        self.add("V", a, b, self.drive(float(self.rng.uniform(1, 20))))
        return True

    def _root(self, node: str) -> str:
        while node in self.sourced:
            node = self.sourced[node]
        return node

    def finish(self, title: str, step: float) -> str:
        """Return the deck; nodes with a single connection get a second one."""
        for node, degree in list(self.degree.items()):
            if degree == 1 and node != "0":
                self.diode(*((node, "0") if self.rng.random() < 0.5 else ("0", node)))
        cards = [MODELS[m] for m in sorted(self.models)]
        tran = f".tran {step:.6g} {STEPS * step:.6g} uic"
        return "\n".join([title, *self.lines, *cards, tran, ".end", ""])


@dataclass(frozen=True)
class RandomCircuit:
    """A generated deck: its class, seed, time step [s] and text."""

    kind: str
    seed: int
    step: float
    text: str


def generate(kind: str, seed: int) -> RandomCircuit:
    """Return the deck of this class and seed; the same arguments give the same text.

    Examples
    --------
    >>> generate("bridge", 1) == generate("bridge", 1)
    True
    """
    rng = np.random.default_rng([CLASSES.index(kind), seed])
    draft = Draft(rng)
    step = 10.0 ** float(rng.uniform(-8, -4))
    _BUILDERS[kind](draft)
    return RandomCircuit(kind, seed, step, draft.finish(f"* random {kind} {seed}", step))


def _names(count: int, prefix: str = "n") -> list[str]:
    return [f"{prefix}{k}" for k in range(1, count + 1)]


def mix(d: Draft, nodes: list[str], elements: int, diodes: float) -> None:
    """Join the nodes (ground included) by a random mix of two-terminal elements."""
    for _ in range(elements):
        a, b = d.pair(nodes)
        roll = d.rng.random()
        if roll < diodes:
            d.loose_diode(nodes)
        elif roll < diodes + 0.4 * (1 - diodes):
            d.resistor(a, b)
        elif roll < diodes + 0.7 * (1 - diodes):
            d.capacitor(a, b)
        else:
            d.inductor(a, b)


def _regular(d: Draft) -> None:
    nodes = _names(int(d.rng.integers(3, 9)))
    for node in nodes:
        d.resistor(node, "0", 10, 1e5)
    d.voltage(nodes[0], "0")
    mix(d, ["0", *nodes], len(nodes) + int(d.rng.integers(2, 8)), 0.4)
    if d.rng.random() < 0.5:
        d.add("I", *d.pair(["0", *nodes]), d.drive(float(d.rng.uniform(0.01, 1))))


def _floating(d: Draft) -> None:
    nodes = _names(int(d.rng.integers(2, 5)))
    for node in nodes:
        d.resistor(node, "0", 10, 1e5)
    d.voltage(nodes[0], "0")
    mix(d, ["0", *nodes], len(nodes), 0.2)
    for k in range(int(d.rng.integers(1, 4))):
        island = _names(int(d.rng.integers(1, 5)), f"f{k}x")
        for a, b in itertools.pairwise(island):
            roll = d.rng.random()
            if roll < 0.4:
                d.diode(a, b)
            elif roll < 0.7:
                d.resistor(a, b)
            else:
                d.capacitor(a, b)
        for _ in range(int(d.rng.integers(2, 4))):
            inner, outer = str(d.rng.choice(island)), str(d.rng.choice(["0", *nodes]))
            d.diode(*((inner, outer) if d.rng.random() < 0.5 else (outer, inner)))
        if len(island) > 1 and d.rng.random() < 0.3:
            a, b = d.pair(island)
            d.add("I", a, b, d.drive(float(d.rng.uniform(0.01, 1))))


def _degenerate(d: Draft) -> None:
    nodes = _names(int(d.rng.integers(2, 5)))
    d.voltage(nodes[0], "0")
    d.resistor(nodes[-1], "0")
    mix(d, ["0", *nodes], len(nodes), 0.3)
    for k in range(int(d.rng.integers(1, 4))):
        a, b = d.pair(["0", *nodes])
        shape = int(d.rng.integers(5))
        if shape == 0:  # parallel
            for _ in range(int(d.rng.integers(2, 4))):
                d.diode(a, b, "did")
        elif shape == 1:  # series
            chain = [a, *_names(int(d.rng.integers(1, 4)), f"s{k}x"), b]
            for p, q in itertools.pairwise(chain):
                d.diode(p, q, "did")
        elif shape == 2:  # antiparallel: a short circuit
            d.diode(a, b, "did")
            d.diode(b, a, "did")
        elif shape == 3:  # directed loop
            ring = [a, b, *_names(int(d.rng.integers(1, 3)), f"r{k}x")]
            for p, q in zip(ring, [*ring[1:], ring[0]], strict=True):
                d.diode(p, q, "did")
        else:  # a source straight across a diode or a chain of them
            chain = [nodes[0], *_names(int(d.rng.integers(0, 3)), f"v{k}x"), "0"]
            if d.rng.random() < 0.5:
                chain.reverse()
            for p, q in itertools.pairwise(chain):
                d.diode(p, q)
    if d.rng.random() < 0.25:  # a current source fed into a node that only diodes leave
        d.add("I", "0", "q", f"DC {d.rng.normal():.4g}")
        for _ in range(int(d.rng.integers(1, 3))):
            d.diode("q", str(d.rng.choice(nodes)))


def _impulsive(d: Draft) -> None:
    nodes = _names(int(d.rng.integers(3, 7)))
    ring = ["0", *nodes]
    for a, b in zip(ring, [*ring[1:], "0"], strict=True):  # a loop of C, with V in it at times
        if d.rng.random() < 0.25 and d.voltage(a, b):
            continue
        d.capacitor(a, b)
    for k in range(int(d.rng.integers(1, 4))):  # star points: cut-sets of L, at times with an I
        star = f"x{k}"
        legs = int(d.rng.integers(2, 4))
        for _ in range(legs):
            d.inductor(star, str(d.rng.choice(ring)))
        if d.rng.random() < 0.3:
            d.add("I", star, "0", d.drive(float(d.rng.uniform(0.01, 1))))
    for _ in range(int(d.rng.integers(1, 5))):
        d.diode(*d.pair([*ring, *(f"x{0}",)]))
    if d.rng.random() < 0.4:
        d.resistor(*d.pair(ring))


def _stiff(d: Draft) -> None:
    nodes = _names(int(d.rng.integers(3, 8)))
    d.voltage(nodes[0], "0")
    for node in nodes[1:]:
        d.resistor(node, str(d.rng.choice(["0", nodes[0]])), 1e-6, 1e6)
    for _ in range(len(nodes) + int(d.rng.integers(3, 9))):
        a, b = d.pair(["0", *nodes])
        roll = d.rng.random()
        if roll < 0.4:
            d.loose_diode(["0", *nodes])
        elif roll < 0.6:
            d.resistor(a, b, 1e-6, 1e6)
        elif roll < 0.8:
            d.capacitor(a, b, 1e-12, 1.0)
        else:
            d.inductor(a, b, 1e-9, 10.0)


def _bridge(d: Draft) -> None:
    phases = int(d.rng.integers(1, 8))
    amplitude = float(d.rng.uniform(1, 400))
    frequency = d.value(40, 1e4)
    legs = _names(max(phases, 2), "p")
    for k, leg in enumerate(legs):
        node = leg if d.rng.random() < 0.5 else f"{leg}s"
        phase = 360.0 * k / len(legs) + 7.0
        d.add("V", node, "g", f"SIN(0 {amplitude:.5g} {frequency} 0 0 {phase:.5g})")
        if node != leg:
            d.inductor(node, leg, 1e-6, 1e-2)
        d.diode(leg, "plus", "did")
        d.diode("minus", leg, "did")
    if d.rng.random() < 0.5:
        d.resistor("g", "0", 1e-2, 1e5)
    else:
        d.add("V", "g", "0", "DC 0")
    if d.rng.random() < 0.5:
        d.add("V", "minus", "0", "DC 0") if d.rng.random() < 0.3 else d.resistor("minus", "0")
    load = int(d.rng.integers(3))
    if load == 0:
        d.resistor("plus", "minus")
    elif load == 1:
        d.inductor("plus", "mid", 1e-4, 1e-1)
        d.resistor("mid", "minus")
        if d.rng.random() < 0.5:
            d.diode("minus", "plus")
    else:
        d.capacitor("plus", "minus", 1e-7, 1e-3)
        d.resistor("plus", "minus")


def _multiplier(d: Draft) -> None:
    stages = int(d.rng.integers(1, 9))
    d.add("V", "in", "0", f"SIN(0 {d.rng.uniform(5, 500):.5g} {d.value(50, 1e5)} 0 0 0)")
    pushed, smooth = "in", "0"
    if d.rng.random() < 0.4:
        d.resistor("in", "a0", 0.1, 100)
        pushed = "a0"
    for k in range(1, stages + 1):
        left, right = f"a{k}", f"b{k}"
        d.capacitor(pushed, left, 1e-9, 1e-5)
        d.diode(smooth, left, "did")
        d.diode(left, right, "did")
        d.capacitor(smooth, right, 1e-9, 1e-5)
        pushed, smooth = left, right
    if d.rng.random() < 0.7:
        d.resistor(smooth, "0", 1e3, 1e7)


def _large(d: Draft) -> None:
    nodes = _names(int(d.rng.integers(25, 61)))
    for a, b in zip(["0", *nodes[:-1]], nodes, strict=True):
        roll = d.rng.random()
        if roll < 0.5:
            d.resistor(a, b)
        elif roll < 0.75:
            d.capacitor(a, b)
        else:
            d.diode(a, b)
    for _ in range(int(d.rng.integers(1, 4))):
        d.voltage(str(d.rng.choice(nodes)), "0")
    mix(d, ["0", *nodes], len(nodes), 0.25)
    for _ in range(int(d.rng.integers(10, 45))):
        d.loose_diode(["0", *nodes])


_BUILDERS = {
    "regular": _regular,
    "floating": _floating,
    "degenerate": _degenerate,
    "impulsive": _impulsive,
    "stiff": _stiff,
    "bridge": _bridge,
    "multiplier": _multiplier,
    "large": _large,
}
