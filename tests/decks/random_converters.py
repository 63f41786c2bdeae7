"""Random converters: a source, one stage or two in a chain, parasitic elements, a load.

Values are drawn around those that a designer would take (ripple, corner frequencies, dead times),
so that decks switch as converters do; what is added to them (snubbers, leakage, capacitances of
switches, edges) spans many decades.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field

IDEAL_DIODES = ("D(ideal)", "D(Vfwd=0.7)", "D(Ron=10m Roff=1meg)", "D(Vfwd=0.5 Ron=20m)")
SMOOTH_DIODES = ("D(IS=1n RS=10m)", "D(IS=1e-12 N=1.3 RS=20m CJO=200p TT=5n)", "D(IS=1e-14)")
SWITCHES = (
    "SW(VT=2.5)",
    "SW(VT=2.5 Ron=5m Roff=1meg)",
    "SW(VT=2.5 VH=0.5 Ron=20m Roff=10meg)",
    "SW(VT=2.5 VH=1)",
)


@dataclass
class Draft:
    """A netlist under construction."""

    r: random.Random
    #: switching period [s]
    period: float
    #: scale of the load [Ohm]
    ohms: float
    #: length of edges of gates [s]
    edge: float
    uic: bool
    lines: list[str] = field(default_factory=list)
    count: int = 0

    def add(self, letter: str, nodes: str, value: str) -> str:
        """Append an element and return its name."""
        self.count += 1
        name = f"{letter}{self.count}"
        self.lines.append(f"{name} {nodes} {value}")
        return name

    def node(self) -> str:
        """Return a new node."""
        self.count += 1
        return f"n{self.count}"

    def near(self, value: float, factor: float = 3.0) -> str:
        """Return a value within a factor of the given one."""
        return f"{value * factor ** self.r.uniform(-1, 1):.4g}"

    def small(self, low: float, high: float) -> str:
        """Return a value between two decades."""
        return f"{10 ** self.r.uniform(low, high):.4g}"

    def gate(self, begin: float, width: float) -> str:
        """Return a node with pulses of 5 V; begin and width count in periods."""
        node, t = self.node(), self.period
        self.add(
            "V",
            f"{node} 0",
            f"PULSE(0 5 {begin * t:.6g} {self.edge:.6g} {self.edge:.6g} "
            f"{max(width * t - self.edge, 0.01 * t):.6g} {t:.6g})",
        )
        return node

    def switch(self, a: str, b: str, gate: str, body: bool = False) -> None:
        """Append a switch, maybe with a diode from b to a, a capacitance or a snubber beside it."""
        self.add("S", f"{a} {b} {gate} 0", "sw")
        if body:
            self.diode(b, a)
        if self.r.random() < 0.2:
            self.add("C", f"{a} {b}", self.small(-11, -8.5))
        if self.r.random() < 0.15:
            self.snubber(a, b)

    def diode(self, a: str, b: str) -> None:
        """Append a diode, maybe with a snubber beside it."""
        self.add("D", f"{a} {b}", "d")
        if self.r.random() < 0.1:
            self.snubber(a, b)

    def snubber(self, a: str, b: str) -> None:
        """Append a resistor and a capacitor in series."""
        middle = self.node()
        self.add("R", f"{a} {middle}", self.small(0, 2))
        self.add("C", f"{middle} {b}", self.small(-10, -8))

    def coil(self, a: str, b: str, henry: float) -> str:
        """Append an inductor, maybe with a resistance in series."""
        start = " IC=0" if self.uic and self.r.random() < 0.5 else ""
        if self.r.random() < 0.4:
            middle = self.node()
            self.add("R", f"{middle} {b}", self.small(-3, -1))
            b = middle
        return self.add("L", f"{a} {b}", self.near(henry) + start)

    def tank(self, a: str, b: str, farad: float) -> None:
        """Append a capacitor, maybe with a resistance in series."""
        start = f" IC={self.r.choice([0, 0, 5])}" if self.uic else ""
        if self.r.random() < 0.3:
            middle = self.node()
            self.add("R", f"{middle} {b}", self.small(-3, -1))
            b = middle
        self.add("C", f"{a} {b}", self.near(farad) + start)

    @property
    def ripple(self) -> float:
        """Inductance with a current ripple of the size of the load's current [H]."""
        return self.ohms * self.period

    @property
    def smoothing(self) -> float:
        """Capacitance that the load discharges in ten periods [F]."""
        return 10 * self.period / self.ohms

    def filter(self, node: str) -> None:
        """Append what smooths a voltage against ground."""
        self.tank(node, "0", self.smoothing)


def buck(d: Draft, a: str) -> str:
    x, out = d.node(), d.node()
    duty = d.r.uniform(0.2, 0.8)
    d.switch(a, x, d.gate(0, duty))
    if d.r.random() < 0.3:
        d.switch(x, "0", d.gate(duty + 0.02, 0.96 - duty), body=True)
    else:
        d.diode("0", x)
    d.coil(x, out, d.ripple)
    d.filter(out)
    return out


def boost(d: Draft, a: str) -> str:
    x, out = d.node(), d.node()
    d.coil(a, x, d.ripple)
    d.switch(x, "0", d.gate(0, d.r.uniform(0.2, 0.7)))
    d.diode(x, out)
    d.filter(out)
    return out


def inverting(d: Draft, a: str) -> str:
    x, out = d.node(), d.node()
    d.switch(a, x, d.gate(0, d.r.uniform(0.2, 0.7)))
    d.coil(x, "0", d.ripple)
    d.diode(out, x)
    d.filter(out)
    return out


def cuk(d: Draft, a: str) -> str:
    x, y, out = d.node(), d.node(), d.node()
    d.coil(a, x, 2 * d.ripple)
    d.switch(x, "0", d.gate(0, d.r.uniform(0.2, 0.7)))
    d.tank(x, y, d.smoothing)
    d.diode(y, "0")
    d.coil(y, out, 2 * d.ripple)
    d.filter(out)
    return out


def sepic(d: Draft, a: str) -> str:
    x, y, out = d.node(), d.node(), d.node()
    d.coil(a, x, 2 * d.ripple)
    d.switch(x, "0", d.gate(0, d.r.uniform(0.2, 0.7)))
    d.tank(x, y, d.smoothing)
    d.coil(y, "0", 2 * d.ripple)
    d.diode(y, out)
    d.filter(out)
    return out


def interleaved(d: Draft, a: str) -> str:
    out, phases = d.node(), d.r.choice([2, 3])
    duty = d.r.uniform(0.2, 0.7)
    for k in range(phases):
        x = d.node()
        d.switch(a, x, d.gate(k / phases, duty))
        d.diode("0", x)
        d.coil(x, out, d.ripple)
    d.filter(out)
    return out


def coupled(d: Draft, ends: list[tuple[str, str, float]], k: float) -> None:
    """Append coupled windings."""
    names = []
    for a, b, henry in ends:
        names.append(d.add("L", f"{a} {b}", f"{henry:.4g}"))
    for i, one in enumerate(names):
        for other in names[i + 1 :]:
            d.add("K", f"{one} {other}", f"{k:.6g}")


def coupling(d: Draft) -> float:
    return d.r.choice([1.0, 1.0 - 10 ** d.r.uniform(-4, -1.3), 0.98])


def clamp(d: Draft, x: str, a: str) -> None:
    """Append what takes up the current of a leakage."""
    middle = d.node()
    d.diode(x, middle)
    d.add("R", f"{middle} {a}", d.near(20 * d.ohms))
    d.add("C", f"{middle} {a}", d.near(d.smoothing / 10))


def flyback(d: Draft, a: str) -> str:
    x, s, out = d.node(), d.node(), d.node()
    k, n = coupling(d), d.r.choice([0.2, 0.5, 1.0])
    henry = float(d.near(d.ripple))
    coupled(d, [(a, x, henry), ("0", s, n * n * henry)], k)
    d.switch(x, "0", d.gate(0, d.r.uniform(0.2, 0.6)))
    if k < 1:
        clamp(d, x, a)
    d.diode(s, out)
    d.filter(out)
    return out


def forward(d: Draft, a: str) -> str:
    x, y, s, t, out = (d.node() for _ in range(5))
    henry, n = 20 * float(d.near(d.ripple)), d.r.choice([0.5, 1.0])
    k = coupling(d)
    coupled(d, [(a, x, henry), ("0", y, henry), (s, "0", n * n * henry)], k)
    d.switch(x, "0", d.gate(0, d.r.uniform(0.2, 0.45)))
    d.diode(y, a)
    if k < 1:
        clamp(d, x, a)
    d.diode(s, t)
    d.diode("0", t)
    d.coil(t, out, d.ripple)
    d.filter(out)
    return out


def bridge(d: Draft, a: str, shift: float = 0.5) -> tuple[str, str]:
    """Append a full bridge; its diagonals conduct with a shift in periods. Return its output."""
    p, q = d.node(), d.node()
    width = 0.5 - d.r.choice([0.01, 0.02, 0.1])
    turn = d.r.uniform(0.1, 0.5) if shift < 0.5 else 0.0
    gates = [d.gate(begin, width) for begin in (0, 0.5, turn, turn + 0.5)]
    d.switch(a, p, gates[0], body=True)
    d.switch(p, "0", gates[1], body=True)
    d.switch(q, "0", gates[2], body=True)
    d.switch(a, q, gates[3], body=True)
    return p, q


def rectifier(d: Draft, nodes: str, out: str) -> None:
    """Append two diodes at each of these nodes, to the output and from ground."""
    for node in nodes.split():
        d.diode(node, out)
        d.diode("0", node)


def isolated(d: Draft, a: str) -> str:
    p, q = bridge(d, a, d.r.choice([0.5, 0.25]))
    s, t, f, out = (d.node() for _ in range(4))
    henry, n = 20 * float(d.near(d.ripple)), d.r.choice([0.5, 1.0, 2.0])
    x = p
    if d.r.random() < 0.5:
        x = d.node()
        d.coil(p, x, d.ripple / 20)
    coupled(d, [(x, q, henry), (s, t, n * n * henry)], coupling(d))
    rectifier(d, f"{s} {t}", f)
    d.coil(f, out, d.ripple)
    d.filter(out)
    return out


def resonant(d: Draft, a: str) -> str:
    p, q = bridge(d, a)
    x, y, s, t, out = (d.node() for _ in range(5))
    lr = float(d.near(d.ohms * d.period / 6))
    d.add("L", f"{p} {x}", f"{lr:.4g}")
    d.add("C", f"{x} {y}", d.near((d.period / 6.28) ** 2 / lr, 1.5))
    henry, n = d.r.uniform(3, 8) * lr, d.r.choice([0.5, 1.0])
    coupled(d, [(y, q, henry), (s, t, n * n * henry)], coupling(d))
    rectifier(d, f"{s} {t}", out)
    d.filter(out)
    return out


def active_bridges(d: Draft, a: str) -> str:
    p, q = bridge(d, a)
    s, t, out = d.node(), d.node(), d.node()
    x = d.node()
    d.coil(p, x, d.ripple / 5)
    henry = 20 * float(d.near(d.ripple))
    coupled(d, [(x, q, henry), (s, t, henry)], 1.0)
    shift = d.r.uniform(0.05, 0.25)
    gates = [d.gate(shift, 0.48), d.gate(shift + 0.5, 0.48)]
    d.switch(out, s, gates[0], body=True)
    d.switch(s, "0", gates[1], body=True)
    d.switch(out, t, gates[1], body=True)
    d.switch(t, "0", gates[0], body=True)
    d.filter(out)
    return out


def pump(d: Draft, a: str) -> str:
    x, y, out = d.node(), d.node(), d.node()
    gate, other = d.gate(0, 0.48), d.gate(0.5, 0.48)
    d.diode(a, y)
    d.switch(x, "0", gate)
    d.switch(a, x, other)
    d.tank(y, x, d.smoothing)
    d.diode(y, out)
    d.filter(out)
    return out


STAGES: tuple[Callable[[Draft, str], str], ...] = (
    buck, boost, inverting, cuk, sepic, interleaved, flyback, forward, isolated, resonant,
    active_bridges, pump,
)  # fmt: skip


def supply(d: Draft) -> str:
    """Append a source, maybe of alternating current behind a rectifier."""
    volts = d.r.choice([5, 12, 48, 400])
    kind = d.r.random()
    if kind < 0.7:
        d.add("V", "in 0", f"{volts}")
        if d.r.random() < 0.4:
            a = d.node()
            d.add("L", f"in {a}", d.small(-8, -6))
            d.add("R", f"in {a}", d.small(0, 3))
            d.tank(a, "0", d.smoothing)
            return a
        return "in"
    slow = 20 * d.period
    out = d.node()
    if kind < 0.85:
        d.add("V", "pa pb", f"SIN(0 {volts} {1 / slow:.5g})")
        d.add("R", "pb 0", "1meg")
        rectifier(d, "pa pb", out)
    else:
        d.add("R", "common 0", "1meg")
        for angle in (0, -120, 120):
            x, y = d.node(), d.node()
            d.add("V", f"{x} common", f"SIN(0 {volts} {1 / slow:.5g} 0 0 {angle})")
            d.coil(x, y, d.ripple / 50)
            rectifier(d, y, out)
    d.tank(out, "0", d.smoothing)
    return out


def converter(seed: int, smooth: bool = False) -> str:
    """Return a deck of some periods of one or two stages."""
    r = random.Random(seed)
    period = 10 ** r.uniform(-6, -4)
    edge = r.choice([0.0, period / 1000, period / 100])
    d = Draft(r, period, 10 ** r.uniform(0, 2), edge, r.random() < 0.6)
    node = supply(d)
    chosen = [r.choice(STAGES) for _ in range(r.choice([1, 1, 1, 2]))]
    for stage in chosen:
        node = stage(d, node)
    if r.random() < 0.2:
        middle = d.node()
        d.coil(node, middle, d.ripple)
        node = middle
    d.add("R", f"{node} 0", f"{d.ohms:.4g}")
    title = "converter: " + ", ".join(stage.__name__ for stage in chosen) + f" ({seed})"
    diode = r.choice(SMOOTH_DIODES if smooth else IDEAL_DIODES)
    periods = r.choice([3, 5, 10])
    cards = [
        f".model d {diode}",
        f".model sw {r.choice(SWITCHES)}",
        f".tran {period / 20:.5g} {periods * period:.5g}{' uic' if d.uic else ''}",
    ]
    return "\n".join([title, *d.lines, *cards, ".end", ""])
