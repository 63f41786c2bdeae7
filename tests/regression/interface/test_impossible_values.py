"""Values that no analysis can use end in an error that names them, whatever the interface."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.output.raw import read_raw

RC = "RC\nV1 a 0 SIN(0 1 1k) AC 1\nR1 a b 1k\nC1 b 0 1u\n"
VDMOS = (
    "switch\nV1 d 0 10\nV2 g 0 8\nR1 d e 10\nM1 e g 0 m\n.model m VDMOS(VTO=3 KP=5 {card})\n.op\n"
)
NO_NUMBERS = [math.nan, math.inf, -1.0, "x"]


@pytest.mark.parametrize("value", [*NO_NUMBERS, 0.0])
def test_a_period(value: object) -> None:
    circuit = nsspice.read(RC)
    with pytest.raises(nsspice.UsageError, match="NS4005: a period cannot be"):
        nsspice.pss(circuit, value)  # type: ignore[arg-type]
    with pytest.raises(nsspice.UsageError, match="NS4005: a period cannot be"):
        nsspice.ac(circuit, [10.0], period=value)  # type: ignore[arg-type]


@pytest.mark.parametrize("value", NO_NUMBERS)
def test_frequencies_and_settling(value: object) -> None:
    circuit = nsspice.read(RC)
    with pytest.raises(nsspice.UsageError, match="NS4005: a frequency cannot be"):
        nsspice.ac(circuit, [1.0, value])  # type: ignore[list-item]
    with pytest.raises(nsspice.UsageError, match="NS4005: a frequency cannot be"):
        nsspice.loop(circuit, "v1", [1.0, value])  # type: ignore[list-item]
    with pytest.raises(nsspice.UsageError, match="NS4005: the time to settle"):
        nsspice.pss(circuit, 1e-3, settle=value)  # type: ignore[arg-type]


def test_no_frequencies() -> None:
    with pytest.raises(nsspice.UsageError, match="NS4005: the frequencies"):
        nsspice.ac(nsspice.read(RC), [])


def test_more_periods_than_rounding_can_count() -> None:
    with pytest.raises(
        nsspice.UsageError, match="NS4005: a period of 1e\\+300 s is not a multiple"
    ):
        nsspice.pss(nsspice.read(RC), 1e300)


@pytest.mark.parametrize("card", ["CGDMAX=-1", "CGDMIN=-1", "CGDMAX=1n CGDMIN=2n"])
def test_a_capacitance(card: str) -> None:
    with pytest.raises(nsspice.NetlistError, match="NS2005") as caught:
        nsspice.read(VDMOS.format(card=card))
    place = caught.value.diagnostics[0].span
    assert place is not None
    assert place.line == 6
    assert VDMOS.format(card=card).splitlines()[5][place.column - 1 :].startswith("CGD")


@pytest.mark.parametrize("line", [".options tnom=1e300", ".options temp=1e300", ".temp 1e300"])
def test_a_temperature_of_the_deck(line: str) -> None:
    with pytest.raises(nsspice.NetlistError, match="NS2005: a temperature of 1e\\+300") as caught:
        nsspice.read(VDMOS.format(card="") + line + "\n")
    assert caught.value.diagnostics[0].span.line == 8


def test_a_temperature_of_a_call() -> None:
    with pytest.raises(nsspice.UsageError, match="NS4005: a temperature of 1e\\+300"):
        nsspice.op(nsspice.read(VDMOS.format(card="")), temperature=1e300)


def test_noise_in_a_raw_file(tmp_path: Path) -> None:
    """Thermal noise of 1k beside 10k: 4 k T (R1 || R2), real numbers over the frequency."""
    deck = "noise\nV1 a 0 AC 1\nR1 a out 1k\nR2 out 0 10k\n.noise v(out) V1 oct 1 1 100\n"
    (solution,) = nsspice.read(deck).run()
    solution.save(tmp_path / "n.raw")
    names, data = read_raw(tmp_path / "n.raw")
    table = dict(zip(names, data, strict=True))
    assert b"Flags: real\n" in (tmp_path / "n.raw").read_bytes()
    assert table["frequency"][:3].tolist() == [1.0, 2.0, 4.0]
    density = math.sqrt(4.0 * 1.380649e-23 * 300.15 * 1e4 / 11.0)
    assert table["onoise"] == pytest.approx(np.full(7, density), rel=1e-12)
    assert table["inoise"] == pytest.approx(np.full(7, 1.1 * density), rel=1e-12)


def test_a_transfer_function_in_a_raw_file(tmp_path: Path) -> None:
    deck = "gain\nV1 a 0 1\nR1 a out 1k\nR2 out 0 10k\n.tf v(out) V1\n"
    (solution,) = nsspice.read(deck).run()
    solution.save(tmp_path / "t.raw")
    names, data = read_raw(tmp_path / "t.raw")
    assert dict(zip(names, data[:, 0], strict=True)) == pytest.approx(
        {"transfer_function": 10.0 / 11.0, "input_resistance": 11e3, "output_resistance": 1e4 / 11}
    )
