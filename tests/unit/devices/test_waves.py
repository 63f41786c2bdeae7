"""Triangles written as arcs of sines, in circuits and in equations."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.devices.waves import wave_signal, wave_values, waveform_of
from nsspice.problems.descriptor import Waveform

DECK = """triangle
B1 a 0 V={LAW}
R1 a b 1k
C1 b 0 10n
B2 c 0 V={v(b) > asin(sin(2*pi*20k*time))/2 ? 1 : 0}
R2 c 0 1
.tran 1u 200u uic
"""


@pytest.mark.parametrize(
    ("law", "triangle"),
    [
        ("asin(sin(2*pi*10k*time + 0.3))*2/pi",
         lambda t: np.arcsin(np.sin(2e4 * np.pi * t + 0.3)) * 2 / np.pi),
        ("acos(cos(1 - 2*pi*10k*time))", lambda t: np.arccos(np.cos(1 - 2e4 * np.pi * t))),
        ("asin(cos(2*pi*10k*time))", lambda t: np.arcsin(np.cos(2e4 * np.pi * t))),
        ("acos(sin(2*pi*10k*time + 7))", lambda t: np.arccos(np.sin(2e4 * np.pi * t + 7))),
        ("asin(sin(4)) + 1k*time", lambda t: np.arcsin(np.sin(4.0)) + 1e3 * t),
    ],
)  # fmt: skip
def test_the_arc_of_a_sine_is_a_triangle(law: str, triangle):
    circuit = nsspice.read(DECK.replace("LAW", law))
    solution = nsspice.tran(circuit, method="modewise", signals=["v(a)", "v(b)", "v(c)"])
    # rounding of 12 radians of the argument, whose arc has the slope one
    assert np.abs(solution["v(a)"] - triangle(solution.time)).max() < 1e-13
    assert float(nsspice.op(circuit)["v(a)"][0]) == pytest.approx(float(triangle(0.0)), abs=1e-14)
    steps = nsspice.tran(circuit, method="sdirk", reltol=1e-9, signals=["v(b)"])
    # a tenth of a period is the time constant: errors of each step die out
    assert np.abs(steps["v(b)"] - solution["v(b)"]).max() < 1e-8


@pytest.mark.parametrize("phase", [-400.0, -90.0, 0.0, 30.0, 90.0, 270.0])
def test_source_and_values_agree(phase: float):
    signal = wave_signal(2.0, phase, "tri")
    times = np.linspace(0.0, 10.0, 101)
    exact = np.arcsin(np.sin(2.0 * times + np.radians(phase)))
    assert wave_values(signal, times) == pytest.approx(exact, abs=1e-13)
    moved = (wave_values(signal, times + 1e-6) - wave_values(signal, times)) / 1e-6
    inside = np.abs(np.abs(exact) - np.pi / 2) > 1e-5
    assert wave_values(signal, times, rates=True)[inside] == pytest.approx(moved[inside], rel=1e-8)
    waveform = waveform_of(signal)
    assert isinstance(waveform, Waveform)
    low, high, begin, rise, fall, width, period, _ = waveform.values
    assert begin <= 0.0 < begin + period
    turns = ((times - begin) / period) % 1.0
    pulse = np.interp(turns * period, [0.0, rise, rise + fall + width], [low, high, low])
    assert pulse == pytest.approx(exact, abs=1e-13)
