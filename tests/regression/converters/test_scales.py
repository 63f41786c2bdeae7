"""Results do not depend on the units in which times, currents and masses are large or small."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice

# 6 + t - 4.905 t^2 = 0
HIT = (1 + np.sqrt(1 + 4 * 4.905 * 6)) / (2 * 4.905)


@pytest.mark.parametrize("unit", [1e-12, 1e-6, 1e3, 1e7, 1e12])
def test_a_fall_takes_as_many_looks_at_any_pace(unit: float) -> None:
    """A fall in units of `unit` seconds: the ramp that drives two integrators had a rate of one per
    second, so that 1e7 s took 15 million looks and from 1e8 s on the exact engine gave up.
    """
    found = nsspice.tran(
        nsspice.read(f"""A ball falls upon a spring
Cm v 0 {unit!r} IC=1
Ig v 0 9.81
Cx x 0 {unit!r} IC=6
Gx 0 x v 0 1
Ex xe 0 x 0 1
Vr rr 0 0
D1 rr d
R1 d xe 0.96
Fn 0 v Vr -1
.tran {unit * 1e-2!r} {unit * 3!r} uic
""")
    )
    time = found.time / unit
    falls = time < HIT
    assert falls.sum() == 122
    exact = 6 + time - 4.905 * time**2
    # rounding of 6 V and of the squares, in 120 rows
    assert np.abs(found["v(x)"] - exact)[falls].max() < 1e-13 * 6
    assert found.certificate.passed, found.certificate
    # the fall, the spring, and what an interval may be halved for
    assert found.stats["intervals"] < 30
    assert found.stats["fixed_steps"] == 0


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
@pytest.mark.parametrize("unit", [1e-9, 1.0, 1e6, 1e12])
def test_a_rectifier_works_with_any_currents(unit: float, method: str) -> None:
    """Currents of 1e12 A beside 10 V were taken for those of a contradiction."""
    deck = """Half-wave rectifier
Vin in 0 SIN(0 10 50)
D1 in out
C1 out 0 {c!r}
R1 out 0 {r!r}
.tran 100u 60m
"""
    one, other = (
        nsspice.tran(nsspice.read(deck.format(c=100e-6 * k, r=1e3 / k)), method=method, step=20e-6)
        if method == "moreau"
        else nsspice.tran(nsspice.read(deck.format(c=100e-6 * k, r=1e3 / k)), method=method)
        for k in (1.0, unit)
    )
    assert other.certificate.passed, other.certificate
    # the same steps and the same rounding, up to that of the values
    assert np.abs(one["v(out)"] - other["v(out)"]).max() < 1e-9 * 10
    assert np.abs(one["i(d1)"] - other["i(d1)"] / unit).max() < 1e-8 * np.abs(one["i(d1)"]).max()


@pytest.mark.parametrize("method", ["modewise", "sdirk", "moreau"])
def test_a_loop_of_large_capacitors_and_a_source_starts(method: str) -> None:
    """A linear circuit of 1e5 F and 1e-9 Ohm was refused with a residual of 1e-17 (NS3002)."""
    found = nsspice.tran(
        nsspice.read("""Two capacitors and resistors across a pulse
V1 a 0 PULSE(-180 180 10u 0 6u 46u 115u)
C1 a b 144k
C2 b 0 12k
R1 a b 1n
R2 b 0 0.5n
.tran 1u 9u
"""),
        method=method,
    )
    # before the pulse, a divider of 1 and 0.5 nOhm
    assert np.abs(found["v(b)"] + 60.0).max() < 1e-9 * 180
    assert found.certificate.passed, found.certificate


@pytest.mark.parametrize("mass", [1e-9, 0.3, 0.7, 100.0, 1e9])
def test_a_ball_of_any_mass_comes_to_rest(mass: float) -> None:
    """Thesis 4.1.4: its speed at rest is the rounding of the forces on it, and moves its place."""
    found = nsspice.tran(
        nsspice.read(f"""A ball on a rigid floor
Cm v 0 {mass!r} IC=1
Ig v 0 {9.81 * mass!r}
Cx x 0 1 IC=6
Gx 0 x v 0 1
Ex xe 0 x 0 1
Vr rr 0 0
D1 rr xe
Fn 0 v Vr -1
.tran 10m 3 uic
""")
    )
    assert found.certificate.passed, found.certificate
    rests = found.time > HIT
    assert np.abs(found["v(x)"])[rests].max() < 1e-12 * 6
    assert np.abs(found["i(d1)"][rests] / (9.81 * mass) - 1.0).max() < 1e-9
