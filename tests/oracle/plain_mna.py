"""A minimal reader of plain element lines that writes the descriptor system directly.

It knows R L C V I E G F and set-valued diodes with literal numbers, nothing else, and serves as a
second, independent way from a netlist to its equations.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from nsspice.problems.csc import Csc
from nsspice.problems.descriptor import DescriptorSystem, Waveform

from .residual import Floats


@dataclass(frozen=True)
class Plain:
    """A descriptor system with the names of its unknowns and pairs and its initial charges."""

    system: DescriptorSystem
    unknowns: list[str]
    pairs: list[str]
    charges: Floats
    storage: dict[str, list[tuple[int, float]]]


def read(text: str) -> Plain:
    """Return the equations of a flat netlist (first line is the title)."""
    lines = [line.strip().lower() for line in text.splitlines()[1:]]
    models = dict(_model(line) for line in lines if line.startswith(".model"))
    rows = [line.split() for line in lines if line and line[0] in "rlcviegfd"]
    nodes = list(dict.fromkeys(n for r in rows for n in r[1:3] if n != "0"))
    branches = [r[0] for r in rows if r[0][0] in "lve"]
    unknowns = [f"v({n})" for n in nodes] + [f"i({b})" for b in branches]
    index = {name: k for k, name in enumerate(unknowns)}
    n = len(unknowns)
    E, G = np.zeros((n, n)), np.zeros((n, n))
    S: list[Floats] = []
    waves: list[Waveform] = []
    charge = np.zeros(n)
    pairs: list[tuple[str, Floats, float, float]] = []
    storage: dict[str, list[tuple[int, float]]] = {}

    def across(a: str, b: str) -> Floats:
        c = np.zeros(n)
        for name, sign in ((a, 1.0), (b, -1.0)):
            if name != "0":
                c[index[f"v({name})"]] += sign
        return c

    for r in rows:
        name, letter = r[0], r[0][0]
        c = across(r[1], r[2])
        e = np.zeros(n)
        if letter in "lve":
            e[index[f"i({name})"]] = 1.0
            G += np.outer(c, e) - np.outer(e, c)
        if letter == "r":
            G += np.outer(c, c) / float(r[3])
        elif letter == "c":
            E += float(r[3]) * np.outer(c, c)
            charge += float(r[3]) * _initial(r) * c
            storage[name] = _terms(c)
        elif letter == "l":
            E += float(r[3]) * np.outer(e, e)
            charge += float(r[3]) * _initial(r) * e
            storage[name] = _terms(e)
        elif letter == "v":
            S.append(-e)
            waves.append(_wave(r[3:]))
        elif letter == "i":
            S.append(-c)
            waves.append(_wave(r[3:]))
        elif letter == "e":
            G += float(r[5]) * np.outer(e, across(r[3], r[4]))
        elif letter == "g":
            G += float(r[5]) * np.outer(c, across(r[3], r[4]))
        elif letter == "f" and r[3][0] == "v":
            control = np.zeros(n)
            control[index[f"i({r[3]})"]] = 1.0
            G += float(r[4]) * np.outer(c, control)
        elif letter == "d":
            p = models[r[3]]
            pairs.append((name, c, p.get("vfwd", 0.0), p.get("ron", 0.0)))
            if "vrev" in p:
                pairs.append((f"{name}.rev", -c, p["vrev"], p.get("rrev", 0.0)))
    m = len(pairs)
    A = np.array([p[1] for p in pairs]).reshape(m, n).T
    D = np.diag([p[3] for p in pairs]) if m else np.zeros((0, 0))
    system = DescriptorSystem(
        Csc.from_dense(E),
        Csc.from_dense(G),
        Csc.from_dense(A),
        Csc.from_dense(A.T),
        Csc.from_dense(D),
        np.array([p[2] for p in pairs]),
        Csc.from_dense(np.array(S).reshape(len(S), n).T),
        tuple(waves),
        (),
        np.array([0] * len(nodes) + [1] * len(branches), dtype=np.uint8),
    )
    return Plain(system, unknowns, [p[0] for p in pairs], charge, storage)


def _terms(c: Floats) -> list[tuple[int, float]]:
    return [(int(j), float(c[j])) for j in np.flatnonzero(c)]


def _initial(row: list[str]) -> float:
    return next((float(w[3:]) for w in row if w.startswith("ic=")), 0.0)


def _model(line: str) -> tuple[str, dict[str, float]]:
    words = re.split(r"[\s()]+", line)
    found = dict(w.split("=") for w in words if "=" in w)
    return words[1], {key: float(value) for key, value in found.items()}


def _wave(words: list[str]) -> Waveform:
    numbers = [float(w) for w in re.findall(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?", " ".join(words))]
    if words[0].startswith("sin"):
        return Waveform("sin", tuple([*numbers, 0.0, 0.0, 0.0, 0.0][:6]))
    return Waveform("dc", (numbers[0],))
