"""Periodic steady states of circuits with smooth elements, found by steps with error control."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import jv

import nsspice

#: of a run by default; orbits are found by steps a thousandth as wrong
RELTOL = 1e-5

VAN_DER_POL = """Van der Pol's oscillator
L1 a 0 1
C1 a 0 1 IC=0.5
B1 a 0 I={V(a)**3/3 - V(a)}
.pss trigger=v(a)
"""

JUNCTION = ".model DJ D(IS=1e-9 N=1.1 RS=20m CJO=200p)\n.model SH SW(VT=0.5 RON=10m)\n"

BUCK = (
    """Buck converter with a junction diode
Vin in 0 24
S1 in sw g 0 SH
D1 0 sw DJ
L1 sw out 100u
C1 out 0 2u
R1 out 0 5
Vg g 0 PULSE(0 1 0 50n 50n 5u 10u)
"""
    + JUNCTION
)

BOOST = (
    """Boost converter with a junction diode
Vin in 0 12
L1 in sw 100u
S1 sw 0 g 0 SH
D1 sw out DJ
C1 out 0 2u
R1 out 0 8
Vg g 0 PULSE(0 1 0 50n 50n 5u 10u)
"""
    + JUNCTION
)

SYNCHRONOUS = """Synchronous buck converter of MOSFETs with their body diodes
Vin in 0 12
M1 in g1 sw sw MN
M2 sw g2 0 0 MN
Vg1 g1 sw PULSE(0 10 0.1u 50n 50n 3.9u 10u)
Vg2 g2 0 PULSE(10 0 0 50n 50n 4.1u 10u)
L1 sw out 47u
C1 out 0 2u
R1 out 0 2
.model MN NMOS(LEVEL=1 VTO=2 KP=20 RD=5m CBD=200p IS=1e-12)
"""

RECTIFIER = """Rectifier
V1 a 0 SIN(0 10 50)
D1 a b DJ
C1 b 0 100u
R1 b 0 200
.model DJ D(IS=1e-9 N=1.5 RS=0.1 CJO=20p)
"""

DISCONTINUOUS = (
    """Buck converter whose junction rings with the inductor when its current has ended
Vin in 0 24
S1 in sw g 0 SH
D1 0 sw DJ
L1 sw out 10u
C1 out 0 2u
R1 out 0 50
Vg g 0 PULSE(0 1 0 10n 10n 3u 10u)
"""
    + JUNCTION
)

COLPITTS = """Colpitts oscillator
Vcc vcc 0 9
L1 vcc c 10u
R1 vcc c 2k
C1 c e 1n IC=0
C2 e 0 4n IC=0
RE e 0 1k
Q1 c b e QN
VB b 0 1.5
.model QN NPN(IS=1e-15 BF=100 CJC=1p CJE=1p TF=0.1n)
"""


def test_the_oscillator_of_van_der_pol() -> None:
    """Its period is known to all digits; its multiplier is that of the divergence on the cycle."""
    sol = nsspice.pss(nsspice.read(VAN_DER_POL))
    period = 6.66328685932313  # of x'' - (1 - x^2) x' + x = 0
    assert abs(sol.periodic.period - period) < 1e-3 * RELTOL * period
    assert abs(sol["v(a)"][0]) < RELTOL * 2.0

    def field(_: float, x: np.ndarray) -> list[float]:
        return [x[0] - x[0] ** 3 / 3.0 - x[1], x[0], 1.0 - x[0] ** 2]

    start = [0.0, float(sol["i(l1)"][0]), 0.0]
    end = solve_ivp(field, (0.0, period), start, rtol=1e-10, atol=1e-12).y[:, -1]
    assert np.allclose(end[:2], start[:2], atol=RELTOL)
    assert sol.periodic.verdict == "stable"
    (multiplier,) = sol.periodic.multipliers
    assert abs(multiplier - np.exp(end[2])) < sol.periodic.tolerance


def test_what_an_sffm_source_does_to_rc() -> None:
    """Bessel's series; the multiplier of the linear circuit is exp(-T/RC)."""
    R, C, carrier, signal, index = 1e3, 100e-9, 10e3, 1e3, 2.0
    sol = nsspice.pss(
        nsspice.read(
            f"""modulated
V1 a 0 SFFM(1 2 {carrier} {index} {signal})
R1 a b {R}
C1 b 0 {C}
"""
        ),
        1.0 / signal,
    )
    t, expected = sol.time, np.ones(sol.time.size)
    for n in range(-30, 31):
        w = 2.0 * np.pi * (carrier + n * signal)
        expected += 2.0 * jv(n, index) * np.imag(np.exp(1j * w * t) / (1.0 + 1j * w * R * C))
    # some hundred steps, each as wrong as a thousandth of the tolerance
    assert np.abs(sol["v(b)"] - expected).max() < 0.1 * RELTOL * 3.0
    assert sol.periodic.multipliers == ()
    slow = nsspice.pss(nsspice.read(f"""modulated
V1 a 0 SFFM(1 2 {carrier} {index} {signal})
R1 a b {R}
C1 b 0 1u
"""), 1.0 / signal)  # fmt: skip
    assert abs(slow.periodic.multipliers[0] - np.exp(-1.0)) < slow.periodic.tolerance
    assert slow.periodic.steps <= 2  # the map is affine


@pytest.mark.parametrize(
    ("text", "period", "periods", "signals", "steps"),
    [
        (BUCK, 10e-6, 60, ("v(out)", "i(l1)"), 3),
        (BOOST, 10e-6, 60, ("v(out)", "i(l1)"), 4),
        (SYNCHRONOUS, 10e-6, 30, ("v(out)", "i(l1)"), 3),
        (RECTIFIER, 20e-3, 25, ("v(b)", "i(v1)"), 3),
        pytest.param(DISCONTINUOUS, 10e-6, 40, ("v(out)",), 8, marks=pytest.mark.soak),
    ],
)
def test_converters_against_many_periods(
    text: str, period: float, periods: int, signals: tuple[str, ...], steps: int
) -> None:
    """The slowest multiplier is below 0.87: so many periods leave less than the tolerance."""
    sol = nsspice.pss(nsspice.read(text + ".pss"), row_step=period / 20, signals=signals)
    assert sol.periodic.steps <= steps
    assert sol.periodic.verdict == "stable"
    assert max((abs(m) for m in sol.periodic.multipliers), default=0.0) ** (periods - 1) < 1e-6
    run = nsspice.tran(
        nsspice.read(text), periods * period, period / 20, start=(periods - 1) * period,
        uic=True, reltol=1e-7, signals=signals,
    )  # fmt: skip
    for name in signals:
        size = np.abs(run[name]).max()
        assert np.abs(sol[name] - run[name]).max() < 2.0 * RELTOL * size, name
        assert abs(sol[name][0] - sol[name][-1]) < 0.1 * RELTOL * size, name


def test_a_transistor_oscillates() -> None:
    circuit = nsspice.read(
        COLPITTS + ".pss trigger=v(c) level=9 tstab=10u\n.measure pss top MAX v(c)"
    )
    (sol,) = circuit.run()
    assert sol.periodic.verdict == "stable"
    # the orbit's multipliers are 0.75: after 60 periods the run from rest is there
    stop = 60.0 * sol.periodic.period
    run = nsspice.tran(
        circuit, stop + sol.periodic.period, sol.periodic.period / 100, start=stop, uic=True,
        reltol=1e-6, signals=["v(c)"],
    )  # fmt: skip
    assert abs(sol.measures["top"] - run["v(c)"].max()) < 1e-3 * 13.8  # a row may miss the top
    rising = np.flatnonzero((run["v(c)"][:-1] < 9.0) & (run["v(c)"][1:] >= 9.0))
    assert rising.size == 1
    # from the crossing on, the run is the orbit
    part = np.interp(
        9.0, run["v(c)"][rising[0] : rising[0] + 2], run.time[rising[0] : rising[0] + 2]
    )
    later = np.interp(run.time[rising[0] + 1 :] - part, sol.time, sol["v(c)"])
    assert np.abs(later - run["v(c)"][rising[0] + 1 :]).max() < 2e-3 * 13.8


def test_a_transient_begins_there() -> None:
    (sol,) = nsspice.read(BUCK + ".tran 1u 10u start=pss\n.options reltol=1e-7").run()
    for name in ("v(out)", "i(l1)"):
        assert abs(sol[name][-1] - sol[name][0]) < RELTOL * np.abs(sol[name]).max()


def test_what_drifts_and_what_is_free() -> None:
    pulse = "I1 0 c PULSE(0 1m 0 0 0 1m 20m)\nC1 c 0 1u\n"
    beside = "R1 c a 1k\nC2 a b 1n\nD1 b 0 DS\n.model DS D(IS=1e-14 N=2 CJO=1p)\n.pss\n"
    with pytest.raises(nsspice.NumericalError) as caught:
        nsspice.read("drift\n" + pulse + beside).run()
    assert caught.value.diagnostics[0].code == "NS3062"
    assert "c1" in caught.value.diagnostics[0].message
    (sol,) = nsspice.read("""a node between capacitors keeps its charge
V1 a 0 SIN(0 1 1k)
C1 a b 1u
C2 b 0 1u
B1 a 0 I={1m*V(a)**3}
.pss
""").run()
    assert [w.code for w in sol.warnings] == ["NS3061"]
    assert sol.periodic.verdict == "neutral"


def test_its_spectrum_is_that_of_its_rows() -> None:
    (sol,) = nsspice.read(BUCK + ".pss\n.four 100k v(out)").run()
    (spectrum,) = sol.spectra
    mean = np.mean(sol["v(out)"][:-1])
    # kinks of the ripple leave sums over rows to their second order
    assert spectrum.coefficients[0].real == pytest.approx(mean, rel=1e-4)
    assert spectrum.rms == pytest.approx(sol.rms("v(out)"), rel=1e-12)
