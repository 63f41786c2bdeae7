"""The energies of exact runs, all segments together, against closed forms and quadratures."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import nsspice

#: slow rates may cost 3e-11, fast ones nothing but rounding
EXACT = 1e-9


def energy(deck: str) -> nsspice.analyses.certificate.energy.Energy:
    """Return the balance of a mode-wise run, which must be whole and hold."""
    run = nsspice.tran(nsspice.read("energy\n" + deck), method="modewise", on_failure="ignore")
    found = run.certificate.energy
    # whatever implicit steps have taken of it
    assert replace(run.certificate, taken=0.0).passed
    assert found.complete
    assert found.drift < 1e-10
    size = abs(found.delivered) + abs(found.dissipated) + abs(found.stored)
    left = found.delivered - found.dissipated - found.stored - found.lost - found.scheme
    assert abs(left) <= 1e-9 * size + 1e-18
    return found


def integral(power, end: float, pieces: int = 2000) -> float:
    """Return the integral of a smooth power from 0 to an end."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    edges = np.linspace(0.0, end, pieces + 1)
    half = 0.5 * np.diff(edges)[:, None]
    times = 0.5 * (edges[1:] + edges[:-1])[:, None] + half * nodes
    return float(np.sum(half * weights * power(times)))


@pytest.mark.parametrize("stop", [1e-9, 1e-5, 1e-3, 1.0])
def test_a_discharge_turns_half_c_v_squared_into_heat(stop):
    found = energy(f"C1 a 0 1u IC=10\nR1 a 0 1k\n.tran {stop / 10} {stop} uic\n")
    expected = 0.5e-6 * 100.0 * -math.expm1(-2.0 * stop / 1e-3)
    assert found.dissipated == pytest.approx(expected, rel=EXACT)
    assert found.delivered == 0.0


@pytest.mark.parametrize("stop", [1e-6, 1e-4, 1e-1])
def test_a_swing_without_resistance_loses_nothing(stop):
    found = energy(f"C1 a 0 1u IC=10\nL1 a 0 1m\n.tran {stop / 10} {stop} uic\n")
    assert abs(found.stored) < 1e-12 * 5e-5
    assert abs(found.dissipated) < 1e-12 * 5e-5


@pytest.mark.parametrize("conductance", [1.0, 1e3, 1e9])
def test_stiff_parts_beside_a_slow_one(conductance):
    """A fast capacitor takes half of what it gets, the slow one behind it its own half."""
    deck = f"V1 a 0 10\nR1 a b {1 / conductance}\nC1 b 0 1n IC=0\nR2 b c 10k\nC2 c 0 1u IC=0\n"
    found = energy(deck + ".tran 10m 1 uic\n")
    assert found.stored == pytest.approx(0.5 * 1.001e-6 * 100.0, rel=EXACT)
    assert found.dissipated == pytest.approx(found.stored, rel=EXACT)
    assert found.delivered == pytest.approx(2.0 * found.stored, rel=EXACT)


@pytest.mark.parametrize("resistance", [0.061, 3e-5, 3.1e-7, 4e-8])
def test_a_source_at_rest_behind_little_resistance_gives_nothing(resistance):
    """Its current is a difference of numbers of up to 1e9 A, whose rounding would be watts."""
    small, large, volts = 0.87e-9, 1.3e-6, 13.7
    found = energy(f"V1 a 0 {volts}\nR1 a b {resistance}\nC1 b 0 {small} IC=0\nR2 b c 6.1k\n"
                   f"C2 c 0 {large} IC=0\n.tran 10m 1 uic\n")  # fmt: skip
    stored = 0.5 * (small + large) * volts**2
    assert found.delivered == pytest.approx(2.0 * stored, rel=EXACT)
    assert found.dissipated == pytest.approx(stored, rel=EXACT)


def test_a_step_through_a_coil():
    """10 V, 1 Ohm, 1 mH: the current rises with 1 ms."""
    found = energy("V1 a 0 10\nR1 a b 1\nL1 b 0 1m IC=0\n.tran 10u 3m uic\n")
    rest = 1.0 - math.exp(-3.0)
    assert found.delivered == pytest.approx(100.0 * (3e-3 - 1e-3 * rest), rel=EXACT)
    assert found.stored == pytest.approx(0.5e-3 * (10.0 * rest) ** 2, rel=EXACT)


#: sources: what is read, and its values
SOURCES = {
    "sine": ("SIN(1 10 700 0 200)", lambda t: 1 + 10 * np.exp(-200 * t) * np.sin(1400 * np.pi * t)),
    "fast sine": ("SIN(0 10 40k)", lambda t: 10 * np.sin(8e4 * np.pi * t)),
    "ramp": ("PWL(0 0 10 10k)", lambda t: 1e3 * t),
    "decay": ("EXP(2 7 0 0.3m 1 1)", lambda t: 7 - 5 * np.exp(-t / 0.3e-3)),
}


@pytest.mark.parametrize("name", SOURCES)
@pytest.mark.parametrize("resistance", [1.0, 1e3])
def test_what_sources_deliver_into_r_and_c(name, resistance):
    """The charge follows v' = (u - v) / RC, here by Gauss collocation of order 8."""
    text, source = SOURCES[name]
    stop, capacitance = 5e-3, 1e-6
    deck = f"V1 a 0 {text}\nR1 a b {resistance}\nC1 b 0 1u IC=0\n.tran 5u 5m uic\n"
    found = energy(deck)
    rate = 1.0 / (resistance * capacitance)
    pieces = 40_000
    nodes = 0.5 * (1 + np.polynomial.legendre.leggauss(4)[0])
    weights = 0.5 * np.polynomial.legendre.leggauss(4)[1]
    powers = np.arange(4)
    table = (nodes[:, None] ** (powers + 1) / (powers + 1)) @ np.linalg.inv(
        nodes[:, None] ** powers
    )
    h = stop / pieces
    inverse = np.linalg.inv(np.eye(4) + h * rate * table)
    v, delivered, lost = 0.0, 0.0, 0.0
    times = np.arange(pieces)[:, None] * h + nodes * h
    u = source(times)
    for row in u:
        stages = inverse @ (v + h * rate * (table @ row))
        current = (row - stages) / resistance
        delivered += h * float(weights @ (row * current))
        lost += h * float(weights @ (current * current)) * resistance
        v += h * rate * float(weights @ (row - stages))
    size = abs(delivered) + lost
    assert abs(found.delivered - delivered) < 1e-8 * size
    assert abs(found.dissipated - lost) < 1e-8 * size
    assert found.stored == pytest.approx(0.5 * capacitance * v * v, abs=1e-8 * size)


def test_a_sine_into_a_coil_at_rest_after_whole_periods():
    """Nothing is left of the millijoules that went there and back."""
    found = energy("V1 a 0 SIN(0 10 50)\nL1 a b 10m IC=0\nD1 b 0\n.tran 20u 40m uic\n")
    assert abs(found.delivered) < 1e-15
    assert abs(found.stored) < 1e-15


def test_resonance_grows_with_the_time():
    """A source at the rate of a swing without resistance: sin t / 2 - t cos t / 2 in its units."""
    stop = 20.0
    found = energy(f"V1 a 0 SIN(0 1 {1 / (2 * math.pi)!r})\nL1 a b 1 IC=0\nC1 b 0 1 IC=0\n"
                   f".tran 0.1 {stop} uic\n")  # fmt: skip
    v = 0.5 * (math.sin(stop) - stop * math.cos(stop))
    i = 0.5 * stop * math.sin(stop)
    assert found.stored == pytest.approx(0.5 * (v * v + i * i), rel=1e-7)
    power = integral(lambda t: 0.5 * t * np.sin(t) ** 2, stop)
    assert found.delivered == pytest.approx(power, rel=1e-7)


def test_critical_damping_has_no_eigenvectors():
    """1 H, 1 F, 2 Ohm from 1 V: half a joule becomes heat."""
    found = energy("C1 a 0 1 IC=1\nL1 a b 1 IC=0\nR1 b 0 2\n.tran 0.1 40 uic\n")
    assert found.dissipated == pytest.approx(0.5, rel=EXACT)


def test_a_diode_keeps_what_a_swing_has_moved():
    """10 V into 1 mH and 1 uF: the capacitor ends at 20 V."""
    found = energy("V1 a 0 10\nL1 a b 1m IC=0\nD1 b c\nC1 c 0 1u IC=0\n.tran 1u 1m uic\n")
    assert found.stored == pytest.approx(0.5e-6 * 400.0, rel=EXACT)
    assert found.delivered == pytest.approx(found.stored, rel=EXACT)
    assert abs(found.dissipated) < 1e-12 * found.stored


def test_jumps_stand_beside_the_segments():
    """A switch joins 1 uF at 2 V and 1 uF at 0 V every 2 ms; between them both lose a part."""
    found = energy("""C1 a 0 1u IC=2
C2 b 0 1u IC=0
R1 b 0 1k
S1 a b g 0 SW
V1 g 0 PULSE(0 1 0.5m 0 0 1m 2m)
.model SW SW(VT=0.5)
.tran 10u 10m uic
""")
    # each time the joint discharges with 2 ms for 1 ms, then the second one alone with 1 ms
    a, b, heat, lost = 2.0, 0.0, 0.0, 0.0
    for turn in range(5):
        joint = 0.5 * (a + b)
        lost += 0.5e-6 * (a * a + b * b - 2.0 * joint * joint)
        after = joint * math.exp(-0.5)
        heat += 1e-6 * (joint**2 - after**2)
        length = 0.5e-3 if turn == 4 else 1e-3
        a, b = after, after * math.exp(-length / 1e-3)
        heat += 0.5e-6 * (after * after - b * b)
    assert found.lost == pytest.approx(lost, rel=EXACT)
    assert found.dissipated == pytest.approx(heat, rel=EXACT)
    assert found.stored == pytest.approx(0.5e-6 * (a * a + b * b - 4.0), rel=EXACT)


def test_a_converter_over_many_periods():
    """What the load of a buck takes is the integral of its voltage, here by the rule of Simpson."""
    deck = """V1 in 0 24
S1 in sw g 0 SW
D1 0 sw
L1 sw out 100u IC=0
C1 out 0 100u IC=0
R1 out 0 5
V2 g 0 PULSE(0 1 0 0 0 5u 10u)
.model SW SW(VT=0.5)
.tran 0.25u 2m 0 uic
"""
    found = energy(deck)
    run = nsspice.tran(nsspice.read("buck\n" + deck), method="modewise")
    power = run["v(out)"] ** 2 / 5.0
    simpson = np.sum(power[:-2:2] + 4.0 * power[1:-1:2] + power[2::2]) * 0.25e-6 / 3.0
    assert found.dissipated == pytest.approx(simpson, rel=1e-7)
    assert found.of > 300
    assert found.steps < 20


#: 24 states are more than become forms; rates of sources below and above those of the line
TONE = ("SIN(2 5 9k 0 0 40)", lambda t: 2 + 5 * np.sin(18e3 * np.pi * t + 2 * np.pi / 9))
LINES = {**SOURCES, "tone": TONE}


@pytest.mark.parametrize("coil", [None, 1e-3])
@pytest.mark.parametrize("name", LINES)
def test_what_sources_deliver_into_a_long_line(name, coil):
    """Sections of 50 Ohm, 1 uF and, if any, a coil, here by Gauss collocation of order 8."""
    text, source = LINES[name]
    sections, stop, pieces = 24 if coil is None else 12, 2e-3, 4000
    lines = [f"V1 n0 0 {text}"]
    for k in range(1, sections + 1):
        middle = f"n{k}" if coil is None else f"m{k}"
        lines += [f"R{k} n{k - 1} {middle} 50", f"C{k} n{k} 0 1u IC=0"]
        if coil is not None:
            lines.append(f"L{k} {middle} n{k} {coil!r} IC=0")
    found = energy("\n".join(lines) + f"\n.tran 20u {stop!r} uic\n")
    size = sections if coil is None else 2 * sections
    # states: voltages, then currents of coils; x' = m x + b u
    m, b = np.zeros((size, size)), np.zeros(size)
    for k in range(sections):
        for other, sign in ((k, -1.0), (k - 1, 1.0)):
            if coil is None:
                # the current of section k flows into node k and out of node k - 1
                for node, way in ((k, sign), (k - 1, -sign)):
                    if node >= 0 and other >= 0:
                        m[node, other] += way / 50.0 / 1e-6
            elif other >= 0:
                m[sections + k, other] += sign / coil
        if coil is not None:
            m[sections + k, sections + k] -= 50.0 / coil
            m[k, sections + k] += 1e6
            if k > 0:
                m[k - 1, sections + k] -= 1e6
    b[sections if coil else 0] = 1.0 / coil if coil else 1.0 / 50.0 / 1e-6
    h = stop / pieces
    nodes = 0.5 * (1 + np.polynomial.legendre.leggauss(4)[0])
    weights = 0.5 * np.polynomial.legendre.leggauss(4)[1]
    powers = np.arange(4)
    table = (nodes[:, None] ** (powers + 1) / (powers + 1)) @ np.linalg.inv(
        nodes[:, None] ** powers
    )
    # all stages of a piece at once
    inverse = np.linalg.inv(np.eye(4 * size) - h * np.kron(table, m))
    x, delivered, lost = np.zeros(size), 0.0, 0.0
    u = source(np.arange(pieces)[:, None] * h + nodes * h)
    for row in u:
        right = np.tile(x, 4) + h * np.kron(table @ row, b)
        stages = (inverse @ right).reshape(4, size)
        if coil is None:
            ahead = np.column_stack((row, stages[:, :-1]))
            currents = (ahead - stages) / 50.0
        else:
            currents = stages[:, sections:]
        delivered += h * float(weights @ (row * currents[:, 0]))
        lost += h * float(weights @ np.sum(50.0 * currents**2, axis=1))
        x = x + h * (weights @ (stages @ m.T + np.outer(row, b)))
    assert abs(found.delivered - delivered) < 1e-9 * (abs(delivered) + lost)
    assert abs(found.dissipated - lost) < 1e-9 * (abs(delivered) + lost)
