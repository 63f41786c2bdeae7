"""Numbers with SI prefixes, for people."""

from __future__ import annotations

import math

_PREFIXES = {
    -18: "a", -15: "f", -12: "p", -9: "n", -6: "µ", -3: "m",
    0: "", 3: "k", 6: "M", 9: "G", 12: "T",
}  # fmt: skip


def prefix(magnitude: float) -> tuple[float, str]:
    """Return factor and SI prefix that bring a magnitude into 1 .. 1000.

    Examples
    --------
    >>> prefix(0.02)
    (0.001, 'm')
    >>> prefix(0.0)
    (1.0, '')
    """
    if magnitude == 0.0 or not math.isfinite(magnitude):
        return 1.0, ""
    # the margin keeps 999.9999999 in the next prefix and 1e-3 at "1 m" with any rounding
    power = 3 * math.floor(math.log10(abs(magnitude) * (1.0 + 1e-9)) / 3.0)
    power = min(max(power, -18), 12)
    return float(f"1e{power}"), _PREFIXES[power]


def number(value: float, unit: str = "", digits: int = 6) -> str:
    """Return a number with SI prefix and unit.

    Examples
    --------
    >>> number(2.5e-5, "s"), number(-1500.0, "V"), number(0.0, "A")
    ('25 µs', '-1.5 kV', '0 A')
    >>> number(-0.0, "V")  # a zero has no sign for people
    '0 V'
    """
    value += 0.0
    if not math.isfinite(value):
        return f"{value} {unit}".rstrip()
    if not unit:
        return f"{value:.{digits}g}"
    factor, letter = prefix(value)
    if letter == "" and abs(value) < 1e-18:
        return f"{value:.{digits}g} {unit}"
    return f"{value / factor:.{digits}g} {letter}{unit}"
