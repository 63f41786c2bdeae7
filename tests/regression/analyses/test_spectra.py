"""Fourier coefficients, distortion and averages against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import jv

import nsspice


def coefficients(text: str, signal: str, orders: list[int]) -> np.ndarray:
    sol = nsspice.pss(nsspice.read(text))
    return sol.integrals.coefficients([signal], orders)[signal]


def test_a_trapezoid() -> None:
    """Of ramps: c_n = sum over corners of the jumps of the slope, e^(-i n w t) / ((i n w)^2 T)."""
    text = "trapezoid\nV1 a 0 PULSE(-1 2 0 1u 2u 3u 10u)\nR1 a 0 1\n.pss\n"
    orders = [0, 1, 2, 3, 7, 40, 1001]
    found = coefficients(text, "v(a)", orders)
    T, w = 10e-6, 2 * np.pi / 10e-6
    corners, slopes = [0.0, 1e-6, 4e-6, 6e-6], [3e6, 0.0, -1.5e6, 0.0]
    jumps = np.array(slopes) - np.roll(slopes, 1)
    mean = (0.5 * 1 + 2 * 3 + 0.5 * 2 - 4) / 10
    assert abs(found[0] - mean) < 1e-15
    for n, c in zip(orders[1:], found[1:], strict=True):
        s = 1j * n * w
        exact = (jumps * np.exp(-s * np.array(corners))).sum() / (s * s * T)
        assert abs(c - exact) < 1e-12 * 3.0


def test_natural_sampling_is_a_series_of_bessel_functions() -> None:
    """Double-edge modulation with a triangle: harmonics at m fc + n f0 (W. R. Bennett, 1933)."""
    M, ratio = 0.8, 21
    text = f"""class D
.param f0=1k fc={{f0*{ratio}}} t={{1/fc}}
Vp p 0 1
Vn n 0 -1
Vm m 0 SIN(0 {M} {{f0}} 0 0 90)
Vc c 0 PULSE(-1 1 {{-t/2}} {{t/2}} {{t/2}} 0 {{t}})
S1 p a m c SH
S2 n a c m SH
R1 a 0 1k
.model SH SW(VT=0)
.pss
.four 1k v(a)
.measure pss distortion thd v(a)
.measure pss first harm1 v(a)
"""
    (sol,) = nsspice.read(text).run()
    orders = [0, 1, 2, ratio, ratio - 2, ratio + 2, 2 * ratio - 1, 2 * ratio + 3]
    found = sol.integrals.coefficients(["v(a)"], orders)["v(a)"]

    def bennett(k: int) -> complex:
        """Sum of 1/2 of the amplitudes of cos(m y + n x) over all m ratio + n = k or -k."""
        total = 0.5 * M if k == 1 else 0.0
        for m in range(1, 60):  # beyond, Bessel functions of order m ratio at m pi M/2 vanish
            for n in (k - m * ratio, -k - m * ratio) if k else (-m * ratio,) * 2:
                size = 4.0 / (np.pi * m) * jv(n, m * np.pi * M / 2) * np.sin((m + n) * np.pi / 2)
                total += 0.5 * (-1) ** m * size  # the triangle has its minimum at t = 0
        return total

    exact = np.array([bennett(k) for k in orders])
    # sin((m + n) pi/2) is exact to n u only
    assert np.abs(found - exact).max() < 1e-12
    assert abs(sol.measures["first"] - M) < 1e-12
    # a square wave of 1 V: all that is not the first harmonic
    thd = np.sqrt((1 - M * M / 2) / (M * M / 2))
    assert abs(sol.measures["distortion"] - thd) < 1e-12
    (spectrum,) = sol.spectra
    assert abs(spectrum.rms - 1.0) < 1e-14
    assert abs(spectrum.distortion - thd) < 1e-12
    assert spectrum.frequency == pytest.approx(1e3, rel=1e-15)


def test_the_distortion_of_a_class_d_amplifier() -> None:
    """Bennett's series through the output filter; the first harmonic passes, sidebands remain."""
    M, ratio, V, L, C, R, f0 = 0.9, 33, 30.0, 47e-6, 2.2e-6, 8.0, 3e3
    text = f"""class-D amplifier
.param f0={f0} fc={{f0*{ratio}}} t={{1/fc}}
Vp p 0 {V}
Vn n 0 {-V}
Vm m 0 SIN(0 {M} {{f0}} 0 0 90)
Vc c 0 PULSE(-1 1 {{-t/2}} {{t/2}} {{t/2}} 0 {{t}})
S1 p a m c SH
S2 n a c m SH
L1 a out {L}
C1 out 0 {C}
R1 out 0 {R}
.model SH SW(VT=0)
.pss
.four {f0} v(out)
.measure pss distortion thd v(out)
"""
    (sol,) = nsspice.read(text).run()
    assert sol.periodic.steps <= 8

    def transfer(k: int) -> complex:
        s = 2j * np.pi * k * f0
        return 1.0 / (1.0 + s * L / R + s * s * L * C)

    last = 12 * ratio  # beyond, the filter leaves less than 1e-4 of the sidebands' 1e-2
    lines = np.zeros(last + 1)
    lines[1] = M
    for m in range(1, 80):
        for n in range(-last - m * ratio, last + 1 - m * ratio):
            size = 4.0 / (np.pi * m) * jv(n, m * np.pi * M / 2) * np.sin((m + n) * np.pi / 2)
            lines[abs(m * ratio + n)] += (-1) ** m * size
    passed = np.array([abs(transfer(k)) for k in range(last + 1)])
    output = V * lines * passed
    found = sol.integrals.coefficients(["v(out)"], list(range(last + 1)))["v(out)"]
    assert np.abs(2.0 * np.abs(found[1:]) - np.abs(output[1:])).max() < 1e-12 * V
    # what the square wave has beyond the last line, in sum the rest of 1, passes by less than there
    rest = 1.0 - 0.5 * (lines[1:] ** 2).sum()
    assert 0.0 < rest < 0.1
    thd = np.sqrt((output[2:] ** 2).sum()) / abs(output[1])
    beyond = np.sqrt(2.0 * rest) * passed[-1] * V / abs(output[1])
    assert 0.01 < thd < 0.1
    assert -1e-12 < sol.measures["distortion"] - thd < beyond**2 / thd
    assert abs(sol.spectra[0].distortion - sol.measures["distortion"]) < 1e-12


RECTIFIER = """full-wave rectifier
V1 a b SIN(0 10 50)
D1 a p
D2 b p
D3 0 a
D4 0 b
R1 p 0 100
Rb b 0 1meg
.pss
"""


def test_a_rectified_sine() -> None:
    """|sin|: 2 A/pi at 0, and 2 A/(pi (1 - 4 k^2)) at twice k times the line frequency."""
    text = RECTIFIER.replace("Rb b 0 1meg\n", "")
    found = coefficients(text, "v(p)", [0, 1, 2, 4, 6, 60])
    exact = [2 / np.pi * 10 / (1 - k * k) if k % 2 == 0 else 0.0 for k in (0, 1, 2, 4, 6, 60)]
    assert np.abs(found - exact).max() < 1e-12 * 10.0


def test_the_last_periods_of_a_transient() -> None:
    """A charging capacitor is no periodic signal: the coefficients of its window in closed form."""
    text = """charging
V1 a 0 1
R1 a b 1k
C1 b 0 1u
.tran 10u 5m uic
.four 1k v(b) harms=3 periods=2
.measure tran h harm2 v(b) from=3m to=5m
"""
    (sol,) = nsspice.read(text).run()
    (spectrum,) = sol.spectra
    T, tau, start = 2e-3, 1e-3, 3e-3
    for k, c in enumerate(spectrum.coefficients):
        s = 2j * np.pi * 2 * k / T + 1.0 / tau
        exact = (1.0 if k == 0 else 0.0) - np.exp(-start / tau) * (1 - np.exp(-s * T)) / (s * T)
        assert abs(c - exact) < 1e-14
    assert abs(sol.measures["h"] - 2 * abs(spectrum.coefficients[1])) < 1e-15


def test_a_transient_in_steady_state_has_the_spectrum_of_the_orbit() -> None:
    deck = """buck
V1 in 0 24
S1 in sw g 0 SH
D1 0 sw
L1 sw out 20u
R0 out 0 2
C1 out 0 10u
Vg g 0 PULSE(-1 1 0 0 0 4u 10u)
.model SH SW(VT=0)
"""
    orbit = nsspice.pss(nsspice.read(deck)).integrals.coefficients(["i(l1)"], [0, 1, 5])["i(l1)"]
    (run,) = nsspice.read(deck + ".tran 1u 2m uic\n.four 100k i(L1) harms=5\n").run()
    found = np.array(run.spectra[0].coefficients)[[0, 1, 5]]
    # multipliers of 0.75: nothing is left after 200 periods but the rounding of 2 ms
    assert np.abs(found - orbit).max() < 1e-11 * abs(orbit[0])


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ([".tran 1u 1m", ".four v(a)"], "needs the frequency"),
        ([".tran 1u 1m", ".four 10 v(a)"], "longer than the run"),
        ([".pss", ".four 1.5k v(a)"], "not a multiple"),
    ],
)
def test_what_has_no_spectrum_is_told(lines: list[str], words: str) -> None:
    text = "\n".join(["t", "V1 a 0 SIN(0 1 1k)", "R1 a b 1k", "C1 b 0 1n", *lines])
    (sol,) = nsspice.read(text).run()
    (warning,) = [w for w in sol.warnings if w.code == "NS5003"]
    assert words in warning.message
    assert not sol.spectra


def test_averages_and_powers() -> None:
    """A divider of a sine: mean squares and powers of all elements, and their balance."""
    text = "divider\nV1 a 0 SIN(1 2 50)\nR1 a b 3\nL1 b c 5m\nR2 c 0 1\n.pss\n"
    sol = nsspice.pss(nsspice.read(text))
    w = 2 * np.pi * 50
    amplitude = 2.0 / abs(4.0 + 1j * w * 5e-3)
    square = (1.0 / 4.0) ** 2 + amplitude**2 / 2
    integrals = sol.integrals
    assert abs(integrals.rms("i(r1)") - np.sqrt(square)) < 1e-14
    assert abs(integrals.mean("i(r1)") - 0.25) < 1e-15
    found = integrals.powers(["v1", "r1", "l1", "r2"])
    assert np.abs(np.array(found) - [-4 * square, 3 * square, 0.0, square]).max() < 1e-14
    assert abs(integrals.mean("p(r2)") - square) < 1e-14
