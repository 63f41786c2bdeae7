"""Some hard cases in Siconos and in Pulsim, each in its own Python; prints JSON, a line per case.

    /usr/bin/python3 tools/peer_cases.py siconos     # Debian: apt install python3-siconos
    PULSIM_PYTHON tools/peer_cases.py pulsim

Siconos is given the complementarity system that nsspice derives itself: x' = A x + a + B l,
y = C x + c + D l, 0 <= y complementary to l >= 0, by hand.  Pulsim is given the circuit; its diodes
are conductances of 1e9 and 1e-12 S.
"""

from __future__ import annotations

import json
import math
import sys
from typing import Any

import numpy as np


def siconos(A: Any, B: Any, C: Any, D: Any, c: Any, x0: Any, h: float, stop: float) -> Any:
    """March a linear complementarity system with constant c by Siconos; return t and x."""
    import siconos.kernel as sk

    x0 = np.asarray(x0, dtype=float)
    ds = sk.FirstOrderLinearDS(x0, np.asarray(A, dtype=float))
    relation = sk.FirstOrderLinearTIR(np.asarray(C, dtype=float), np.asarray(B, dtype=float))
    relation.setDPtr(np.asarray(D, dtype=float))
    relation.setePtr(np.asarray(c, dtype=float))
    law = sk.ComplementarityConditionNSL(len(c))
    model = sk.NonSmoothDynamicalSystem(0.0, stop)
    model.insertDynamicalSystem(ds)
    model.link(sk.Interaction(law, relation), ds)
    stepping = sk.TimeStepping(
        model, sk.TimeDiscretisation(0.0, h), sk.EulerMoreauOSI(1.0), sk.LCP()
    )
    t, x = [0.0], [x0.copy()]
    while stepping.hasNextEvent():
        stepping.computeOneStep()
        t.append(stepping.nextTime())
        x.append(ds.x().copy())
        stepping.nextStep()
    return np.array(t), np.array(x)


def siconos_cases() -> dict[str, Any]:
    """Return case -> function that returns (what was found, what is right)."""

    def oscillator() -> tuple[float, float]:
        # x = [v, i]; pairs: voltage and current of a diode, l = [p, i1, -n, i4], y = their partners
        L, C, R = 1e-2, 1e-6, 1e3
        B = [[0, -1 / C, 0, 1 / C], [0, 0, 0, 0]]
        Cm = [[0, 0], [-1, 0], [0, 0], [1, 0]]
        D = [[1 / R, -1, 1 / R, 0], [1, 0, 0, 0], [1 / R, 0, 1 / R, -1], [0, 0, 1, 0]]
        A = [[0, -1 / C], [1 / L, 0]]
        h, stop = 1e-7, 1e-3
        _, x = siconos(A, B, Cm, D, np.zeros(4), [10, 0], h, stop)
        s, w = 1 / (2 * R * C), math.sqrt(1 / (L * C) - 1 / (2 * R * C) ** 2)
        k = (x.shape[0] - 1) * h
        exact = 10 * math.exp(-s * k) * (math.cos(w * k) - s / w * math.sin(w * k))
        return float(x[-1, 0]), exact

    def rectifier() -> tuple[float, float]:
        # 10 V - R - D - C: charges and then holds; y = voltage of the diode backwards
        R, C = 1.0, 1e-3
        _, x = siconos([[0]], [[1 / C]], [[1]], [[R]], [-10], [0], 1e-6, 1e-3)
        return float(x[-1, 0]), 10 * (1 - math.exp(-1))

    def jump() -> tuple[float, float]:
        # 10 V - D - C without a resistor: the charge of C jumps
        _, x = siconos([[0]], [[1 / 1e-6]], [[1]], [[0]], [-10], [0], 1e-5, 1e-4)
        return float(x[-1, 0]), 10.0

    def cut() -> tuple[float, float]:
        # an inductor's 1 A against a diode: the current jumps to zero; y = forward current
        _, x = siconos([[0]], [[1 / 1e-3]], [[1]], [[0]], [0], [-1], 1e-5, 1e-4)
        return float(x[-1, 0]), 0.0

    def spiral() -> tuple[float, float]:
        # Filippov: x' = -s1 + 2 s2, -2 s1 - s2, s = sign; Zeno at t = 1 from (0.5, 0.5) ... exact 0
        # sign by two pairs: s = 1 - 2 l1, 0 <= l1, 1 - l1; y1 = p, y2 = 1 - l1, p - n = x
        a = np.array([[-1.0, 2.0], [-2.0, -1.0]])
        A = np.zeros((3, 3))  # the third state is a constant 1
        A[:2, 2] = a @ [1, 1]
        B = np.zeros((3, 4))
        B[:2, 0], B[:2, 2] = -2 * a[:, 0], -2 * a[:, 1]
        C = np.zeros((4, 3))
        C[0, 0] = C[2, 1] = 1
        D = np.zeros((4, 4))
        D[0, 1] = D[2, 3] = 1
        D[1, 0] = D[3, 2] = -1
        _, x = siconos(A, B, C, D, [0, 1, 0, 1], [0.5, 0.5, 1], 1e-3, 3.0)
        return float(np.abs(x[-1, :2]).max()), 0.0

    return {
        "LC oscillator with a bridge": oscillator,
        "capacitor charged through a diode": rectifier,
        "capacitor jumps through a diode": jump,
        "inductor cut by a diode": cut,
        "Zeno: Filippov's spiral": spiral,
    }


def pulsim_cases() -> dict[str, Any]:
    """Return case -> function that returns (what was found, what is right)."""
    import pulsim

    def oscillator() -> tuple[float, float]:
        b = pulsim.CircuitBuilder()
        b.add_capacitor("C0", "n1", "gnd", 1e-6, 10.0)
        b.add_inductor("L1", "n1", "gnd", 1e-2, 0.0)
        for name, a, c in (("D1", "n1", "p"), ("D2", "gnd", "p"), ("D3", "n", "gnd"),
                           ("D4", "n", "n1")):  # fmt: skip
            b.add_diode(name, a, c, 1e9, 1e-12, 0.0)
        b.add_resistor("R1", "p", "n", 1e3)
        result = pulsim.simulate(b, 1e-3, dt=1e-7)  # its event engine takes no initial values
        s, w = 500.0, math.sqrt(1e8 - 500.0**2)
        exact = 10 * math.exp(-0.5) * (math.cos(w * 1e-3) - s / w * math.sin(w * 1e-3))
        return float(np.asarray(result.v("n1"))[-1]), exact

    def charged(resistance: float) -> Any:
        def case() -> tuple[float, float]:
            b = pulsim.CircuitBuilder()
            b.add_voltage_source("V1", "a", "gnd", 10.0)
            start = "a"
            if resistance:
                b.add_resistor("R1", "a", "b", resistance)
                start = "b"
            b.add_diode("D1", start, "c", 1e9, 1e-12, 0.0)
            b.add_capacitor("C1", "c", "gnd", 1e-3 if resistance else 1e-6, 0.0)
            result = pulsim.simulate(b, 1e-3, engine="dsed")
            exact = 10 * (1 - math.exp(-1)) if resistance else 10.0
            return float(np.asarray(result.v("c"))[-1]), exact

        return case

    def cut() -> tuple[float, float]:
        b = pulsim.CircuitBuilder()
        b.add_inductor("L1", "a", "gnd", 1e-3, 1.0)
        b.add_diode("D1", "a", "gnd", 1e9, 1e-12, 0.0)
        result = pulsim.simulate(b, 1e-4, dt=1e-7)
        return float(abs(np.asarray(result.v("a"))[-1])), 0.0

    return {
        "LC oscillator with a bridge": oscillator,
        "capacitor charged through a diode": charged(1.0),
        "capacitor jumps through a diode": charged(0.0),
        "inductor cut by a diode": cut,
    }


def main() -> None:
    """Print one line per case."""
    cases = {"siconos": siconos_cases, "pulsim": pulsim_cases}[sys.argv[1]]()
    for name, case in cases.items():
        line: dict[str, Any] = {"case": name}
        try:
            line["found"], line["right"] = case()
        except Exception as error:  # what a peer refuses is part of the result
            line["error"] = f"{type(error).__name__}: {error}"[:200]
        print("\n" + json.dumps(line), flush=True)


if __name__ == "__main__":
    main()
