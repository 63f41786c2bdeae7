"""The dynamic thesis examples as decks, each with its closed form.

Source: T. Roubal, Non-smooth analysis in engineering and economics (2015), with corrections.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .closed_forms import (
    Solution,
    braked_oscillator,
    compliant_bounce,
    coulomb,
    parallel_rlc,
    rigid_impact,
    sgn_inductor,
)


@dataclass(frozen=True)
class Example:
    """A deck, its closed form, and which signals are states or multipliers.

    ``states`` and ``multipliers`` map a signal of the deck to (signal of the closed form, factor):
    deck signal = factor * closed form.  ``steps`` [s] suit order measurements up to ``stop`` [s].
    """

    name: str
    deck: str
    exact: Solution
    states: dict[str, tuple[str, float]]
    multipliers: dict[str, tuple[str, float]]
    stop: float
    steps: tuple[float, ...]


def friction(name: str, m: float, v0: float, load: float, stop: float) -> Example:
    """4.1.1: speed is the inductor's current, the friction force the diode's voltage."""
    grip = m * 9.81
    return Example(
        name,
        f"""4.1.1
V1 a 0 SIN(0 {load!r} {1 / (2 * math.pi)!r})
L1 a b {m!r} IC={v0!r}
D1 b 0 friction
.model friction D(Vfwd={grip!r} Vrev={grip!r})
""",
        coulomb(m, v0, load),
        {"i(l1)": ("v", 1.0)},
        {"v(b)": ("f", 1.0)},
        stop,
        (8e-3, 4e-3, 2e-3, 1e-3),
    )


def sgn(x0: float) -> Example:
    """2.3.1, corrected."""
    return Example(
        f"231_x{x0:g}",
        f"""2.3.1
V1 a 0 SIN(2 1 {1 / (2 * math.pi)!r})
L1 a b 1 IC={x0!r}
D1 b 0 sgn02
.model sgn02 D(Vfwd=2 Vrev=0)
""",
        sgn_inductor(x0),
        {"i(l1)": ("x", 1.0)},
        {"v(b)": ("v", 1.0)},
        12.0,
        (8e-3, 4e-3, 2e-3, 1e-3),
    )


SPRING = Example(
    "412",
    """4.1.2
L1 0 n2 1 IC=6
D1 n2 n3 friction
.model friction D(Vfwd=1 Vrev=1)
C1 n3 0 1 IC=-2
""",
    braked_oscillator(1.0, 0.0, 1.0, -1.0, 1.0, -2.0, 6.0),
    {"v(n3)": ("x", 1.0), "i(l1)": ("v", 1.0)},
    {"v(n2,n3)": ("F", -1.0)},
    14.0,
    (2e-3, 1e-3, 5e-4, 2.5e-4),
)

ZENER = Example(
    "423",
    """4.2.3
L1 0 n1 1 IC=-100
R1 n1 n2 1
D1 n2 n3 zener
.model zener D(Vfwd=0 Vrev=2)
C1 n3 0 1 IC=10
""",
    braked_oscillator(1.0, 1.0, 1.0, 0.0, 2.0, 10.0, -100.0),
    {"v(n3)": ("x", 1.0), "i(l1)": ("v", 1.0)},
    {"v(n2,n3)": ("F", -1.0)},
    11.0,
    (2e-3, 1e-3, 5e-4, 2.5e-4),
)

_FLOOR = """Cm v 0 1 IC=1
Ig v 0 DC 9.81
Cx x 0 1 IC=6
Gx 0 x v 0 1
Ex xe 0 x 0 1
Vr rr 0 DC 0
"""

COMPLIANT = Example(
    "414_compliant",
    "4.1.4 compliant\n" + _FLOOR + "D1 rr d\nR1 d xe 1e-4\nFn 0 v Vr -1\n",
    compliant_bounce(1.0, 1e4, 6.0, 1.0, 3.0),
    {"v(x)": ("x", 1.0), "v(v)": ("v", 1.0)},
    {"i(d1)": ("n", 1.0)},
    2.0,
    (8e-5, 4e-5, 2e-5, 1e-5),
)

_IMPACT = rigid_impact(1.0, 6.0, 1.0)
RIGID = Example(
    "414_rigid",
    "4.1.4 rigid\n" + _FLOOR + "D1 rr xe\nFn 0 v Vr -1\n",
    _IMPACT,
    {"v(x)": ("x", 1.0)},
    {"v(v)": ("v", 1.0)},
    3.0,
    # the impact comes about h/2 early; here a row lies in between, whatever the step
    tuple(_IMPACT.switches[0] / (count + 0.25) for count in (3000, 6000, 12000, 24000)),
)

BRIDGE = Example(
    "424",
    """4.2.4
C0 n1 0 1e-10 IC=10
L1 n1 0 1e-3 IC=-5
DF1 n1 p
DR1 0 p
DF2 n 0
DR2 n n1
R1 p n 2000
""",
    parallel_rlc(1e-10, 1e-3, 2000.0, 10.0, -5.0),
    {"v(n1)": ("v", 1.0), "i(l1)": ("i", 1.0)},
    {"i(r1)": ("iR", 1.0)},
    5e-6,
    (1e-9, 5e-10, 2.5e-10, 1.25e-10),
)

FRICTION_LOADED = (
    friction("411_m1", 1.0, -20.0, 1.0, 4.0),
    friction("411_m2", 2.0, -20.0, 1.0, 4.0),
)
FRICTION_FREE = friction("411_free", 1.0, -66.0, 0.0, 9.0)
SGN = (sgn(-1.0), sgn(-3.0))
ALL = (*FRICTION_LOADED, *SGN, SPRING, ZENER, COMPLIANT, RIGID, BRIDGE)
