"""Coupled transmission lines against even and odd modes, and against matrix functions."""

from __future__ import annotations

import numpy as np
import pytest

import nsspice
from nsspice.errors import NetlistError

CARD = (
    ".model pair cpl\n+ R = 2 0\n+     2\n+ L = 250n 50n\n+     250n\n+ C = 100p -20p\n+     100p\n"
    "+ G = 0 0 0\n+ length = 0.5\n"
)


def test_two_lines_at_frequencies() -> None:
    """Even and odd mode: R, L + M, C - Cm and R, L - M, C + Cm, each a line of its own."""
    f = np.geomspace(1e5, 3e9, 31)
    found = nsspice.ac(
        nsspice.read(
            "c\nV1 a 0 1 AC 1\nR1 a 1 50\nR2 2 0 50\nP1 1 2 0 3 4 0 pair\nR3 3 0 80\nR4 4 0 80\n"
            + CARD
        ),
        f,
    )
    s = 2j * np.pi * f
    half = []
    for ind, c in ((300e-9, 80e-12), (200e-9, 120e-12)):
        gamma, z = 0.5 * np.sqrt((2 + s * ind) * s * c), np.sqrt((2 + s * ind) / (s * c))
        v = np.cosh(gamma) + z * np.sinh(gamma) / 80.0
        current = np.sinh(gamma) / z + np.cosh(gamma) / 80.0
        half.append(0.5 / (v + 50.0 * current))
    even, odd = half
    # a few times the error of the fits, 1e-4
    assert np.abs(found["v(3)"] - (even + odd)).max() < 5e-4
    assert np.abs(found["v(4)"] - (even - odd)).max() < 5e-4


def test_three_lines_without_loss_step() -> None:
    """Unequal lines: the first step at the far end, of each mode at its own delay.

    The modes are eigenvectors of L C, found here from the unsymmetric product.
    """
    ind = 1e-9 * np.array([[300, 60, 20], [60, 280, 50], [20, 50, 310]])
    c = 1e-12 * np.array([[100, -20, -5], [-20, 120, -15], [-5, -15, 90]])
    deck = (
        "c\nV1 a 0 PWL(0 0 1p 0 1p 1)\nR1 a 1 50\nR2 2 0 50\nR3 3 0 50\nP1 1 2 3 0 4 5 6 0 trio\n"
        "R4 4 0 70\nR5 5 0 70\nR6 6 0 70\n.model trio cpl L=300n 60n 20n 280n 50n 310n "
        "C=100p -20p -5p 120p -15p 90p length=1\n.tran 50p 9.5n uic\n"
    )
    found = nsspice.tran(nsspice.read(deck))
    squares, t = np.linalg.eig(ind @ c)
    delays = np.sqrt(squares)
    z = t @ np.diag(delays) @ np.linalg.inv(t) @ np.linalg.inv(c)  # sqrt(L C) C^-1
    start = z @ np.linalg.solve(z + 50.0 * np.eye(3), np.array([1.0, 0.0, 0.0]))
    through = 2.0 * 70.0 * np.linalg.inv(z + 70.0 * np.eye(3))
    waves = np.linalg.solve(t, start)
    since = found.time - 1e-12
    parts = [np.outer(through @ t[:, k] * waves[k], since > delays[k]) for k in range(3)]
    first = since < 2.9 * delays.min()
    near = np.min(np.abs(since[:, np.newaxis] - delays), axis=1) < 1e-12
    for j, node in enumerate("456"):
        own = found[f"v({node})"][first & ~near]
        assert own == pytest.approx(sum(parts)[j][first & ~near], abs=1e-9), node


@pytest.mark.parametrize(
    ("card", "message"),
    [
        ("L=1n 0 C=1p 0 1p length=1", "L has 2 numbers|is not a parameter"),
        ("L=1n 2n 1n C=1p 0 1p length=1", "positive definite"),
        ("L=1n 0 1n C=1p 0 1p G=1 0 1 length=1", "no conductance"),
    ],
)
def test_what_is_refused(card: str, message: str) -> None:
    lines = "V1 1 0 1\nP1 1 2 0 3 4 0 m\nR2 2 0 1\nR3 3 0 1\nR4 4 0 1\n"
    with pytest.raises(NetlistError, match=message):
        nsspice.read(f"t\n{lines}.model m cpl {card}\n")
