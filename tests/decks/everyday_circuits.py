"""Random decks of the kind people write: chains, pulses that end with the run, a gate, sources that
read a node; nothing is chosen to be hard, and nothing to be well posed."""

from __future__ import annotations

import random

IDEAL_MODELS = """
.model DI D(ideal)
.model DZ D(Vfwd=0.7 Vrev=5 Ron=0.1)
.model DR D(Ron=10m Roff=1meg)
.model SW1 SW(VT=2.5)
.model SW2 SW(VT=2.5 VH=1 RON=1m ROFF=10meg)
"""
SMOOTH_MODELS = """
.model DM1 D(IS=1e-12)
.model DM2 D(IS=1e-14 N=1.5 RS=1 CJO=10p TT=5n)
.model DM3 D(IS=1e-10 BV=6 IBV=1m)
.model QN NPN(IS=1e-14 BF=100 VAF=80 CJE=5p CJC=3p TF=1n)
.model QP PNP(IS=1e-14 BF=60 RB=20)
"""


def ideal(seed: int) -> str:
    """Return a deck of linear elements, ideal diodes and switches; 2 to 3 periods."""
    r = random.Random(seed + 10**6)
    count = r.randint(2, 6)
    nodes = ["0"] + [f"n{k}" for k in range(1, count + 1)]
    lines = [f"everyday {seed}"]
    period = 10 ** r.uniform(-6, -2)
    edge = r.choice([0, period / 100, period / 1e4])
    shape = f"{edge:.5g} {edge:.5g}"
    sources = [
        f"PULSE({r.choice([0, 0, -5])} {r.choice([1, 5, 12])} {r.choice([0, 0, period / 4])} "
        f"{shape} {0.4 * period:.5g} {period:.5g})",
        f"SIN({r.choice([0, 1])} {r.choice([1, 5, 12])} {1 / period:.5g})",
        f"PWL(0 0 {period / 2:.5g} 5 {period:.5g} 5 {1.5 * period:.5g} -5 {2 * period:.5g} 0)",
        "DC 5",
    ]
    lines.append(f"V1 n0 0 {r.choice(sources)}")
    lines.append(f"Rs n0 n1 {10 ** r.uniform(-1, 2):.3g}")
    for k in range(2, count + 1):
        kind, other = r.random(), r.choice(nodes[:k])
        if kind < 0.5:
            lines.append(f"R{k} n{k} {other} {10 ** r.uniform(1, 4):.3g}")
        elif kind < 0.75:
            lines.append(f"C{k} n{k} {other} {period / 10 ** r.uniform(1, 4):.3g}")
        else:
            lines.append(f"L{k} n{k} {other} {period * 10 ** r.uniform(1, 3):.3g}")
    gate = False
    for j in range(r.randint(2, 6)):
        a, b = r.sample(nodes, 2)
        kind, ohms = r.random(), 10 ** r.uniform(1, 3.5)
        if kind < 0.2:
            start = f" IC={r.choice([0, 1, -1])}" if r.random() < 0.3 else ""
            lines.append(f"C1{j} {a} {b} {period / 6 / ohms:.3g}{start}")
        elif kind < 0.35:
            lines.append(f"L1{j} {a} {b} {ohms * period / 6:.3g}")
        elif kind < 0.65:
            lines.append(f"D{j} {a} {b} {r.choice(['DI', 'DZ', 'DR'])}")
        elif kind < 0.8:
            if not gate:
                delay = r.choice([0, period / 8])
                pulse = f"0 5 {delay:.5g} {shape} {0.45 * period:.5g} {period:.5g}"
                lines.append(f"Vg g 0 PULSE({pulse})")
                gate = True
            lines.append(f"S{j} {a} {b} g 0 SW{r.randint(1, 2)}")
        elif kind < 0.87:
            sensed = r.choice(nodes[1:])
            lines.append(f"E{j} y{j} 0 {sensed} 0 {r.choice([0.5, 2, -1, 10])}")
            lines.append(f"Ry{j} y{j} {a} {ohms:.3g}")
        elif kind < 0.93:
            wave = sources[0].replace("12)", "1)") if r.random() < 0.3 else "DC 1m"
            lines.append(f"I{j} {a} {b} {wave}")
        else:
            lines.append(f"R9{j} {a} {b} {ohms:.3g}")
    periods = r.choice([2, 3, 2.5])
    uic = " uic" if r.random() < 0.5 else ""
    lines.append(f"{IDEAL_MODELS}.tran {period / 200:.5g} {periods * period:.5g}{uic}")
    return "\n".join([*lines, ".end"])


def smooth(seed: int) -> str:
    """Return a deck with junctions, transistors and expressions; 3 periods."""
    r = random.Random(seed)
    count = r.randint(2, 6)
    nodes = ["0"] + [f"n{k}" for k in range(1, count + 1)]
    lines = [f"everyday {seed}"]
    f = 10 ** r.uniform(2, 5)
    if r.random() < 0.6:
        source = f"SIN({r.choice([0, 0, 1])} {r.choice([1, 5, 12])} {f:.4g})"
    else:
        edge = f"{0.01 / f:.3g} {0.01 / f:.3g}"
        source = f"PULSE(0 {r.choice([1, 5, 12])} 0 {edge} {0.4 / f:.3g} {1 / f:.3g})"
    lines.append(f"V1 n0 0 {source}")
    lines.append(f"Rs n0 n1 {10 ** r.uniform(0.5, 2):.3g}")
    for k in range(2, count + 1):
        lines.append(f"R{k} n{k} {r.choice(nodes[:k])} {10 ** r.uniform(1, 4):.3g}")
    for j in range(r.randint(2, 5)):
        a, b = r.sample(nodes, 2)
        kind, ohms = r.random(), 10 ** r.uniform(1.5, 3.5)
        if kind < 0.3:
            start = f" IC={r.choice([0, 1, -1])}" if r.random() < 0.3 else ""
            lines.append(f"C{j} {a} {b} {1 / (6.28 * f * ohms):.3g}{start}")
        elif kind < 0.4:
            lines.append(f"L{j} {a} x{j} {ohms / (6.28 * f):.3g}")
            lines.append(f"Rx{j} x{j} {b} {ohms / 10:.3g}")
        elif kind < 0.62:
            lines.append(f"D{j} {a} {b} DM{r.randint(1, 3)}")
        elif kind < 0.75:
            base, _ = r.sample(nodes, 2)
            lines.append(f"Q{j} {a} {b} {base} {r.choice(['QN', 'QP'])}")
        elif kind < 0.9:
            law = _expression(r, f"v({r.choice(nodes[1:])})", f)
            if r.random() < 0.5:
                lines.append(f"B{j} y{j} 0 V={{{law}}}")
                lines.append(f"Ry{j} y{j} {a} {ohms:.3g}")
            else:
                lines.append(f"B{j} {a} {b} I={{1m*({law})}}")
        else:
            lines.append(f"R9{j} {a} {b} {ohms:.3g}")
    uic = " uic" if r.random() < 0.4 else ""
    lines.append(f"{SMOOTH_MODELS}.tran {3 / f / 300:.4g} {3 / f:.4g}{uic}")
    return "\n".join([*lines, ".end"])


def _expression(r: random.Random, v: str, f: float) -> str:
    return r.choice([
        f"tanh({v})",
        f"{v}*{v}/10",
        f"limit(3*{v},-2,2)",
        f"abs({v})",
        f"1/(1+{v}*{v})",
        f"exp(-{v}*{v})",
        f"max({v},0)-0.5",
        f"sin({v})",
        f"2*sin(6.28*{f:.4g}*time)",
        f"atan({v})",
    ])  # fmt: skip
