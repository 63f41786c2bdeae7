"""Circuits of the first chapters on power electronics, with element values over decades.

Each function returns the element lines of one circuit, whose sources, switches and loads are scaled
by the period and by the load: a filter is as long in ``tau`` periods as the book says, or far from
it.  Nothing is chosen to be hard.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Values:
    """Numbers of one deck.

    Parameters
    ----------
    volts : float
        Amplitude or supply [V].
    ohms : float
        Load [Ohm].
    period : float
        Of the line or of the switching [s].
    tau : float
        Of the filter and its load, in periods.
    duty : float
        Of the switches.
    """

    volts: float
    ohms: float
    period: float
    tau: float
    duty: float

    @property
    def farads(self) -> float:
        """Capacitance whose time constant with the load is ``tau`` periods."""
        return self.tau * self.period / self.ohms

    @property
    def henries(self) -> float:
        """Inductance whose time constant with the load is ``tau`` periods."""
        return self.tau * self.period * self.ohms

    def sine(self, name: str, nodes: str, degrees: float = 0.0) -> str:
        """Return a source of a sine."""
        return f"V{name} {nodes} SIN(0 {self.volts:g} {1 / self.period:g} 0 0 {degrees:g})"

    def gate(self, name: str, part: float = 0.0, width: float | None = None) -> str:
        """Return a gate drive that begins this part of the period late."""
        width = self.duty if width is None else width
        times = f"{part * self.period:g} 0 0 {width * self.period:g} {self.period:g}"
        return f"V{name} {name} 0 PULSE(0 5 {times})"


def half_wave(v: Values) -> str:
    return f"{v.sine('1', 'in 0')}\nD1 in b D\nR1 b 0 {v.ohms:g}\nC1 b 0 {v.farads:g}"


def half_wave_resistive(v: Values) -> str:
    return f"{v.sine('1', 'in 0')}\nD1 in b D\nR1 b 0 {v.ohms:g}"


def half_wave_inductive(v: Values) -> str:
    return f"""{v.sine("1", "in 0")}
D1 in b D
D2 0 b D
L1 b c {v.henries:g}
R1 c 0 {v.ohms:g}"""


def centre_tapped(v: Values) -> str:
    return f"""{v.sine("1", "a 0")}
{v.sine("2", "0 b")}
D1 a p D
D2 b p D
R1 p 0 {v.ohms:g}
C1 p 0 {v.farads:g}"""


def bridge(v: Values) -> str:
    return f"""{v.sine("1", "a b")}
D1 a p D
D2 b p D
D3 0 a D
D4 0 b D
R1 p 0 {v.ohms:g}
C1 p 0 {v.farads:g}"""


def bridge_with_choke(v: Values) -> str:
    return f"""{v.sine("1", "a b")}
Rs a s {v.ohms / 100:g}
D1 s p D
D2 b p D
D3 0 s D
D4 0 b D
L1 p q {v.henries:g}
C1 q 0 {v.farads:g}
R1 q 0 {v.ohms:g}"""


def six_pulse(v: Values) -> str:
    sources = "\n".join(v.sine(str(k), f"a{k} m", 120.0 * k) for k in range(3))
    legs = "\n".join(
        f"L{k} a{k} b{k} {v.henries / 100:g}\nDp{k} b{k} p D\nDn{k} 0 b{k} D" for k in range(3)
    )
    return f"{sources}\n{legs}\nRm m 0 1meg\nC1 p 0 {v.farads:g}\nR1 p 0 {v.ohms:g}"


def clamp(v: Values) -> str:
    return f"{v.sine('1', 'in 0')}\nC1 in out {v.farads:g}\nD1 0 out D\nR1 out 0 {v.ohms:g}"


def biased_clamp(v: Values) -> str:
    return f"""{v.sine("1", "in 0")}
C1 in out {v.farads:g}
V2 bias 0 {v.volts / 3:g}
D1 bias out D
R1 out 0 {v.ohms:g}"""


def clipper(v: Values) -> str:
    return f"""{v.sine("1", "in 0")}
R1 in out {v.ohms:g}
D1 out hi D
V2 hi 0 {v.volts / 3:g}
D2 lo out D
V3 lo 0 {-v.volts / 2:g}
C1 out 0 {v.farads / 100:g}"""


def peak_detector(v: Values) -> str:
    return f"""{v.sine("1", "in 0")}
Rs in a {v.ohms / 1000:g}
D1 a out D
C1 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def doubler(v: Values) -> str:
    return f"""{v.sine("1", "in 0")}
C1 in a {v.farads:g}
D1 0 a D
D2 a out D
C2 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def delon_doubler(v: Values) -> str:
    return f"""{v.sine("1", "in m")}
D1 in p D
D2 n in D
C1 p m {v.farads:g}
C2 m n {v.farads:g}
R1 p n {v.ohms:g}
R2 n 0 {v.ohms:g}"""


def cascade(v: Values) -> str:
    lines = [v.sine("1", "in 0")]
    left, right = "in", "0"
    for k in range(3):
        a, b = f"a{k}", f"b{k}"
        lines += [f"Ca{k} {left} {a} {v.farads:g}", f"Da{k} {right} {a} D"]
        lines += [f"Db{k} {a} {b} D", f"Cb{k} {right} {b} {v.farads:g}"]
        left, right = a, b
    return "\n".join([*lines, f"R1 {right} 0 {v.ohms:g}"])


def relay(v: Values) -> str:
    return f"""{v.gate("g")}
V1 in 0 {v.volts:g}
L1 in a {v.henries:g}
R1 a b {v.ohms:g}
S1 b 0 g 0 S
D1 b in D"""


def buck(v: Values) -> str:
    return f"""{v.gate("g")}
V1 in 0 {v.volts:g}
S1 in a g 0 S
D1 0 a D
L1 a out {v.henries:g}
C1 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def synchronous_buck(v: Values) -> str:
    return f"""{v.gate("g")}
{v.gate("h", v.duty, 0.95 * (1 - v.duty))}
V1 in 0 {v.volts:g}
S1 in a g 0 S
S2 a 0 h 0 S
D1 0 a D
D2 a in D
L1 a out {v.henries:g}
C1 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def boost(v: Values) -> str:
    return f"""{v.gate("g")}
V1 in 0 {v.volts:g}
L1 in a {v.henries:g}
S1 a 0 g 0 S
D1 a out D
C1 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def buck_boost(v: Values) -> str:
    return f"""{v.gate("g")}
V1 in 0 {v.volts:g}
S1 in a g 0 S
L1 a 0 {v.henries:g}
D1 out a D
C1 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def cuk(v: Values) -> str:
    return f"""{v.gate("g")}
V1 in 0 {v.volts:g}
L1 in a {v.henries:g}
S1 a 0 g 0 S
C1 a b {v.farads:g}
D1 b 0 D
L2 b out {v.henries:g}
C2 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def sepic(v: Values) -> str:
    return f"""{v.gate("g")}
V1 in 0 {v.volts:g}
L1 in a {v.henries:g}
S1 a 0 g 0 S
C1 a b {v.farads:g}
L2 b 0 {v.henries:g}
D1 b out D
C2 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def flyback(v: Values) -> str:
    return f"""{v.gate("g")}
V1 in 0 {v.volts:g}
L1 in a {v.henries:g}
L2 0 b {v.henries / 4:g}
K1 L1 L2 1
S1 a 0 g 0 S
D1 b out D
C1 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def flyback_with_leakage(v: Values) -> str:
    return f"""{v.gate("g")}
V1 in 0 {v.volts:g}
L1 in a {v.henries:g}
L2 0 b {v.henries / 4:g}
K1 L1 L2 0.98
S1 a 0 g 0 S
Dc a c D
Cc c in {v.farads:g}
Rc c in {10 * v.ohms:g}
D1 b out D
C1 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def forward(v: Values) -> str:
    return f"""{v.gate("g", 0.0, 0.9 * min(v.duty, 0.5))}
V1 in 0 {v.volts:g}
L1 in a {10 * v.henries:g}
L2 0 r {10 * v.henries:g}
L3 s 0 {2.5 * v.henries:g}
K1 L1 L2 1
K2 L1 L3 1
K3 L2 L3 1
S1 a 0 g 0 S
Dr r in D
D1 s x D
D2 0 x D
L4 x out {v.henries:g}
C1 out 0 {v.farads:g}
R1 out 0 {v.ohms:g}"""


def full_bridge_inverter(v: Values) -> str:
    legs = "\n".join(
        f"S{k}p in {k} {g} 0 S\nD{k}p {k} in D\nS{k}n {k} 0 {h} 0 S\nD{k}n 0 {k} D"
        for k, g, h in (("a", "g", "h"), ("b", "h", "g"))
    )
    return f"""{v.gate("g", 0.0, 0.45)}
{v.gate("h", 0.5, 0.45)}
V1 in 0 {v.volts:g}
{legs}
L1 a c {v.henries:g}
R1 c b {v.ohms:g}"""


CIRCUITS: tuple[Callable[[Values], str], ...] = (
    half_wave,
    half_wave_resistive,
    half_wave_inductive,
    centre_tapped,
    bridge,
    bridge_with_choke,
    six_pulse,
    clamp,
    biased_clamp,
    clipper,
    peak_detector,
    doubler,
    delon_doubler,
    cascade,
    relay,
    buck,
    synchronous_buck,
    boost,
    buck_boost,
    cuk,
    sepic,
    flyback,
    flyback_with_leakage,
    forward,
    full_bridge_inverter,
)
#: models of diodes and switches: resistances over decades, none of them in some
ON = ("", "Ron=1u", "Ron=1m", "Ron=10m", "Ron=1")
OFF = ("", "Roff=10k", "Roff=1meg", "Roff=1g")
DROP = ("", "", "Vfwd=0.7")


def textbook_deck(number: int) -> str:
    """Return a deck: its circuit by the number, its values by chance over decades."""
    r = random.Random(number)
    circuit = CIRCUITS[number % len(CIRCUITS)]
    values = Values(
        volts=r.choice([0.1, 5.0, 24.0, 325.0, 1e4]),
        ohms=r.choice([0.1, 1.0, 10.0, 1e3, 1e5]),
        period=r.choice([1e-6, 1e-5, 1e-3, 0.02]),
        tau=r.choice([0.01, 0.1, 1.0, 10.0, 100.0]),
        duty=r.choice([0.2, 0.4, 0.6]),
    )
    on, off = r.choice(ON), r.choice(OFF)
    diode = " ".join(filter(None, (on, off, r.choice(DROP)))) or "ideal"
    switch = " ".join(filter(None, ("VT=2.5", on, off)))
    start = r.choice(["", " uic"])
    length = f"{values.period / 100:g} {3 * values.period:g}"
    return f"""{circuit.__name__} {number}
{circuit(values)}
.model D D({diode})
.model S SW({switch})
.tran {length}{start}
.end
"""
