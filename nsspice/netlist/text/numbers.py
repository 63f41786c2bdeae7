"""SPICE numbers: ``1.5k``, ``10MEG``, ``4u7`` and the traps among them.

Letters after a number are a scale suffix and then a unit that is ignored: ``1kOhm`` is 1000,
``10Hz`` is 10.  Three spellings mean something else to SPICE than to people, and get a warning:
``2k2`` (2000, not 2200), ``4R7`` (4, not 4.7) and ``1M`` (1 milli, not 1 mega).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple


class Traced(float):
    """A number that knows more than its value, as how it depends on parameters.

    Its arithmetic keeps that; functions of the module ``math`` do not, and are not applied to it.
    """

    __slots__ = ()

    def applied(self, function: str, arguments: Sequence[float]) -> float:
        """Return a function of arguments some of which are such numbers."""
        raise NotImplementedError(function)


def as_float(value: float | str) -> float:
    """Return a float; one that knows more stays what it is."""
    return value if isinstance(value, Traced) else float(value)


def square_root(value: float) -> float:
    """Return the square root; of a number that knows more one that does so, too."""
    return as_float(value**0.5) if isinstance(value, Traced) else math.sqrt(value)


#: scale suffixes, lower case; both micro signs are accepted
SUFFIXES = {
    "t": 1e12,
    "g": 1e9,
    "meg": 1e6,
    "k": 1e3,
    "mil": 25.4e-6,
    "m": 1e-3,
    "u": 1e-6,
    "\u00b5": 1e-6,
    "\u03bc": 1e-6,
    "n": 1e-9,
    "p": 1e-12,
    "f": 1e-15,
}
#: the same scales as powers of ten: the text is re-read with the exponent added, so that ``4.7u``
#: is the double nearest to 4.7e-6 and not a product rounded twice
_POWERS = {
    "t": 12,
    "g": 9,
    "meg": 6,
    "k": 3,
    "m": -3,
    "u": -6,
    "\u00b5": -6,
    "\u03bc": -6,
    "n": -9,
    "p": -12,
    "f": -15,
}
_NUMBER = re.compile(
    r"([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))(?:e([+-]?[0-9]+))?"
    r"(meg|mil|[tgkmunpf\u00b5\u03bc])?([\w%\u2126\u00b0]*)",
    re.IGNORECASE,
)
#: digits behind a letter: 2k2, 4R7
_SPLIT = re.compile(r"([a-z\u00b5\u03bc]+)([0-9]+)", re.IGNORECASE)
#: units that make a capital M plausible as milli: 10MH, 5MF, 20MA, 3MS, 24.8MMHOS
_MILLI_UNITS = {"h", "f", "a", "s", "sec", "v", "amp", "amps", "mho", "mhos"}


class Number(NamedTuple):
    """A number and what is doubtful about it.

    Parameters
    ----------
    value : float
        As SPICE reads it.
    trap : str
        A warning for the user, or ``""``.
    hint : str
        How to write what was probably meant.
    elsewhere : str
        The same where no capacitance is meant, or ``""``.
    """

    value: float
    trap: str = ""
    hint: str = ""
    elsewhere: str = ""


def read_number(text: str) -> Number | None:
    """Read one SPICE number, in its original spelling (capital letters matter for a trap).

    Parameters
    ----------
    text : str
        One word of a netlist.

    Returns
    -------
    Number or None
        None if the word is not a number at all.

    Examples
    --------
    >>> read_number("4.7u").value
    4.7e-06
    >>> read_number("1e3kOhm").value
    1000000.0
    >>> read_number("2k2").trap
    '2k2 is read as 2000: digits after the suffix are ignored'
    >>> read_number("1M").hint
    'write 1meg for mega, 1m for milli'
    >>> read_number("vdd") is None
    True
    """
    try:  # most numbers are plain, and float() reads them fastest
        if text.isascii() and text[-1:].isdigit() and "_" not in text:
            return Number(float(text))
    except ValueError:
        pass
    found = _NUMBER.fullmatch(text)
    if found is None:
        return None
    digits, exponent, suffix, tail = found.groups()
    scale = suffix.lower() if suffix else ""
    power = int(exponent[:7]) if exponent else 0
    if scale == "mil":
        value = float(f"{digits}e{power}") * SUFFIXES["mil"]
    else:
        value = float(f"{digits}e{power + _POWERS.get(scale, 0)}")
    if any(c in "0123456789" for c in tail):
        return _split_digits(text, value, digits, (suffix or "") + tail)
    if suffix == "M" and tail.lower() not in _MILLI_UNITS:
        plain = text[: found.start(3)]
        return Number(
            value,
            f"{text} is read as {value:.12g}: M means milli, even as a capital",
            f"write {plain}meg for mega, {plain}m for milli",
        )
    unit = (suffix or "") + tail
    if unit == "F" or unit.lower().startswith("farad"):
        plain = text[: found.start(3)]
        return Number(
            value,
            f"{text} is read as {value:.12g}: F means femto, even as a capital",
            f"write {plain} for farads, {plain}f for femto",
            f"write {plain}f for femto",
        )
    return Number(value)


def _split_digits(text: str, value: float, digits: str, letters: str) -> Number:
    """Return a number with digits behind its letters, and what may have been meant."""
    trap = f"{text} is read as {value:.12g}: digits after the suffix are ignored"
    hint = ""
    found = _SPLIT.fullmatch(letters)
    if found and "." not in digits:
        unit = found.group(1)
        if unit.lower() == "r":
            hint = f"write {digits}.{found.group(2)}"
        elif unit.lower() in SUFFIXES:
            hint = f"write {digits}.{found.group(2)}{unit}"
    return Number(value, trap, hint)


def format_number(value: float) -> str:
    """Return the shortest text that reads back to the same double.

    Examples
    --------
    >>> format_number(4.7e-06), format_number(2.0)
    ('4.7e-06', '2')
    """
    text = repr(float(value))
    return text[:-2] if text.endswith(".0") else text
