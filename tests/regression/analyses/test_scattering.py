"""``.sp``: scattering parameters against closed forms, and the file that other programs read."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.errors import NsspiceError, UsageError
from nsspice.output.deck.conversion import convert

#: tens of roundings in the solution of small, well-conditioned equations
EXACT = 1e-13


def scattering(deck: str) -> nsspice.Solution:
    (solution,) = nsspice.read(deck).run()
    return solution


def close(value: object, expected: object, tolerance: float = EXACT) -> None:
    np.testing.assert_allclose(value, expected, rtol=0, atol=tolerance)


def test_one_port() -> None:
    """S = (Z - Z0)/(Z + Z0) of R and C in series."""
    sol = scattering("load\nV1 a 0 portnum 1 z0 75\nR1 a b 30\nC1 b 0 10p\n.sp list 1meg 1g\n")
    z = 30.0 + 1.0 / (2j * math.pi * sol.axis * 10e-12)
    close(sol["s_1_1"], (z - 75.0) / (z + 75.0))
    assert sol.ports == (75.0,)


def test_matched_attenuator() -> None:
    """A pi of 96.25 and 71.15 Ohm, 10 dB in 50 Ohm: with k = 10^(1/2), R = 50 (k+1)/(k-1)."""
    k = math.sqrt(10.0)
    shunt, series = 50.0 * (k + 1.0) / (k - 1.0), 25.0 * (k - 1.0 / k)
    sol = scattering(f"""10 dB
V1 in 0 AC 1 portnum 1 z0 50
R1 in 0 {shunt!r}
R2 in out {series!r}
R3 out 0 {shunt!r}
V2 out 0 portnum 2
.sp lin 3 1meg 1g
""")
    for name, value in (("s_1_1", 0.0), ("s_2_2", 0.0), ("s_2_1", 1.0 / k), ("s_1_2", 1.0 / k)):
        close(sol[name], np.full(3, value))


def test_chebyshev_filter() -> None:
    """Five elements by their chain matrix; what is not transmitted is reflected."""
    sol = scattering("""low-pass filter of ngspice's examples
C1 in 0 33.2p
L1 in 2 99.2n
C2 2 0 57.2p
L2 2 out 99.2n
C3 out 0 33.2p
V1 in 0 dc 0 ac 1 portnum 1 z0 50
V2 out 0 dc 0 ac 0 portnum 2 z0 50
.sp lin 40 2.5MEG 250MEG
""")
    s = 2j * math.pi * sol.axis
    chain = np.broadcast_to(np.eye(2, dtype=complex), (s.size, 2, 2))
    for capacitance, inductance in ((33.2e-12, 99.2e-9), (57.2e-12, 99.2e-9), (33.2e-12, 0.0)):
        shunt, series = (
            np.broadcast_to(np.eye(2, dtype=complex), chain.shape).copy() for _ in "ab"
        )
        shunt[:, 1, 0], series[:, 0, 1] = s * capacitance, s * inductance
        chain = chain @ shunt @ series
    a, b, c, d = chain[:, 0, 0], chain[:, 0, 1] / 50.0, chain[:, 1, 0] * 50.0, chain[:, 1, 1]
    close(sol["s_2_1"], 2.0 / (a + b + c + d), 1e-12)
    close(sol["s_1_1"], (a + b - c - d) / (a + b + c + d), 1e-12)
    close(sol["s_1_2"], sol["s_2_1"])
    close(np.abs(sol["s_1_1"]) ** 2 + np.abs(sol["s_2_1"]) ** 2, np.ones(s.size), 1e-12)


def test_three_ports() -> None:
    """The resistive splitter: no reflection, half of each wave to each other port."""
    ports = "\n".join(f"V{k} p{k} 0 portnum {k}\nR{k} p{k} m {{50/3}}" for k in (1, 2, 3))
    sol = scattering(f"splitter\n{ports}\n.sp list 1k\n")
    for i in (1, 2, 3):
        for j in (1, 2, 3):
            close(sol[f"s_{i}_{j}"], [0.0 if i == j else 0.5])


UNEQUAL = """unequal ports
V1 in 0 dc 2 ac 1 portnum 1 z0 50
R1 in out 100
V2 out 0 dc 0 ac 0 portnum 2 z0 75
R2 out 0 75
"""


def test_unequal_ports_as_in_ngspice() -> None:
    """What ngspice 39 prints, to its 7 digits: also that z0 is in series at the operating point."""
    sol = scattering(UNEQUAL + ".sp list 1meg\n")
    for name, value in (
        ("s_1_1", 4.666667e-01),
        ("s_1_2", 3.265986e-01),
        ("s_2_1", 3.265986e-01),
        ("s_2_2", -2.000000e-01),
    ):
        close(sol[name], [value], 5e-8)
    bias = nsspice.op(nsspice.read(UNEQUAL))
    close([bias["v(in)"][0], bias["v(out)"][0]], [1.466667, 4.0e-1], 5e-7)


def test_touchstone(tmp_path: Path) -> None:
    """One line for each frequency, S11 S21 S12 S22; version 2 for unequal impedances."""
    deck = UNEQUAL.replace("R2 out", "E1 x 0 in 0 2\nR3 x out 1k\nR2 out")
    for z0, version in (("50", 1), ("75", 2)):
        sol = scattering(deck.replace("z0 75", f"z0 {z0}") + ".sp list 1meg 1g\n")
        path = tmp_path / f"v{version}.s2p"
        sol.save(path)
        lines = [line for line in path.read_text("utf-8").splitlines() if line[0] not in "!["]
        assert lines[0] == "# Hz S RI R 50"
        rows = [list(map(float, line.split())) for line in lines[1:]]
        for row, k in zip(rows, range(2), strict=True):
            read = np.array(row[1::2]) + 1j * np.array(row[2::2])
            assert row[0] == sol.axis[k]
            assert list(read) == [sol[f"s_{n}"][k] for n in ("1_1", "2_1", "1_2", "2_2")]
        keywords = [x for x in path.read_text("utf-8").splitlines() if x[0] == "["]
        assert ("[Reference] 50 75" in keywords) == (version == 2)
        assert bool(keywords) == (version == 2)
    with pytest.raises(UsageError, match="has 2 ports"):
        sol.save(tmp_path / "a.s3p")
    with pytest.raises(UsageError, match="only scattering parameters"):
        nsspice.op(nsspice.read(deck)).save(tmp_path / "a.s2p")


def test_ports_survive_a_conversion() -> None:
    clean = convert(UNEQUAL + ".sp dec 2 1k 1meg\n")
    assert "V1 in 0 DC 2 AC 1 portnum=1 z0=50" in clean.text
    assert convert(clean.text).text == clean.text


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ("V1 a 0 1\nR1 a 0 1", "numbered 1, 2, 3"),
        ("V1 a 0 portnum 2\nR1 a 0 1", "numbered 1, 2, 3"),
        ("V1 a 0 portnum 1\nV2 b 0 portnum 1\nR1 a b 1", "numbered 1, 2, 3"),
        ("V1 a 0 portnum 1 z0 0\nR1 a 0 1", "a positive number"),
        ("V1 a 0 portnum 1 Rser=1\nR1 a 0 1", "no rser besides"),
        ("V1 a 0 portnum\nR1 a 0 1", "the value of portnum is missing"),
    ],
)
def test_what_is_no_port_is_refused(lines: str, message: str) -> None:
    with pytest.raises(NsspiceError, match=message):
        nsspice.read(f"ports\n{lines}\n.sp list 1k\n").run()


def test_power_and_noise_are_left_out_with_a_warning() -> None:
    deck = "ports\nV1 a 0 portnum 1 z0 50 pwr 1m freq 1g\nR1 a 0 50\n.sp lin 2 1 2 1\n"
    messages = [w.message for w in nsspice.read(deck).warnings]
    assert messages == [
        "v1: pwr of the port is ignored",
        "v1: freq of the port is ignored",
        ".sp: noise parameters are not computed",
    ]
