"""``nsspice magnetics``: one period of windings, against closed forms of triangles."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

Call = Callable[..., Result]

CHOPPER = """chopper
V1 in 0 12
S1 in sw g 0 ideal
D1 0 sw
Vg g 0 PULSE(0 1 0 0 0 {0.25*10u} 10u)
L1 sw out 100u
Vo out 0 3
R1 sw 0 1k
.model ideal SW(VT=0.5)
"""
TRANSFORMER = """a transformer under a square wave
V1 a 0 PULSE(-10 10 0 0 0 5u 10u)
R1 a b 10m
Lp b 0 1m
Ls c 0 0.25m
K1 Lp Ls 1
R2 c 0 5
"""


def point_of(call: Call, deck: str, *arguments: str) -> list[dict[str, object]]:
    Path("x.net").write_text(deck, "utf-8")
    told = call("magnetics", "x.net", *arguments)
    assert told.exit_code == 0, told.stderr
    point = json.loads(Path("x.mas.json").read_text("utf-8"))
    assert set(point) == {"name", "conditions", "excitationsPerWinding"}
    return list(point["excitationsPerWinding"])


def curve(winding: dict[str, object], kind: str) -> tuple[np.ndarray, np.ndarray]:
    wave = winding[kind]["waveform"]  # type: ignore[index]
    return np.array(wave["time"]), np.array(wave["data"])


def rms(time: np.ndarray, data: np.ndarray) -> float:
    """Return the RMS of lines between points; the mean square of one is (a a + a b + b b) / 3."""
    a, b = data[:-1], data[1:]
    return math.sqrt(float(np.diff(time) @ (a * a + a * b + b * b)) / 3.0 / float(np.ptp(time)))


def test_a_buck_inductor_has_a_triangle(call: Call) -> None:
    deck = CHOPPER.replace("Vo out 0 3", "C1 out 0 1\nRo out 0 1")  # 3 V: a quarter of 12 V
    (winding,) = point_of(call, deck, "--ambient", "85")
    assert winding["frequency"] == pytest.approx(1e5, rel=1e-12)
    time, data = curve(winding, "current")
    assert time.size == 3  # up and down
    # (12 V - 3 V) 2.5 us / 100 uH about 3 A; the ripple of a farad is 1e-7 V
    assert np.ptp(data) == pytest.approx(0.225, rel=1e-6)
    assert rms(time, data) == pytest.approx(math.sqrt(9.0 + 0.225**2 / 12.0), rel=1e-6)
    levels = set(np.round(curve(winding, "voltage")[1], 5))
    assert levels == {9.0, -3.0}
    point = json.loads(Path("x.mas.json").read_text("utf-8"))
    assert point["conditions"] == {"ambientTemperature": 85.0}


def test_windings_of_a_transformer_have_the_voltages_of_their_turns(call: Call) -> None:
    primary, secondary = point_of(call, TRANSFORMER, "--winding", "Lp", "--winding", "Ls")
    assert (primary["name"], secondary["name"]) == ("lp", "ls")
    grid = np.linspace(0.1e-6, 4.9e-6, 50)
    one, two = (np.interp(grid, *curve(w, "voltage")) for w in (primary, secondary))
    # turns as the root of 1 mH to 0.25 mH; points are left out within 1e-4 of 20 V
    assert one == pytest.approx(2.0 * two, abs=4e-3)
    # 5 Ohm at half of the voltage, and a triangle of 10 V 5 us / 1 mH in the primary
    assert rms(*curve(secondary, "current")) == pytest.approx(1.0, rel=0.01)


def test_a_file_is_replaced_if_it_is_its_own(call: Call) -> None:
    point_of(call, TRANSFORMER)
    assert call("magnetics", "x.net", "--json").exit_code == 0
    Path("x.mas.json").write_text('{\n "name": "mine"\n}', "utf-8")
    assert call("magnetics", "x.net").exit_code == 2


@pytest.mark.parametrize(
    ("deck", "arguments", "words"),
    [
        (TRANSFORMER, ("--winding", "r1"), "r1 is not an inductor"),
        ("none\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n", (), "the deck has no inductor"),
    ],
)
def test_what_is_no_winding_is_refused(
    call: Call, deck: str, arguments: tuple[str, ...], words: str
) -> None:
    Path("x.net").write_text(deck, "utf-8")
    told = call("magnetics", "x.net", *arguments)
    assert told.exit_code == 2
    assert words in told.stderr
    assert "NS4005" in told.stderr
