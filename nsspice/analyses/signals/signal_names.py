"""Signal names: one canonical spelling, and suggestions for misspelt ones."""

from __future__ import annotations

import re
from functools import lru_cache

_CALL = re.compile(r"^([vip])\(([^()]*)\)$")


@lru_cache(maxsize=4096)  # runs of one circuit ask for the same names
def canonical(name: str) -> str:
    """Return a signal name in lower case, without blanks, ground written ``0``.

    ``v(a,0)`` is ``v(a)``, SPICE's ``v1#branch`` is ``i(v1)`` and ``@r1[i]`` is ``i(r1)``.
    ``ib(q1)`` and ``@q1[ib]`` are the current ``i(q1.b)`` into the base, ``ic(q1)`` is ``i(q1)``;
    so are ``ig(m1)`` and ``is(m1)`` those into gate and source, ``id(m1)`` is ``i(m1)``.

    Examples
    --------
    >>> canonical(" V( Out , GND ) ")
    'v(out)'
    >>> canonical("V1#branch")
    'i(v1)'
    >>> canonical("Ib(Q1)"), canonical("@q1[ie]"), canonical("Ic(Q1)")
    ('i(q1.b)', 'i(q1.e)', 'i(q1)')
    """
    key = re.sub(r"\s+", "", name.lower())
    if key.endswith("#branch"):
        return f"i({key[:-7]})"
    if (device := re.match(r"^@(.+)\[(i|id|ic|p)\]$", key)) is not None:
        return f"{device[2][0]}({device[1]})"
    if (device := re.match(r"^@(.+)\[i([begs])\]$", key)) is not None:
        return f"i({device[1]}.{device[2]})"
    if (device := re.match(r"^i([cdbegs])\((.+)\)$", key)) is not None:
        return f"i({device[2]})" if device[1] in "cd" else f"i({device[2]}.{device[1]})"
    match = _CALL.match(key)
    if match is None:
        return key
    letter, inner = match.groups()
    if letter != "v":
        return key
    nodes = ["0" if node == "gnd" else node for node in inner.split(",")]
    if len(nodes) == 2 and nodes[1] == "0":
        nodes = nodes[:1]
    return f"v({','.join(nodes)})"


def unit(name: str) -> str:
    """Return the unit of a signal: V, A, W, or an empty string.

    Examples
    --------
    >>> unit("v(a)"), unit("i(r1)"), unit("time")
    ('V', 'A', 's')
    """
    if name == "time":
        return "s"
    if name == "frequency":
        return "Hz"
    if name[:3] in ("re(", "im("):
        return unit(name[3:-1].partition("@")[0])
    if name in ("temp", "temper"):
        return "°C"
    match = _CALL.match(name)
    return {"v": "V", "i": "A", "p": "W"}[match[1]] if match else ""
