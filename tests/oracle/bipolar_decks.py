"""The decks of ``netlists/bipolar`` as equations written by hand, solved by scipy.

The transistor is that of Ebers and Moll in its transport form; charges are Poon's junction charges
and the diffusion charges of the forward and reverse current.  Each deck has the parameter ``n``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.optimize import root as root_of

from .smooth_decks import VT, Table, junction


@dataclass(frozen=True)
class Npn:
    """Parameters of an NPN transistor, as on its model card."""

    is_: float = 1e-15
    bf: float = 100.0
    br: float = 1.0
    vaf: float = math.inf
    cje: float = 0.0
    cjc: float = 0.0
    tf: float = 0.0
    tr: float = 0.0
    n: float = 1.0

    def currents(self, vbe: float, vbc: float) -> tuple[float, float]:
        """Return the currents into collector and base."""
        forward, reverse = (junction(v, self.is_, self.n) for v in (vbe, vbc))
        transport = (forward - reverse) * (1.0 - vbc / self.vaf)
        return transport - reverse / self.br, forward / self.bf + reverse / self.br

    def charges(self, vbe: float, vbc: float) -> tuple[float, float]:
        """Return the charges of the base against emitter and collector."""
        return (
            depletion(vbe, self.cje) + self.tf * junction(vbe, self.is_, self.n),
            depletion(vbc, self.cjc) + self.tr * junction(vbc, self.is_, self.n),
        )

    def capacitances(self, vbe: float, vbc: float) -> tuple[float, float]:
        """Return the derivatives of the charges."""
        slope = self.is_ / (self.n * VT)
        grow = [math.exp(min(v / (self.n * VT), 300.0)) for v in (vbe, vbc)]
        return (
            capacitance(vbe, self.cje) + self.tf * slope * grow[0],
            capacitance(vbc, self.cjc) + self.tr * slope * grow[1],
        )


def depletion(v: float, c: float, vj: float = 0.75, m: float = 0.33, fc: float = 0.5) -> float:
    """Return the charge of a depletion layer by quadrature of its capacitance."""
    edge = min(v, fc * vj)
    total = c * vj / (1 - m) * (1 - (1 - edge / vj) ** (1 - m))
    if v > edge:
        total += 0.5 * (v - edge) * (capacitance(edge, c) + capacitance(v, c))
    return float(total)


def capacitance(v: float, c: float, vj: float = 0.75, m: float = 0.33, fc: float = 0.5) -> float:
    """Return the capacitance of a depletion layer, linear above ``fc vj``."""
    if v < fc * vj:
        return float(c * (1 - v / vj) ** -m)
    return float(c * (1 - fc) ** -m * (1 + m * (v - fc * vj) / (vj * (1 - fc))))


def inverter(inputs: np.ndarray, n: float = 1.0) -> Table:
    """One unknown after the other: for a base voltage the collector, then the base itself."""
    q = Npn(n=n)
    out = []
    for vin in inputs:

        def collector(vb: float) -> float:
            def law(vc: float) -> float:
                return (vc - 5.0) / 1e3 + q.currents(vb, vb - vc)[0]

            return float(brentq(law, -1.0, 5.1, xtol=1e-14, rtol=1e-14))

        def base(vb: float, vin: float = float(vin)) -> float:
            return (vb - vin) / 10e3 + q.currents(vb, vb - collector(vb))[1]

        vb = float(brentq(base, -0.1, min(vin, 1.2) + 0.01, xtol=1e-15, rtol=1e-15))
        out.append(collector(vb))
    return {"v(c)": np.array(out)}


def differential_pair(inputs: np.ndarray, n: float = 1.0) -> Table:
    """The emitter's voltage from the tail resistor; both collectors follow from it."""
    q = Npn(bf=150.0, br=2.0, vaf=80.0, n=n)
    table = []
    for vin in inputs:

        def collector(vb: float, ve: float) -> float:
            def law(vc: float) -> float:
                return (vc - 12.0) / 10e3 + q.currents(vb - ve, vb - vc)[0]

            return float(brentq(law, -2.0, 12.5, xtol=1e-14, rtol=1e-14))

        def tail(ve: float, vin: float = float(vin)) -> float:
            total = (ve + 12.0) / 12e3
            for vb in (vin, 0.0):
                total -= sum(q.currents(vb - ve, vb - collector(vb, ve)))
            return total

        ve = float(brentq(tail, -1.5, 0.3, xtol=1e-15, rtol=1e-15))
        table.append((collector(float(vin), ve), collector(0.0, ve), ve))
    c1, c2, e = np.array(table).T
    return {"v(c1)": c1, "v(c2)": c2, "v(e)": e}


def rtl_chain(times: np.ndarray, n: float = 1.0) -> Table:
    """Twelve node voltages: base and collector of six inverters."""
    q = Npn(bf=50.0, cje=1e-12, cjc=0.5e-12, tf=0.2e-9, tr=5e-9, n=n)

    def source(t: float) -> float:
        return float(np.interp(t, [20e-9, 22e-9, 222e-9, 224e-9], [0.0, 3.6, 3.6, 0.0]))

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        base, out = x[:6], x[6:]
        matrix, right = np.zeros((12, 12)), np.zeros(12)
        for k in range(6):
            ic, ib = q.currents(base[k], base[k] - out[k])
            cbe, cbc = q.capacitances(base[k], base[k] - out[k])
            drive = source(t) if k == 0 else out[k - 1]
            right[k] += (drive - base[k]) / 470.0 - ib
            right[6 + k] += (3.6 - out[k]) / 640.0 - ic
            if k:
                right[6 + k - 1] -= (drive - base[k]) / 470.0
            matrix[k, k] += cbe + cbc
            matrix[k, 6 + k] -= cbc
            matrix[6 + k, k] -= cbc
            matrix[6 + k, 6 + k] += cbc
        return np.linalg.solve(matrix, right)

    # from rest: nothing happens before 20 ns, and 1 us settle whatever the start was
    settled = solve_ivp(
        lambda t, x: rate(0.0, x), (0.0, 2e-6), np.full(12, 0.5), "Radau", rtol=1e-9, atol=1e-12
    )
    found = solve_ivp(
        rate,
        (0.0, float(times[-1])),
        settled.y[:, -1],
        "Radau",
        t_eval=times,
        rtol=1e-8,
        atol=1e-10,
        max_step=0.5e-9,
    )
    assert settled.success
    assert found.success
    return {f"v(n{k + 1})": found.y[6 + k] for k in range(6)}


def astable(times: np.ndarray, n: float = 1.0) -> Table:
    """Four node voltages; the coupling capacitors start with 4 V and 0 V."""
    q = Npn(cje=5e-12, cjc=3e-12, tf=1e-9, n=n)

    def matrix_of(x: np.ndarray) -> np.ndarray:
        c1, c2, b1, b2 = x
        m = np.zeros((4, 4))
        for i, j, c in ((0, 3, 10e-9), (1, 2, 10e-9)):
            m[[i, j], [i, j]] += c
            m[[i, j], [j, i]] -= c
        for i, j, c, b in ((0, 2, c1, b1), (1, 3, c2, b2)):
            cbe, cbc = q.capacitances(b, b - c)
            m[i, i] += cbc
            m[j, j] += cbe + cbc
            m[i, j] -= cbc
            m[j, i] -= cbc
        return m

    def rate(t: float, x: np.ndarray) -> np.ndarray:
        c1, c2, b1, b2 = x
        (i1, j1), (i2, j2) = q.currents(b1, b1 - c1), q.currents(b2, b2 - c2)
        right = [
            (5.0 - c1) / 1e3 - i1,
            (5.0 - c2) / 1e3 - i2,
            (5.0 - b1) / 47e3 - j1,
            (5.0 - b2) / 47e3 - j2,
        ]
        return np.linalg.solve(matrix_of(x), right)

    # at once the charges of coupling and junction capacitors are shared: the junctions start at 0 V
    target = np.array([4.0 * 10e-9, 0.0, 0.0, -4.0 * 10e-9])

    def stored(x: np.ndarray) -> np.ndarray:
        c1, c2, b1, b2 = x
        out = np.zeros(4)
        out[[0, 3]] += np.array([1.0, -1.0]) * 10e-9 * (c1 - b2)
        out[[1, 2]] += np.array([1.0, -1.0]) * 10e-9 * (c2 - b1)
        for i, j, c, b in ((0, 2, c1, b1), (1, 3, c2, b2)):
            qbe, qbc = q.charges(b, b - c)
            out[i] -= qbc
            out[j] += qbe + qbc
        return out

    x = np.array([3.0, 0.0, 0.0, -1.0])
    for _ in range(200):
        x = x + np.linalg.solve(matrix_of(x), target - stored(x))
    assert np.abs(stored(x) - target).max() < 1e-18
    found = solve_ivp(
        rate,
        (0.0, float(times[-1])),
        x,
        "Radau",
        t_eval=times,
        rtol=1e-9,
        atol=1e-11,
    )
    assert found.success
    return {name: found.y[k] for k, name in enumerate(("v(c1)", "v(c2)", "v(b1)", "v(b2)"))}


def schmitt_trigger(inputs: np.ndarray, triggered: bool, n: float = 1.0) -> Table:
    """Static states by Powell's method, from guesses with one or the other transistor on."""
    q = Npn(n=n)

    def laws(x: np.ndarray, vin: float) -> list[float]:
        c1, out, b2, e = x
        (i1, j1), (i2, j2) = q.currents(vin - e, vin - c1), q.currents(b2 - e, b2 - out)
        return [
            1e3 * ((c1 - 10.0) / 4.7e3 + (c1 - b2) / 10e3 + i1),
            1e3 * ((out - 10.0) / 2.2e3 + i2),
            1e3 * ((b2 - c1) / 10e3 + b2 / 10e3 + j2),
            1e3 * (e / 470.0 - i1 - j1 - i2 - j2),
        ]

    table = []
    for vin in inputs:
        for height in np.linspace(0.5, 0.8, 31):  # of the conducting base over the emitters
            if triggered:
                e = vin - height
                c1 = max(e + 0.05, 10.0 - 10.0 * e)
                start = [c1, 10.0, c1 / 2, e]
            else:
                e = 1.84  # 10 V divided by 2.2 kOhm and 470 Ohm, and the base current
                start = [2 * (e + height) + 0.3, e + 0.08, e + height, e]
            found = root_of(laws, start, args=(float(vin),), method="hybr", tol=1e-13)
            # between the thresholds there is a third state, which is not stable
            there = found.x[1] > 9.0 if triggered else found.x[1] < 3.0
            if np.abs(found.fun).max() < 1e-9 and there:
                table.append(found.x)
                break
    assert len(table) == len(inputs)
    return dict(zip(("v(c1)", "v(out)", "v(b2)", "v(e)"), np.array(table).T, strict=True))
