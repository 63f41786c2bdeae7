"""Random decks whose signals rest on thresholds, and what they must show, found without any engine.

Each deck has a few control signals that are broken lines with exact (rational) vertices: they cross
levels, touch them for an instant, stay on them, leave them on either side.  They come straight from
a source, through a divider, through an ideal diode that clamps them, through a limit, or from a
capacitor that a current fills.  Switches of all kinds, thyristors and comparisons read them.  What
each reader shows is told by a plain walk along the vertices, in rational numbers.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

import nsspice

#: levels at which controls stay [V], and those that nothing is compared with
LEVELS = [Fraction(n, 4) for n in (-4, -2, 0, 1, 2, 4, 8)]
#: unit of time [us]; no line is shorter
UNIT = 1
#: rows in it
ROWS = 4

Vertex = tuple[Fraction, Fraction]


@dataclass
class Signal:
    """A broken line: vertices (time [us], value [V]); two at one time are a jump."""

    name: str
    vertices: list[Vertex]
    cards: list[str]
    smooth: bool = False
    dynamic: bool = False

    def at(self, time: Fraction) -> Fraction:
        """Return the value at an instant that is no vertex."""
        for (t0, v0), (t1, v1) in pairwise(self.vertices):
            if t0 < time < t1:
                return v0 + (v1 - v0) * (time - t0) / (t1 - t0)
        return self.vertices[-1][1]


@dataclass
class Deck:
    """A deck, the expected value of each signal at an instant, and the instants of all changes."""

    text: str
    method: str
    expected: dict[str, Callable[[Fraction], Fraction]]
    instants: list[Fraction]
    stop: int
    tolerance: float = 1e-9


def number(value: Fraction) -> str:
    return repr(float(value))


def line(rng: random.Random, stop: int, levels: list[Fraction]) -> list[Vertex]:
    """Return a random broken line with many stays."""
    time, value = Fraction(0), rng.choice(levels)
    vertices = [(time, value)]
    while time < stop:
        time += rng.choice([UNIT, UNIT, 2 * UNIT, 3 * UNIT])
        kind = rng.random()
        if kind >= 0.45:
            value = rng.choice(levels)
        vertices.append((time, value))
    return vertices


def pwl(vertices: list[Vertex]) -> str:
    return "PWL(" + " ".join(f"{number(t)}u {number(v)}" for t, v in vertices) + ")"


def clamped(vertices: list[Vertex], level: Fraction) -> list[Vertex]:
    """Return the lesser of a broken line and a level."""
    out: list[Vertex] = []
    for (t0, v0), (t1, v1) in pairwise(vertices):
        out.append((t0, min(v0, level)))
        if (v0 - level) * (v1 - level) < 0:
            out.append((t0 + (t1 - t0) * (level - v0) / (v1 - v0), level))
    out.append((vertices[-1][0], min(vertices[-1][1], level)))
    return out


def signal(rng: random.Random, k: int, stop: int) -> Signal:
    """Return a random control signal at node ``g{k}``."""
    name = f"g{k}"
    kind = rng.choice(["source", "source", "divider", "clamp", "charge", "limit", "pulse"])
    vertices = line(rng, stop, LEVELS)
    if kind == "source":
        return Signal(name, vertices, [f"V{name} {name} 0 {pwl(vertices)}"])
    if kind == "pulse":
        low, high = rng.sample(LEVELS, 2)
        width = rng.choice([1, 2])
        cards = [
            f"V{name} {name} 0 PULSE({number(low)} {number(high)} 1u 1u 1u {width}u {width + 4}u)"
        ]
        vertices = [(Fraction(0), low)]
        start = 1
        while start < stop + 10:
            for dt, v in ((0, low), (1, high), (1 + width, high), (2 + width, low)):
                vertices.append((Fraction(start + dt), v))
            start += width + 4
        return Signal(name, vertices, cards)
    if kind == "divider":
        parts = rng.choice([2, 3, 4])
        cards = [f"V{name} x{k} 0 {pwl([(t, parts * v) for t, v in vertices])}"]
        cards += [f"Ra{k} x{k} {name} {parts - 1}k", f"Rb{k} {name} 0 1k"]
        return Signal(name, vertices, cards)
    if kind == "clamp":
        level = rng.choice(LEVELS)
        cards = [
            f"V{name} x{k} 0 {pwl(vertices)}",
            f"Ra{k} x{k} {name} 1k",
            f"D{k} {name} y{k} ideal",
            f"Vy{k} y{k} 0 {number(level)}",
        ]
        return Signal(name, clamped(vertices, level), cards)
    if kind == "limit":
        low, high = sorted(rng.sample(LEVELS, 2))
        cards = [
            f"V{name} x{k} 0 {pwl(vertices)}",
            f"B{name} {name} 0 V=limit(v(x{k}),{number(low)},{number(high)})",
        ]
        below = clamped(vertices, high)
        flipped = clamped([(t, -v) for t, v in below], -low)
        return Signal(name, [(t, -v) for t, v in flipped], cards, smooth=True)
    # a current of steps fills a capacitor of 1 nF: 1 mA changes it by 1 V in a microsecond
    current: list[Vertex] = []
    for (t0, v0), (t1, v1) in pairwise(vertices):
        slope = (v1 - v0) / (t1 - t0)
        current += [(t0, slope), (t1, slope)]
    steps = " ".join(f"{number(t)}u {number(i)}m" for t, i in current)
    cards = [f"I{name} 0 {name} PWL({steps})", f"C{k} {name} 0 1n IC={number(vertices[0][1])}"]
    return Signal(name, vertices, cards, dynamic=True)


def switched(
    control: Signal, on_above: Fraction, off_below: Fraction, state: bool, latching: bool = False
) -> list[tuple[Fraction, bool]]:
    """Return the states of a switch: (time from which on, closed)."""
    first = control.vertices[0][1]
    if first > on_above:
        state = True
    elif first < off_below:
        state = False
    states = [(Fraction(0), state)]
    settled = True  # it has the state in which it begins, on a threshold too
    for (t0, v0), (t1, v1) in pairwise(control.vertices):
        edge = off_below if state else on_above
        if v0 != edge:
            settled = False
        if t0 == t1 or v0 != v1:
            # on the way: it turns where the line goes beyond the threshold
            if (v1 < edge if state else v1 > edge) and not (state and latching):
                time = t0 if t0 == t1 else t0 + (t1 - t0) * (edge - v0) / (v1 - v0)
                state, settled = not state, True
                states.append((time, state))
            if v1 != (off_below if state else on_above):
                settled = False
        elif v0 == edge and not settled and not (state and latching):
            state, settled = not state, True
            states.append((t0, state))
    return states


def at_state(states: list[tuple[Fraction, bool]], time: Fraction) -> bool:
    return [state for begin, state in states if begin <= time][-1]


def comparison(
    rng: random.Random, signals: list[Signal], linear: bool
) -> tuple[str, Callable[..., Fraction]]:
    """Return the text of an expression, a ``linear`` one without limits, and its value."""
    a = rng.choice(signals)
    level = rng.choice(LEVELS)
    low, high = sorted(rng.sample(LEVELS, 2))
    g, x = f"v({a.name})", number(level)
    one, none = Fraction(1), Fraction(0)

    def truth(value: bool) -> Fraction:
        return one if value else none

    texts: list[tuple[str, Callable[[Fraction], Fraction]]] = [
        (f"if({g}>{x},1,0)", lambda t: truth(a.at(t) > level)),
        (f"if({g}>={x},1,0)", lambda t: truth(a.at(t) >= level)),
        (f"{g}<{x} ? 1 : 0", lambda t: truth(a.at(t) < level)),
        (f"{g}<={x} ? 1 : 0", lambda t: truth(a.at(t) <= level)),
        (f"if({g}=={x},1,0)", lambda t: truth(a.at(t) == level)),
        (f"if({g}!={x},1,0)", lambda t: truth(a.at(t) != level)),
        (
            f"u({g}-({x}))",
            lambda t: Fraction(1, 2) if a.at(t) == level else truth(a.at(t) > level),
        ),
        (
            f"if(({g}>{number(low)})&({g}<{number(high)}),1,0)",
            lambda t: truth(low < a.at(t) < high),
        ),
        (
            f"if(({g}<={number(low)})|({g}>={number(high)}),1,0)",
            lambda t: truth(not low < a.at(t) < high),
        ),
        (f"limit({g},{number(low)},{number(high)})>{number(low)}", lambda t: truth(a.at(t) > low)),
        (f"min({g},{x})>={x}", lambda t: truth(a.at(t) >= level)),
        (f"max({g},{x})<={x}", lambda t: truth(a.at(t) <= level)),
    ]
    return rng.choice(texts[:-3] if linear else texts)


def deck(seed: int) -> Deck:
    """Return the deck of a seed."""
    rng = random.Random(seed)
    stop = rng.choice([12, 20])
    signals = [signal(rng, k, stop) for k in range(rng.choice([1, 1, 2]))]
    while any(s.dynamic for s in signals) and any(s.smooth for s in signals):
        signals = [signal(rng, k, stop) for k in range(len(signals))]
    cards = [card for s in signals for card in s.cards]
    expected: dict[str, Callable[[Fraction], Fraction]] = {}
    instants = {t for s in signals for t, _ in s.vertices}
    for s in signals:
        for level in LEVELS:
            for (t0, v0), (t1, v1) in pairwise(s.vertices):
                if (v0 - level) * (v1 - level) < 0:
                    instants.add(t0 + (t1 - t0) * (level - v0) / (v1 - v0))
    # the voltage of a capacitor stays where it is said to in closed forms alone
    stored = any(s.dynamic for s in signals)
    cards.append("Vs a 0 8")
    for j in range(rng.choice([1, 2, 3])):
        kind = rng.choice(["s", "s", "vswitch", "w", "compare", "compare", "scr"])
        control = rng.choice(signals)
        on = rng.choice(LEVELS)
        off = on if rng.random() < 0.5 else rng.choice([level for level in LEVELS if level <= on])
        flag = rng.random() < 0.3
        out = f"b{j}"
        if kind == "compare":
            text, value = comparison(rng, signals, linear=stored)
            cards += [f"B{j} {out} 0 V={text}", f"Rl{j} {out} 0 1k"]
            expected[f"v({out})"] = value
            if rng.random() < 0.3:  # one that reads what has been compared, and rests on it
                cards += [f"Bc{j} c{j} 0 V=if(v({out})>=1,5,0)", f"Rc{j} c{j} 0 1k"]
                expected[f"v(c{j})"] = lambda t, value=value: Fraction(5 * (value(t) >= 1))
            continue
        cards.append(f"Rl{j} {out} 0 1k")
        word = " on" if flag else ""
        middle, half = (on + off) / 2, (on - off) / 2
        if kind == "s":
            cards += [
                f"S{j} a {out} {control.name} 0 m{j}{word}",
                f".model m{j} SW(VT={number(middle)} VH={number(half)})",
            ]
        elif kind == "vswitch":
            cards += [
                f"S{j} a {out} {control.name} 0 m{j}{word}",
                f".model m{j} VSWITCH(VON={number(on)} VOFF={number(off)})",
            ]
            if on == off:
                cards[-1] = f".model m{j} SW(VT={number(on)})"
        elif kind == "w":
            cards += [
                f"Gw{j} 0 h{j} {control.name} 0 1m",
                f"Vw{j} h{j} k{j} 0",
                f"Rw{j} k{j} 0 100",
                f"W{j} a {out} Vw{j} m{j}{word}",
                f".model m{j} CSW(IT={number(middle)}m IH={number(half)}m)",
            ]
        else:
            on = off = abs(on)
            flag = False
            cards += [
                f"Dt{j} a {out} gt{j} m{j}",
                f"Eg{j} gt{j} {out} {control.name} 0 1",
                f".model m{j} SCR(VGT={number(on)})",
            ]
        states = switched(control, on, off, flag, latching=kind == "scr")
        instants |= {t for t, _ in states}
        expected[f"v({out})"] = lambda t, states=states: Fraction(8 * at_state(states, t))
    if stored or rng.random() < 0.5:
        node = signals[0].name
        cards += [f"Eq q 0 {node} 0 1", "Rq q qq 1k", "Cq qq 0 1n"]
    method = "modewise" if stored else rng.choice(["auto", "auto", "sdirk", "moreau"])
    uic = " uic" if stored else ""
    text = "\n".join(
        [
            f"signals on thresholds, seed {seed}",
            *cards,
            ".model ideal D(ideal)",
            f".options method={method}",
            f".tran {1.0 / ROWS}u {stop}u{uic}",
            ".end",
            "",
        ]
    )
    return Deck(text, method, expected, sorted(instants), stop)


def disagreements(found: Deck) -> list[str]:
    """Run a deck; return where it shows something else than it must."""
    run = nsspice.read(found.text).run()[0]
    # fixed steps see that a control stays where it is one step later, and move on by steps
    late = Fraction(3, 2 * ROWS) if found.method == "moreau" else Fraction(0)
    out = []
    for row, seconds in enumerate(run.time):
        time = Fraction(round(seconds * 1e6 * ROWS), ROWS)
        if any(t <= time <= t + late for t in found.instants) or time >= found.stop:
            continue
        for name, value in found.expected.items():
            exact, shown = float(value(time)), float(run[name][row])
            if not abs(shown - exact) <= found.tolerance * 8.0:
                out.append(f"{name} at {float(time)} us: {shown} for {exact}")
    if not run.certificate.passed:
        out.append(f"certificate: {run.certificate.worst}")
    return out
