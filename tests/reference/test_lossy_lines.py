"""Transmission lines with losses against hyperbolic functions and numerical Laplace inversion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import nsspice
from nsspice.errors import NetlistError
from nsspice.netlist.code_models.lossy_lines import closed_forms, fitted

#: of a metre, and the length
R, L, C, LENGTH = 12.45, 8.972e-9, 0.468e-12, 16.0
CARD = f".model line ltra(r={R} g=0 l={L} c={C} len={LENGTH})\n"
IMPEDANCE, DELAY = np.sqrt(L / C), LENGTH * np.sqrt(L * C)


@pytest.mark.parametrize("loss", [0.01, 1.45, 8.0])
def test_fits_where_they_were_not_made(loss: float) -> None:
    """Both are analytic: what is true on the imaginary axis is true on the real one, too."""
    fit = fitted(loss)
    assert fit.error < 1e-4
    p = np.geomspace(1e-4, 1e5, 300).astype(complex)
    y, w = closed_forms(loss, p)
    basis = fit.poles / (p[:, np.newaxis] + fit.poles)
    assert np.abs(1.0 + basis @ fit.of_y - y).max() < fit.error
    # for large p the closed form is a difference of large numbers
    assert np.abs(fit.limit + basis @ fit.of_w - w)[p.real < 1e3].max() < fit.error


def test_frequencies_and_resistance() -> None:
    """Two-port of cosh and sinh between 50 Ohm and 1 kOhm; at DC it is its resistance."""
    circuit = nsspice.read(
        f"l\nV1 a 0 1 AC 1\nR1 a b 50\nO1 b 0 c 0 line\n{CARD}Y1 c 0 d 0 short\n"
        ".model short txl(r=0 g=0 l=9n c=3p length=2)\nR2 d 0 1k\n"
    )
    # a leakage of about 1e-7/Z0 is left
    expected = 1e3 / (1050.0 + R * LENGTH)
    assert nsspice.op(circuit)["v(d)"][0] == pytest.approx(expected, rel=1e-6)
    f = np.geomspace(1e5, 1e10, 41)
    found = nsspice.ac(circuit, f)
    s = 2j * np.pi * f

    def two_port(r: float, ind: float, c: float, length: float) -> list[np.ndarray]:
        gamma, z = np.sqrt((r + s * ind) * s * c) * length, np.sqrt((r + s * ind) / (s * c))
        return [np.cosh(gamma), z * np.sinh(gamma), np.sinh(gamma) / z, np.cosh(gamma)]

    a, b, c, d = two_port(R, L, C, LENGTH)
    e, g, h, i = two_port(0.0, 9e-9, 3e-12, 2.0)
    v, current = e + g / 1e3, h + i / 1e3  # at the input of the short line for 1 V at its end
    v, current = a * v + b * current, c * v + d * current
    assert np.abs(found["v(d)"] - 1.0 / (v + 50.0 * current)).max() < 5e-4  # a few times the fit's


def talbot(image: Callable[[np.ndarray], np.ndarray], t: float) -> float:
    """Return the value at a time of what has an image, by the trapezoidal rule on a contour.

    Weideman and Trefethen, Math. Comp. 76 (2007) 1341: cotangent contour, 24 points, 1e-12.
    """
    n = 24
    theta = np.pi * np.arange(-n + 1, n, 2) / n
    z = n * (0.5017 * theta / np.tan(0.6407 * theta) - 0.6122 + 0.2645j * theta)
    slope = 0.5017 / np.tan(0.6407 * theta)
    slope = slope - 0.5017 * 0.6407 * theta / np.sin(0.6407 * theta) ** 2 + 0.2645j
    return float((np.exp(z) * image(z / t) * slope).sum().imag / t)


def test_a_step_arrives() -> None:
    """Until the first echo the far end is one passage, inverted numerically (Talbot)."""
    found = nsspice.tran(
        nsspice.read(
            f"l\nV1 a 0 PWL(0 0 0.01n 0 0.01n 1)\nR1 a b 50\nO1 b 0 c 0 line\n{CARD}R2 c 0 400\n"
            ".tran 0.1n 3n uic"
        )
    )
    rate = R / L

    def passage(s: np.ndarray) -> np.ndarray:
        z = IMPEDANCE * np.sqrt((s + rate) / s)
        loss = np.exp(-DELAY * (np.sqrt(s) * np.sqrt(s + rate) - s))
        return z / (z + 50) * loss * 800 / (400 + z) / s

    since = found.time - 0.01e-9 - DELAY
    inside = (since > 1e-12) & (since < 2.0 * DELAY - 1e-12)
    expected = [talbot(passage, t) for t in since[inside]]
    assert inside.sum() > 15
    assert np.abs(found["v(c)"][inside] - expected).max() < 5e-4  # as above
    assert np.abs(found["v(c)"][since < -1e-12]).max() < 1e-12  # nothing is there before


def test_a_line_of_resistance_and_capacitance() -> None:
    """An open one charges as the classical series says; URC is the same line."""
    found = nsspice.tran(
        nsspice.read(
            "l\nV1 a 0 PWL(0 0 1n 0 1n 1)\nO1 a 0 b 0 rc\n.model rc ltra(r=100 c=1p len=4)\n"
            "U1 a c 0 uni l=4\n.model uni urc(rperl=100 cperl=1p)\n.tran 0.1n 4n uic"
        )
    )
    t = (found.time - 1e-9) / (400.0 * 4e-12)
    late = t > 0.02  # a fiftieth of the time constant later all but the last modes have gone
    n = np.arange(60)[:, np.newaxis]
    decays = np.exp(-(((n + 0.5) * np.pi) ** 2) * t[late])
    series = 1.0 - (2.0 / np.pi * (-1.0) ** n / (n + 0.5) * decays).sum(axis=0)
    for node in "bc":
        assert np.abs(found[f"v({node})"][late] - series).max() < 2e-3


def test_leaking_lines_and_what_is_refused() -> None:
    found = nsspice.op(
        nsspice.read("l\nV1 a 0 1\nO1 a 0 b 0 rg\n.model rg ltra(r=100 g=1m len=4)\nR1 b 0 1k\n")
    )
    angle, z = np.sqrt(400.0 * 4e-3), np.sqrt(400.0 / 4e-3)
    expected = 1.0 / (np.cosh(angle) + z * np.sinh(angle) / 1e3)
    assert found["v(b)"][0] == pytest.approx(expected, rel=1e-12)
    for card, message in (
        ("ltra(r=1 g=1 l=1n c=1p len=1)", "no others"),
        ("ltra(r=1 l=1n c=1p)", "needs a length"),
        ("gain(gain=1)", "is of type gain"),
    ):
        with pytest.raises(NetlistError, match=message):
            nsspice.read(f"l\nV1 a 0 1\nO1 a 0 b 0 m\nR1 b 0 1\n.model m {card}\n.model n {card}")
