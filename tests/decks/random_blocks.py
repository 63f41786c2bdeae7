"""Decks of a random converter, and of random smooth blocks that sense it and one another."""

from __future__ import annotations

import random

_SOURCES = (
    "DC 10",
    "SIN(0 10 1k)",
    "SIN(2 10 1k 0.1m)",
    "PULSE(0 10 0 0 0 0.3m 0.7m)",
    "PULSE(0 10 0.05m 10u 10u 0.3m 0.7m)",
    "EXP(0 10 0.1m 0.2m 1.5m 0.3m)",
)
_VALVES = (
    ["D1 a b DI"],
    ["S1 a b g 0 SW", "VG g 0 PULSE(0 1 0 0 0 40u 100u)", "D2 0 b DI"],
    ["D1 a b D1", "D2 0 b D1"],
)
_LAWS = (
    "tanh({one}/5)",
    "{one}*{other}/50",
    "atan({one})+0.1*{other}",
    "sin({one}/4)",
    "1/(1+({one}/8)^2)",
)


def block_deck(seed: int, alone: bool = False) -> str:
    """Return a deck, or that of its converter alone.

    Its rows do not fall on instants at which sources jump or cross zero.
    """
    draw = random.Random(seed)
    uic = draw.choice(["", " uic"])
    lines = ["random blocks", f"V1 in 0 {draw.choice(_SOURCES)}", "VS in a 0"]
    lines += [*draw.choice(_VALVES), "RB b 0 100"]
    lines += [f"L1 b out {draw.choice([0.2, 1, 3])}m", f"C1 out 0 {draw.choice([5, 20])}u"]
    lines += [f"R1 out 0 {draw.choice([3, 10, 50])}"]
    sensed = ["v(out)", "v(b)", "v(in)", "i(VS)", "i(L1)", "v(b,out)"]
    saved = ["v(out)", "i(L1)"]
    for k in range(0 if alone else draw.randint(1, 4)):
        law = draw.choice(_LAWS).format(one=draw.choice(sensed), other=draw.choice(sensed))
        kind = draw.choice(["v", "i", "e"])
        if kind == "v":
            lines += [f"B{k} m{k} 0 V={{{law}}}", f"RF{k} m{k} f{k} 1k"]
        elif kind == "i":
            lines += [f"B{k} 0 f{k} I={{({law})*1m}}", f"RF{k} f{k} 0 1k"]
        else:
            lines += [f"E{k} x{k} 0 out 0 {draw.choice([0.5, 2])}", f"RX{k} x{k} m{k} 1k"]
            lines += [f"DX{k} m{k} 0 DJ", f"RF{k} m{k} f{k} 2k"]
        store = f"CF{k} f{k} 0 {draw.choice([10, 50, 200])}n"
        lines.append(store if draw.random() < 0.75 else f"RG{k} f{k} 0 5k")
        saved.append(f"v(f{k})")
        if draw.random() < 0.6:
            sensed.append(f"v(f{k})")
        if draw.random() < 0.3:
            lines += [f"F{k} 0 k{k} VS 0.1", f"RK{k} k{k} 0 1", f"DK{k} k{k} 0 DJ"]
            saved.append(f"v(k{k})")
    lines += [".model DI D(Ron=10m Vfwd=0.4)", ".model D1 D(Ron=1m)", ".model DJ D(IS=1e-12)"]
    lines += [".model SW SW(Ron=10m Vt=0.5)", f".save {' '.join(saved)}"]
    return "\n".join([*lines, f".tran 4.7u 1m{uic}", ""])
