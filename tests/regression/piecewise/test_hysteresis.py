"""Inductors with hysteresis: loops in closed form, stop operators by recursion, Chan's formulas."""

from __future__ import annotations

import re

import numpy as np
import pytest

import nsspice
from nsspice.errors import NsspiceError

STOPS = [(0.1, 0.5), (0.3, 0.4), (0.05, 1.5), (2.0, 1.0)]


def table(stops: list[tuple[float, float]]) -> str:
    limits, inductances = zip(*stops, strict=True)
    return f"hysteresis=table(i={' '.join(map(str, limits))} l={' '.join(map(str, inductances))})"


def loop_area(stops: list[tuple[float, float]], amplitude: float) -> float:
    """A stop that moves by more than twice its limit encloses a parallelogram; others a line."""
    return sum(4.0 * r * (amplitude - r * l) for r, l in stops if amplitude > r * l)


@pytest.mark.parametrize("amplitude", [0.04, 0.25, 1.0])
def test_the_area_of_a_loop(amplitude: float) -> None:
    deck = f"""flux is {amplitude} sin(2 pi t)
V1 a 0 SIN(0 {2.0 * np.pi * amplitude} 1 0 0 90)
L1 a 0 2 {table(STOPS)}
.tran 10m 3 uic
.measure tran area integ v(a)*i(l1) from=1 to=2
"""
    solution = nsspice.run(deck)[0]
    assert solution.islands[0].method == "modewise"
    assert solution.certificate.passed
    wanted = loop_area(STOPS, amplitude)
    # sums of ten areas of the size of the energy that goes to and fro, L i^2
    size = wanted + 4.0 * amplitude * amplitude
    assert abs(solution.measures["area"] - wanted) <= 1e-12 * size


def test_the_loop_of_a_steady_state() -> None:
    deck = f"""flux is 0.25 sin(2 pi t) about a remanence
V1 a 0 SIN(0 {0.5 * np.pi} 1 0 0 90)
R1 a b 1n
L1 b 0 2 {table(STOPS)} remanence=0.3
.pss
.measure pss area integ v(b)*i(l1)
"""
    solution = nsspice.run(deck)[0]
    assert solution.certificate.passed
    # what drops across 1 nOhm moves the amplitude by 1e-9 of it
    assert solution.measures["area"] == pytest.approx(loop_area(STOPS, 0.25), rel=1e-8)


def recursion(stops, inductance: float, remanence: float, flux: np.ndarray) -> np.ndarray:
    """Currents at the ends of pieces in which the flux rises or falls."""
    e = np.array([-remanence * r for r, _ in stops])
    limits, inductances = np.array(stops).T
    begin = remanence * limits.sum()
    found, before = [], 0.0
    for now in flux:
        e = np.clip(e + (now - before) / inductances, -limits, limits)
        found.append(begin + now / inductance + e.sum())
        before = now
    return np.array(found)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("remanence", [0.0, 1.0, -0.4])
def test_minor_loops_follow_the_stop_operators(seed: int, remanence: float) -> None:
    rng = np.random.default_rng(seed)
    stops = [(float(r), float(l)) for r, l in rng.uniform(0.05, 1.0, (3, 2)).round(3)]
    volts = rng.uniform(-1.0, 1.0, 40).round(3)
    points = " ".join(f"{k} {v} {k + 1} {v}" for k, v in enumerate(volts))
    deck = f"steps\nV1 a 0 PWL({points})\nL1 a 0 1.5 {table(stops)} remanence={remanence}\n"
    solution = nsspice.tran(nsspice.read(deck), 40.0, 1.0, uic=True, signals=["i(l1)"])
    assert solution.certificate.passed
    currents = solution["i(l1)"]
    assert currents[0] == pytest.approx(0.0, abs=1e-15)
    wanted = recursion(stops, 1.5, remanence, np.cumsum(volts))
    # forty sums of numbers below 10
    assert np.abs(currents[1:] - wanted).max() <= 1e-13


HC, BS, BR, AREA, LENGTH, TURNS = 16.0, 0.44, 0.10, 25.1e-6, 19.8e-3, 1000.0
CORE = f"Hc={HC} Bs={BS} Br={BR} A={AREA} Lm={LENGTH} N={TURNS:g}"


def chan(field: np.ndarray, shift: float) -> np.ndarray:
    """Chan's branches as SuperSpice's manual, "Magnetic cores", gives them."""
    moved = field + shift
    return BS * moved / (np.abs(moved) + HC * (BS / BR - 1.0)) + 4e-7 * np.pi * field


@pytest.mark.parametrize("gap", [0.0, 1e-4])
def test_a_core_of_ltspice_is_fitted_as_well_as_it_says(gap: float) -> None:
    top = 20.0 * HC * BS / BR  # the field of 20 (Hc + d)
    peak = (top * LENGTH + chan(np.array([top]), 0.0)[0] * gap / (4e-7 * np.pi)) / TURNS
    deck = f"""current ramps up, down and up
I1 0 a PWL(0 0 1 {peak} 3 {-peak} 5 {peak})
L1 a 0 {CORE} Lg={gap}
B1 0 f I=v(a)
C1 f 0 1 IC=0
.tran 1m 5 uic
"""
    circuit = nsspice.read(deck)
    (note,) = [w for w in circuit.warnings if w.code == "NS1101"]
    loop, first = (float(part) / 100.0 for part in re.findall(r"(\d+)%", note.message))
    solution = nsspice.tran(circuit)
    assert solution.certificate.passed
    time, density = solution.time, solution["v(f)"] / (TURNS * AREA)
    field = (TURNS * solution["i(l1)"] - density * gap / (4e-7 * np.pi)) / LENGTH
    # percents are told without digits
    rising = time < 1.0
    mean = 0.5 * (chan(field, HC) + chan(field, -HC))
    assert np.abs(density - mean)[rising].max() <= (first + 0.01) * BS
    for part, shift in (((time > 1.0) & (time <= 3.0), HC), (time > 3.0, -HC)):
        assert np.abs(density - chan(field, shift))[part].max() <= (loop + 0.01) * BS
    assert 0.005 < loop < 0.05
    # where the branches cross the axes
    down = (time > 1.0) & (time < 3.0)
    remanent = np.interp(0.0, field[down][::-1], density[down][::-1])
    coercive = np.interp(0.0, density[down][::-1], field[down][::-1])
    assert remanent == pytest.approx(BR, abs=(loop + 0.01) * BS)
    assert coercive == pytest.approx(-HC, rel=0.01)  # 1/n^2 of the table at low fields


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("1m hysteresis=table(i=1 2 l=1)", "NS1080"),
        ("1m hysteresis=table(i=1 2)", "NS1080"),
        ("1m hysteresis=3", "NS1080"),
        ("1m remanence=1", "NS1080"),
        ("1m hysteresis=table(i=0 l=1)", "NS1025"),
        ("1m hysteresis=table(i=1 l=1) remanence=2", "NS1025"),
        ("Hc=16 Bs=.44", "NS1008"),
        (CORE.replace("Br=0.1", "Br=0.5"), "NS1025"),
        (CORE.replace("Hc=16.0", "Hc=-1"), "NS1025"),
    ],
)
def test_refused(line: str, code: str) -> None:
    with pytest.raises(NsspiceError) as error:
        nsspice.read(f"x\nL1 a 0 {line}\nR1 a 0 1\n")
    assert error.value.code == code
