"""``.pz``: poles and zeros against transfer functions on paper, and those ngspice publishes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.errors import NsspiceError, UsageError
from nsspice.output.raw import write_raw
from nsspice.problems.pencil import SingularPencil, roots

#: a few roundings of the matrices, times what the roots amplify them by; about 1e4 units
EXACT = 1e-12


def found(deck: str, kind: str) -> list[complex]:
    """Return the poles or zeros of a deck in the order of the solution."""
    (solution,) = nsspice.read(deck).run()
    names = [c[3:-1] for c in solution.columns if c.startswith(f"re({kind}")]
    return [complex(solution[name][0]) for name in names]


def check(deck: str, kind: str, expected: list[complex], tolerance: float = EXACT) -> None:
    values = found(deck, kind)
    assert len(values) == len(expected), values
    for want in expected:
        nearest = min(values, key=lambda s: abs(s - want))
        values.remove(nearest)
        assert abs(nearest - want) <= tolerance * abs(want), (nearest, want)


def quadratic(a: float, b: float, c: float) -> list[complex]:
    """Return the roots of a s^2 + b s + c."""
    root = np.sqrt(complex(b * b - 4.0 * a * c))
    return [(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)]


def test_series_resonance() -> None:
    """v(c)/v(in) = 1/(L C s^2 + R C s + 1); at the resistor it has a zero at zero."""
    deck = "series\nV1 in 0 1\nL1 in a 1m\nR1 a b 10\nC1 b 0 1u\n.pz in 0 {} 0 vol pz\n"
    poles = quadratic(1e-3 * 1e-6, 10.0 * 1e-6, 1.0)
    check(deck.format("b"), "pole", poles)
    check(deck.format("b"), "zero", [])
    swapped = "series\nV1 in 0 1\nL1 in a 1m\nC1 a b 1u\nR1 b 0 10\n.pz in 0 b 0 vol pz\n"
    check(swapped, "pole", poles)
    assert found(swapped, "zero") == [0.0]


def test_an_undamped_resonance_is_on_the_axis() -> None:
    w = 1.0 / math.sqrt(2e-3 * 3e-6)
    values = found("tank\nL1 a 0 2m\nC1 a 0 3u\n.pz a 0 a 0 cur pz\n", "pole")
    assert [v.real for v in values] == [0.0, 0.0]
    assert [v.imag for v in values] == pytest.approx([-w, w], rel=EXACT)


def test_sallen_key() -> None:
    """Unity gain: H = 1/(R1 R2 C1 C2 s^2 + (R1 + R2) C2 s + 1), the amplifier ideal."""
    deck = """Sallen-Key low-pass filter
V1 in 0 AC 1
R1 in a 10k
R2 a b 22k
C1 a out 3.3n
C2 b 0 1n
E1 out 0 b 0 1
.pz in 0 out 0 vol pz
"""
    check(deck, "pole", quadratic(10e3 * 22e3 * 3.3e-9 * 1e-9, 32e3 * 1e-9, 1.0))
    check(deck, "zero", [])


def test_amplifier_of_one_pole() -> None:
    """A follower of A/(1 + s/p): the pole moves to (1 + A) p."""
    deck = """follower
V1 in 0 AC 1
G1 0 x in out 1m
R1 x 0 1e8
C1 x 0 1n
E1 out 0 x 0 1
Rl out 0 1k
.pz in 0 out 0 vol pz
"""
    check(deck, "pole", [-(1.0 + 1e5) / (1e8 * 1e-9)], 1e-10)  # 1 + A loses 5 digits
    check(deck, "zero", [])


def test_an_input_without_a_source_is_held_or_left_open() -> None:
    """R1 then R2 parallel to C: a voltage input shorts R1 to the capacitor, a current does not."""
    deck = "divider\nR1 in out 1k\nR2 out 0 2k\nC1 out 0 1u\n.pz in 0 out 0 {} pol\n"
    check(deck.format("vol"), "pole", [-1.0 / (2e3 / 3.0 * 1e-6)])
    check(deck.format("cur"), "pole", [-1.0 / (2e3 * 1e-6)])
    flipped = deck.replace("in 0 out 0", "0 in 0 out")
    check(flipped.format("vol"), "pole", [-1.0 / (2e3 / 3.0 * 1e-6)])


def test_a_difference_of_nodes_is_an_output() -> None:
    """An all-pass lattice: H = (1 - s R C)/(1 + s R C)."""
    deck = """lattice
V1 p n 0
Rg n 0 1k
R1 p a 1k
C1 a n 1u
C2 p b 1u
R2 b n 1k
.pz p n a b vol pz
"""
    check(deck, "zero", [1e3, -1e3])  # both branches have the same pole: one of the two cancels
    check(deck, "pole", [-1e3, -1e3])


def test_poles_at_infinity_are_none() -> None:
    """A capacitor across a source, and a loop of capacitors: two of four are states."""
    deck = """loops
V1 in 0 AC 1
C0 in 0 1u
R1 in a 1k
C1 a 0 1u
C2 a b 1u
C3 b 0 1u
R2 b 0 1k
.pz in 0 b 0 vol pol
"""
    c = 1e-6
    check(deck, "pole", quadratic(3.0 * c * c * 1e6, 4.0 * c * 1e3, 1.0))


@pytest.mark.parametrize(("bias", "pole"), [(1.0, 2e3), (-1.0, 1e3)])
def test_ideal_elements_keep_their_state(bias: float, pole: float) -> None:
    """1 kOhm and a diode with 1 kOhm in series, parallel to 1 uF: it conducts or blocks."""
    deck = f"mode\nI1 0 a {bias}m\nR1 a 0 1k\nC1 a 0 1u\nD1 a b\nR2 b 0 1k\n.pz a 0 a 0 cur pol\n"
    check(deck, "pole", [-pole])


def test_junctions_are_linearised() -> None:
    """A diode with 1 mA: conductance I/(N Vt), the capacitor is outside."""
    thermal = 1.380649e-23 / 1.602176634e-19 * 300.15
    deck = "junction\nI1 0 a 1m\nD1 a 0 dm\nC1 a 0 1n\n.model dm D(IS=1e-14)\n.pz a 0 a 0 cur pol\n"
    check(deck, "pole", [-1e-3 / thermal / 1e-9], 1e-9)  # the operating point is iterated


#: decks of ngspice's tests/polezero, poles and zeros as its repository lists them (7 digits)
PUBLISHED = {
    "Bridge-T filter": (
        "V1 1 0 12 AC 1\nC1 1 2 1U\nC2 2 3 1U\nR3 2 0 1K\nR4 1 3 1K\n.PZ 1 0 3 0 VOL PZ\n",
        [-2.618034e3, -3.819660e2],
        [-1e3, -1e3],
    ),
    "Multistage filter": (
        "v1 1 0 0 ac 1.0\nr1 1 2 1k\nc1 2 0 10p\ne2 3 0 2 0 10\nr2 3 4 1k\nc2 4 0 1.25p\n"
        "e3 5 0 4 0 10\nr3 5 6 1k\nc3 6 0 .02p\n.pz 1 0 6 0 vol pz\n",
        [-5e10, -8e8, -1e8],
        [],
    ),
    "test pz": (
        "iin 1 0 ac\nr1 1 0 1Ohms\nl1 1 0 0.05H\ngm2 2 0 1 0 1\nr2 2 0 1Ohms\nl2 2 0 0.05H\n"
        "gm3 3 0 2 0 1\nr3 3 0 1Ohms\nl3 3 0 0.05H\n.pz 1 0 3 0 cur pol\n",
        [-20.0, -20.0, -20.0],
        [],
    ),
    "high pass filter": (
        "r1 1 0 1k\nr2 2 0 1k\nc1 1 2 1.0e-12\n.pz 1 0 2 0 cur pz\n",
        [-5e8],
        [0.0],
    ),
}


@pytest.mark.parametrize("title", PUBLISHED)
def test_published_by_ngspice(title: str) -> None:
    lines, poles, zeros = PUBLISHED[title]
    check(f"{title}\n{lines}", "pole", list(map(complex, poles)), 5e-7)
    check(f"{title}\n{lines}", "zero", list(map(complex, zeros)), 5e-7)


def test_high_index_and_multiple_roots() -> None:
    """s^3 = 0 in a companion form, hidden behind a chain of differentiators of index 4."""
    A, B = np.eye(7), np.zeros((7, 7))
    A[:3, :3] = [[0, -1, 0], [0, 0, -1], [0, 0, 0]]
    B[:3, :3] = np.eye(3)
    for k in (3, 4, 5):
        B[k, k + 1] = 1e-3
    rng = np.random.default_rng(1)
    left, right = (np.linalg.qr(rng.normal(size=(7, 7)))[0] for _ in range(2))
    result = roots(left @ A @ right, left @ B @ right)
    assert result.values.size == 3
    assert np.abs(result.values).max() <= 1e-14 ** (1.0 / 3.0)
    assert not result.clean().any()
    with pytest.raises(SingularPencil):
        roots(np.ones((2, 2)), np.ones((2, 2)))


@pytest.mark.parametrize(
    ("card", "message"),
    [
        (".pz in 0 out 0 cur pz", "v1 holds the voltage at the input"),
        (".pz in 0 x 0 vol pz", "v(x) does not depend on v(in)"),
        (".pz in 0 out 0 vol all", "all is unknown"),
        (".pz in 0 out out vol pz", "both nodes of a port are the same"),
        (".pz in 0 nowhere 0 vol pz", "there is no node nowhere"),
        (".pz in 0 vol pz", "needs two ports"),
    ],
)
def test_what_cannot_be_found_is_refused(card: str, message: str) -> None:
    deck = f"low-pass\nV1 in 0 1\nR1 in out 1k\nC1 out 0 1u\nR2 x 0 1k\nI1 0 x 1m\n{card}\n"
    with pytest.raises(NsspiceError, match=message.replace("(", r"\(").replace(")", r"\)")):
        nsspice.read(deck).run()


def test_an_undetermined_determinant_is_named() -> None:
    deck = "part that floats\nV1 in 0 1\nE1 out 0 in 0 0\nR1 out 0 1k\n.pz in 0 out 0 vol zer\n"
    with pytest.raises(UsageError, match="NS4034"):
        nsspice.read(deck).run()


def test_files(tmp_path: Path) -> None:
    """A CSV has real and imaginary parts, a raw file complex variables."""
    (solution,) = nsspice.read("a\nR1 a 0 1k\nC1 a 0 1u\n.pz a 0 a 0 cur pz\n").run()
    path = tmp_path / "a.raw"
    write_raw(solution, path)
    head = path.read_bytes().partition(b"Binary:")[0].decode()
    assert "Plotname: Pole-Zero Analysis" in head
    assert "Flags: complex" in head
    assert "\t0\tpole(1)\tnotype" in head
    solution.to_csv(path.with_suffix(".csv"))
    assert path.with_suffix(".csv").read_text("utf-8") == "re(pole(1)),im(pole(1))\n-1000,0\n"
