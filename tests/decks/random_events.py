"""Random circuits whose guards vanish inside long steps, and perfectly coupled transformers."""

from __future__ import annotations

from random import Random

_DIODES = """\
.model DI D(ideal)
.model DZ D(Vfwd=0.6 Vrev=4.7)
.model DZ2 D(Vfwd=0.7 Vrev=3.3 Ron=0)
.model DR D(Vfwd=0.5 Ron=3 Roff=1e6)
"""


def _deck(lines: list[str], tail: str) -> str:
    return "\n".join(lines) + "\n" + tail + ".end\n"


def zener_chain(rng: Random) -> str:
    """Return a chain of set-valued diodes behind a resistor, with capacitors that they clamp."""
    frequency = 10 ** rng.uniform(1.5, 5)

    def capacitance() -> float:
        return 10 ** rng.uniform(-6, -3) / frequency

    sine = f"SIN({rng.choice([0, 1, -2])} {rng.choice([5, 10, 20, 40])} {frequency:.6g} 0 0"
    lines = [
        "zener chain",
        f"V1 in 0 {sine} {rng.choice([0, 30, 90])})",
        f"R1 in z0 {rng.uniform(100, 5000):.4g}",
    ]
    count = rng.randint(1, 4)
    nodes = [f"z{k}" for k in range(count)] + ["0"]
    for k in range(count):
        ends = nodes[k : k + 2]
        rng.shuffle(ends)
        lines.append(f"D{k} {ends[0]} {ends[1]} {rng.choice(['DI', 'DZ', 'DZ2', 'DR'])}")
        if rng.random() < 0.5:
            lines.append(f"RB{k} {ends[0]} {ends[1]} {10 ** rng.uniform(3, 5):.4g}")
        if rng.random() < 0.5:
            lines.append(f"CB{k} {nodes[k]} 0 {capacitance():.3g}")
    if rng.random() < 0.7:
        lines.append(f"CZ z0 0 {capacitance():.3g}")
    start = rng.choice(["", "uic"])
    return _deck(lines, f"{_DIODES}.tran {1 / frequency / 39:.6g} {1 / frequency:.6g} {start}\n")


def gated_load(rng: Random) -> str:
    """Return switches with ramps, sines and hysteresis at their gates, before one of five loads."""
    frequency = 10 ** rng.uniform(1.5, 4.5)
    period = 1 / frequency
    ramp = f"PULSE(-1 1 0 {0.4 * period:.6g} {0.5 * period:.6g} {0.05 * period:.6g} {period:.6g})"
    corners = f"PWL(0 -1 {0.7 * period:.6g} 1.3 {1.9 * period:.6g} -1.2 {3 * period:.6g} .4)"
    supply = rng.choice(["DC 12", f"SIN(5 7 {frequency * rng.uniform(0.2, 3):.6g})"])
    tilted = rng.choice(["", "RON=1 ROFF=1e6"])
    load = 10 ** rng.uniform(1, 3)
    lines = [
        "gated load",
        f"VG g 0 {rng.choice([f'SIN(0 1 {frequency:.6g})', ramp, corners])}",
        f"V1 in 0 {supply}",
        f"R0 in a {10 ** rng.uniform(1, 3):.4g}",
        "S1 a b g 0 SW",
        f".model SW SW(VT={rng.uniform(-0.8, 0.8):.4g} VH={rng.choice([0, 0.1, 0.3])} {tilted})",
        f"RL b 0 {load:.4g}",
    ]
    capacitance = 10 ** rng.uniform(-3, 1) / load / frequency
    lines += rng.choice(
        [
            [f"C1 b 0 {capacitance:.3g}"],
            [f"L1 b c {load * 10 ** rng.uniform(-3, 1) / frequency:.3g}", "RC c 0 10", "DF 0 b DI"],
            ["D1 b c DI", f"C1 c 0 {capacitance:.3g}", f"RC c 0 {load:.4g}"],
            ["C2 q 0 1u IC=1", "RQ q r 1g", "RQ2 r 0 1g", "D1 b c DZ", f"RC c 0 {load:.4g}"],
        ]
    )
    if rng.random() < 0.4:
        follower = f"VT={rng.uniform(1, 6):.4g} VH={rng.choice([0.2, 0.5])}"
        lines += ["S2 x 0 b 0 SX", "RX in x 100", f".model SX SW({follower})"]
    start = rng.choice(["", "uic"])
    return _deck(lines, f"{_DIODES}.tran {3 * period / 39:.6g} {3 * period:.6g} {start}\n")


def perfect_transformer(rng: Random) -> str:
    """Return up to three secondaries, most coupled perfectly, with ideal rectifiers."""
    frequency = 10 ** rng.uniform(3.5, 6)
    period = 1 / frequency
    primary = 10 ** rng.uniform(0, 2) * rng.uniform(0.5, 2) / frequency / 2
    coupling = rng.choice([1.0, 1.0, 1.0, 0.99])
    lines = [
        "transformer",
        f"V1 p 0 SIN(0 {rng.choice([5, 10, 20])} {frequency:.8g})",
        f"R1 p p1 {10 ** rng.uniform(-1, 0.5):.3g}",
        f"L0 p1 0 {primary:.3e}",
    ]
    for j in range(1, rng.choice([1, 2, 2, 3]) + 1):
        a, b = f"s{j}a", "0" if rng.random() < 0.4 else f"s{j}b"
        ends = [a, b] if rng.random() < 0.6 else [b, a]
        lines.append(f"L{j} {ends[0]} {ends[1]} {primary * rng.choice([0.25, 1, 4, 0.5]):.3e}")
        lines += [f"K{i}{j} L{i} L{j} {coupling}" for i in range(j)]
        load = 10 ** rng.uniform(0, 2)
        store = f"{rng.uniform(0.1, 10) * period / load:.3e} IC=0"
        kind = rng.choice(["half", "half", "bridge", "bare"])
        if kind == "half":
            lines.append(f"D{j} {a} o{j} {rng.choice(['DI', 'DV'])}")
            lines += [f"C{j} o{j} {b} {store}", f"RL{j} o{j} {b} {load:.3g}"]
        elif kind == "bridge":
            low = "0" if b != "0" and rng.random() < 0.5 else f"m{j}"
            lines += [f"D{j}a {a} o{j} DI", f"D{j}b {b} o{j} DI"]
            lines += [f"D{j}c {low} {a} DI", f"D{j}d {low} {b} DI"]
            lines += [f"C{j} o{j} {low} {store}", f"RL{j} o{j} {low} {load:.3g}"]
        else:
            lines.append(f"RL{j} {a} {b} {load:.3g}")
    models = ".model DI D(ideal)\n.model DV D(Vfwd=0.7)\n"
    return _deck(lines, f"{models}.tran {period / 13:.8g} {3 * period:.8g} uic\n")
