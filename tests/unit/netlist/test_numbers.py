"""SPICE numbers and their traps."""

from __future__ import annotations

import pytest

from nsspice.netlist import read_number


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1.0), ("-2.5", -2.5), ("+.5", 0.5), ("3.", 3.0), ("1e3", 1e3), ("1E-3", 1e-3),
        ("1T", 1e12), ("1G", 1e9), ("1MEG", 1e6), ("1meg", 1e6), ("1k", 1e3), ("2mil", 50.8e-6),
        ("1m", 1e-3), ("1u", 1e-6), ("1µ", 1e-6), ("1μ", 1e-6), ("1n", 1e-9), ("1p", 1e-12),
        ("1f", 1e-15), ("1kOhm", 1e3), ("5V", 5.0), ("10Hz", 10.0), ("1e3k", 1e6), ("1a", 1.0),
        ("4.7uF", 4.7e-6), ("10MegHz", 1e7), ("1kΩ", 1e3), ("1e", 1.0), ("100%", 100.0),
    ],
)  # fmt: skip
def test_values(text: str, value: float) -> None:
    found = read_number(text)
    assert found is not None
    assert found.value == value
    assert not found.trap


@pytest.mark.parametrize(
    "text",
    ["", "a", "v1", "-", "+", ".", "e3", "1+1", "1-", "--1", "1 k", "nan", "inf", "1*2", "٣"],
)
def test_not_numbers(text: str) -> None:
    assert read_number(text) is None


@pytest.mark.parametrize(
    ("text", "value", "hint"),
    [
        ("2k2", 2000.0, "write 2.2k"),
        ("4R7", 4.0, "write 4.7"),
        ("1u5", 1e-6, "write 1.5u"),
        ("3M3", 3e-3, "write 3.3M"),
        ("1M", 1e-3, "write 1meg for mega, 1m for milli"),
        ("1MOhm", 1e-3, "write 1meg for mega, 1m for milli"),
        ("1.5F", 1.5e-15, "write 1.5 for farads, 1.5f for femto"),
        ("1farad", 1e-15, "write 1 for farads, 1f for femto"),
        ("2.2MHz", 2.2e-3, "write 2.2meg for mega, 2.2m for milli"),
        ("0x10", 0.0, ""),
        ("1_000", 1.0, ""),
    ],
)
def test_traps(text: str, value: float, hint: str) -> None:
    found = read_number(text)
    assert found is not None
    assert found.value == value
    assert "is read as" in found.trap
    assert found.hint == hint


@pytest.mark.parametrize(
    "text", ["10MH", "1MF", "20MA", "5MS", "1m", "1mH", "1MEG", "1f", "1FF", "1uF"]
)
def test_capital_milli_that_is_plausible(text: str) -> None:
    found = read_number(text)
    assert found is not None
    assert not found.trap
