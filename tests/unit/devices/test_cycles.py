"""Sines of a limited number of cycles, ``SIN(vo va freq td damping phase cycles)``."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice.compare import ngspice
from nsspice.errors import UsageError

SOURCES = [
    (0.0, 1.0, 1e3, 0.0, 0.0, 90.0, 5.0),
    (1.0, 2.0, 1e3, 0.5e-3, 0.0, 0.0, 3.0),
    (1.0, 2.0, 1e3, 0.5e-3, 0.0, 30.0, 2.3),
    (0.0, 2.0, 1e3, 0.5e-3, 200.0, 30.0, 2.3),
    (0.5, 2.0, 1e3, 0.0, 0.0, 180.0, 1.5),
]


def expected(source: tuple[float, ...], time: float) -> float:
    """Return the value of a source by LTspice's formula."""
    offset, amplitude, frequency, delay, damping, phase, cycles = source
    s = min(max(time - delay, 0.0), cycles / frequency)
    angle = 2.0 * math.pi * frequency * s + math.radians(phase)
    return offset + amplitude * math.sin(angle) * math.exp(-damping * s)


def written(source: tuple[float, ...]) -> str:
    return f"SINE({' '.join(map(repr, source))})"


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("method", ["auto", "sdirk"])
def test_it_stays_where_it_ends(source: tuple[float, ...], method: str) -> None:
    text = f"t\nV1 a 0 {written(source)}\nR1 a b 1k\nC1 b 0 1n\nI1 0 c {written(source)} m=2\n"
    cards = "R2 c 0 1\n.tran 20u 8m\n.save v(a) v(c) i(i1) p(v1)\n"
    found = nsspice.read(text + cards).run(method=method)[0]
    right = np.array([expected(source, t) for t in found.axis])
    assert found["v(a)"] == pytest.approx(right, abs=1e-9)
    assert found["v(c)"] == pytest.approx(2.0 * right, abs=1e-9)
    assert found["i(i1)"] == pytest.approx(2.0 * right, abs=1e-9)


def test_none_and_zero_are_no_limit() -> None:
    text = "t\nV1 a 0 SIN(0 1 1k 0 0 90{})\nR1 a 0 1k\n.tran 20u 8m\n"
    free, zero = (nsspice.read(text.format(n)).run()[0]["v(a)"] for n in ("", " 0"))
    assert (free == zero).all()


@pytest.mark.parametrize("arguments", ["0 1 1k 0 0 90 -1", "0 1 1k 0 0 90 1 1"])
def test_what_is_no_number_of_cycles(arguments: str) -> None:
    with pytest.raises(nsspice.NsspiceError):
        nsspice.read(f"t\nV1 a 0 SIN({arguments})\nR1 a 0 1k\n.tran 20u 8m\n").run()


def test_sources_that_contradict_each_other_after_the_end() -> None:
    text = f"t\nV1 a 0 {written(SOURCES[0])}\nV2 a 0 SIN(0 1 1k 0 0 90)\nR1 a 0 1\n.tran 1u 8m\n"
    with pytest.raises(nsspice.NsspiceError) as caught:
        nsspice.read(text)
    assert caught.value.diagnostics[0].code == "NS2021"
    same = text.replace("SIN(0 1 1k 0 0 90)", written(SOURCES[0]))
    assert not nsspice.read(same).run()[0].error


def test_ngspice_has_no_such_source() -> None:
    circuit = nsspice.read(f"t\nV1 a 0 {written(SOURCES[0])}\nR1 a 0 1\n.tran 1u 8m\n")
    with pytest.raises(UsageError) as caught:
        ngspice.run(circuit)
    assert "number of cycles" in str(caught.value)
