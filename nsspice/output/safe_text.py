"""Text for terminals: characters that would act on one are shown as what they are."""

from __future__ import annotations

import re

#: controls but tab and line end, and the marks that turn the direction of text
_ACTING = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]")


def visible(text: str, byte: str = "\\x{:02x}") -> str:
    r"""Return a text without characters that a terminal obeys.

    A deck of somebody else may hold them in its title and in the names of its nodes.

    Parameters
    ----------
    text : str
    byte : str
        How one below 256 is written.

    Examples
    --------
    >>> visible("v(\x1b[2Jb) = 1 V")
    'v(\\x1b[2Jb) = 1 V'
    >>> visible("v(\u202eb)")
    'v(\\u202eb)'
    """

    def shown(found: re.Match[str]) -> str:
        code = ord(found.group())
        return byte.format(code) if code < 0x100 else f"\\u{code:04x}"

    return _ACTING.sub(shown, text)
