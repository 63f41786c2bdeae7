"""Closed forms of small circuits as written rows, for tests of the judge itself."""

from __future__ import annotations

import numpy as np

Columns = dict[str, np.ndarray]


def charging(start: float = 2.0, tau: float = 1e-3) -> Columns:
    """5 V, 1 kOhm and 1 uF from an initial voltage."""
    t = np.linspace(0, 5e-3, 501)
    v = 5 + (start - 5) * np.exp(-t / tau)
    i = (5 - v) / 1e3
    return {"time": t, "v(a)": 0 * t + 5, "v(b)": v, "i(v1)": -i, "i(r1)": i, "i(c1)": i}


CHARGING = "RC\nV1 a 0 5\nR1 a b 1k\nC1 b 0 1u IC=2\n.tran 10u 5m uic\n"


def rectifier() -> Columns:
    """A sine of 10 V, an ideal diode and 1 kOhm."""
    t = np.linspace(0, 40e-3, 401)
    v = 10 * np.sin(2 * np.pi * 50 * t)
    i = np.maximum(v, 0) / 1e3
    return {"time": t, "v(a)": v, "v(b)": 1e3 * i, "i(v1)": -i, "i(d1)": i, "i(r1)": i}


RECTIFIER = "rectifier\nV1 a 0 SIN(0 10 50)\nD1 a b\nR1 b 0 1k\n.tran 100u 40m\n"


def broken_line() -> Columns:
    """A ramp across a diode of five parameters; corners at 0.7 V, 7 uA and -8 V, -80 uA."""
    t = np.linspace(0, 1, 401)
    v = -10 + 20 * t
    i = np.interp(v, [-10, -8, 0.7, 10], [-80e-6 - 2 / 20, -80e-6, 7e-6, 7e-6 + 9.3 / 10])
    return {"time": t, "v(a)": v, "i(v1)": -i, "i(d1)": i}


BROKEN_LINE = """line
V1 a 0 PWL(0 -10 1 10)
D1 a 0 line
.model line D(Vfwd=0.7 Ron=10 Roff=100k Vrev=8 Rrev=20)
.tran 2.5m 1
"""


def switched(closes: float = 0.75, opens: float = 1.75) -> Columns:
    """10 V over 1 Ohm (10 MOhm) of a switch and 9 Ohm; the control is a triangle of 2 V."""
    t = np.sort(np.concatenate([np.linspace(0, 2, 201), [closes, closes, opens, opens]]))
    closed = (np.arange(t.size) > np.argmax(t >= closes)) & (t <= opens)
    closed[np.flatnonzero(t == opens)[1:]] = False
    i = 10 / np.where(closed, 10.0, 9.0 + 1e7)
    return {
        "time": t, "v(a)": 0 * t + 10, "v(b)": 9 * i, "v(g)": 2 - 2 * np.abs(1 - t),
        "i(v1)": -i, "i(s1)": i, "i(r1)": i, "i(vg)": 0 * t,
    }  # fmt: skip


SWITCHED = """switch
V1 a 0 10
S1 a b g 0 sw
R1 b 0 9
Vg g 0 PWL(0 0 1 2 2 0)
.model sw SW(VT=1 VH=0.5 Ron=1 Roff=10meg)
.tran 10m 2
"""


def phase_control(fires: float = 0.1, opens: float = 0.5) -> Columns:
    """A thyristor between a sine of 10 V and 1 Ohm, fired once by the voltage at its gate."""
    t = np.sort(np.concatenate([np.linspace(0, 1, 201), [fires, 0.1, 0.15]]))
    v = 10 * np.sin(2 * np.pi * t)
    fired = (np.arange(t.size) > np.argmax(t >= fires)) & (t <= opens)
    i = np.where(fired, v, 0.0)
    gate = np.where((np.arange(t.size) > np.argmax(t >= 0.1)) & (t <= 0.15), 2.0, 0.0)
    gate[np.flatnonzero(t == 0.15)[-1]] = 0.0
    return {
        "time": t, "v(a)": v, "v(b)": i, "v(g)": i + gate,
        "i(v1)": -i, "i(d1)": i, "i(r1)": i, "i(vg)": 0 * t,
    }  # fmt: skip


PHASE_CONTROL = """thyristor
V1 a 0 SIN(0 10 1)
D1 a b g scr
R1 b 0 1
Vg g b PULSE(0 2 0.1 0 0 0.05)
.model scr SCR(VGT=1)
.tran 5m 1
"""


def controlled() -> Columns:
    """A sine of 1 A in 1 Ohm, and what five sources make of it; B is 2 V where it is positive."""
    t = np.linspace(0, 1, 201)
    i = np.sin(2 * np.pi * t)
    step = np.where(i > 1e-12, 2.0, 0.0)
    return {
        "time": t, "v(a)": i, "v(e)": 3 * i, "v(g)": 4 * i, "v(f)": -5 * i, "v(h)": 6 * i,
        "v(b)": step, "i(i1)": -i, "i(v1)": i, "i(r1)": i, "v(m)": 0 * i,
        "i(e1)": -3 * i, "i(re)": 3 * i, "i(g1)": -4 * i, "i(rg)": 4 * i, "i(f1)": 5 * i,
        "i(rf)": -5 * i, "i(h1)": -6 * i, "i(rh)": 6 * i, "i(b1)": -step, "i(rb)": step,
    }  # fmt: skip


CONTROLLED = """controlled sources
I1 a 0 SIN(0 -1 1)
R1 a m 1
V1 m 0 0
E1 e 0 a 0 3
Re e 0 1
G1 g 0 a 0 -4
Rg g 0 1
F1 f 0 V1 5
Rf f 0 1
H1 h 0 V1 6
Rh h 0 1
B1 b 0 V={v(a)>0 ? 2 : 0}
Rb b 0 1
.tran 5m 1
"""


def transformer() -> Columns:
    """2 H and 8 H with k = 0.5, driven by a sine of 1 A at one side, open at the other."""
    t = np.linspace(0, 1, 401)
    w = 2 * np.pi
    i, rate = np.sin(w * t), w * np.cos(w * t)
    v2 = 2 * rate
    return {
        "time": t, "v(a)": 2 * rate, "v(b)": v2, "i(i1)": -i, "i(l1)": i,
        "i(l2)": -v2 / 1e9, "i(r1)": v2 / 1e9,
    }  # fmt: skip


TRANSFORMER = """transformer
I1 a 0 SIN(0 -1 1)
L1 a 0 2
L2 b 0 8
K1 L1 L2 0.5
R1 b 0 1g
.tran 2.5m 1 uic
"""


def joined(after: float) -> Columns:
    """Two charged capacitors, 1 F with 1 V and 3 F, that meet at 1 s."""
    t = np.array([0, 0.25, 0.5, 0.75, 1, 1, 1.25, 1.5, 1.75, 2])
    late = np.arange(t.size) > 4
    zero = 0 * t
    return {
        "time": t, "v(a)": np.where(late, after, 1.0), "v(b)": np.where(late, after, 0.0),
        "i(c1)": zero, "i(c2)": zero,
    }  # fmt: skip


CAPACITORS = "capacitors\nC1 a 0 1 IC=1\nC2 b 0 3\n"
JOINED = (
    CAPACITORS + "S1 a b g 0 sw\nVg g 0 PWL(0 0 1 0 1 2)\n.model sw SW(VT=1)\n.tran .25 2 uic\n"
)


def joined_by_switch(after: float = 0.25) -> Columns:
    c = joined(after)
    gate = np.where(np.arange(c["time"].size) > 4, 2.0, 0.0)
    return {**c, "v(g)": gate, "i(s1)": 0 * gate, "i(vg)": 0 * gate}


def freewheeling(flux: float = 1.0) -> Columns:
    """1 A in 1 H and a closed switch; when it opens at 1 s a diode carries it on."""
    t = np.array([0, 0.25, 0.5, 0.75, 1, 1, 1.25, 1.5, 1.75, 2])
    late = np.arange(t.size) > 4
    i = np.where(late, flux, 1.0)
    return {
        "time": t, "v(a)": 0 * t, "v(g)": np.where(late, 0.0, 2.0), "i(l1)": i,
        "i(s1)": np.where(late, 0.0, -1.0), "i(d1)": np.where(late, i, 0.0), "i(vg)": 0 * t,
    }  # fmt: skip


FREEWHEELING = """inductor
L1 a 0 1 IC=1
S1 a 0 g 0 sw
D1 0 a
Vg g 0 PWL(0 2 1 2 1 0)
.model sw SW(VT=1)
.tran .25 2 uic
"""


def implicit_euler() -> Columns:
    """The circuit of ``charging`` by steps of 0.5 ms."""
    t = 0.5e-3 * np.arange(11)
    v = 5 - 3 / 1.5 ** np.arange(11)
    i = (5 - v) / 1e3
    return {"time": t, "v(a)": 0 * t + 5, "v(b)": v, "i(v1)": -i, "i(r1)": i, "i(c1)": i}


def changed(columns: Columns, row: int, **by: float) -> Columns:
    """Return rows of which one is moved; keys are v_a for v(a)."""
    out = {k: v.copy() for k, v in columns.items()}
    for key, value in by.items():
        out[f"{key[0]}({key[2:]})"][row] += value
    return out
