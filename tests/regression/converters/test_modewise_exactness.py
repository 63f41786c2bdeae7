"""The mode-wise engine against closed forms and the exact values beside the netlists."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from decks.chattering import MODULATOR, late_but_sound
from decks.ideal_transformer import IDEAL_TRANSFORMER

import nsspice
from nsspice.errors import UsageError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

NETS = Path(__file__).parents[3] / "netlists"

#: decks whose expected values were computed exactly, mode by mode or in closed form
EXACT = [
    "converters/buck", "converters/boost", "converters/buck_boost", "converters/flyback",
    "converters/lc_bridge_charger", "converters/charge_pump", "rectifiers/half_wave_capacitor",
    "rectifiers/full_bridge_capacitor", "rectifiers/voltage_doubler",
    "rectifiers/half_wave_inductive", "rectifiers/cockcroft_walton_4", "rectifiers/clamp",
    "thesis/ex424_bridge_oscillator",
]  # fmt: skip
#: of the largest value of the signal; rounding over a thousand segments is 1e-13
TOLERANCE = 1e-10


def run(text: str, stop: float, rows: int = 50, uic: bool = True):
    sol = nsspice.tran(
        nsspice.read(text), stop=stop, row_step=stop / rows, uic=uic, method="modewise"
    )
    assert sol.islands[0].method == "modewise"
    assert sol.certificate.passed or late_but_sound(sol.certificate)
    return sol


@pytest.mark.parametrize("name", EXACT)
def test_values_of_the_netlists(name):
    expect = tomllib.loads((NETS / f"{name}.expect.toml").read_text(encoding="utf-8"))
    sol = nsspice.tran(nsspice.read(NETS / f"{name}.net"), method="modewise")
    compared = 0
    for check in expect["check"]:
        if "at" not in check or check.get("signal") not in sol:
            continue
        row = int(np.argmin(np.abs(sol.time - check["at"])))
        if abs(sol.time[row] - check["at"]) < 1e-12:
            wave = sol[check["signal"]]
            scale = max(np.abs(wave).max(), 1e-9)
            assert abs(wave[row] - check["value"]) <= TOLERANCE * scale, check
            compared += 1
    assert compared
    assert sol.stats["fixed_steps"] == 0


def test_the_bridge_oscillator_is_exact_to_rounding():
    """Linear in effect: i' = v/L, C v' = -i - v/R; 5 ms at 10 V to 1e-12 V."""
    text = (
        "osc\nC0 n1 0 1u IC=10\nL1 n1 0 10m IC=0\nD1 n1 p D\nD2 0 p D\nD3 n 0 D\nD4 n n1 D\n"
        "R1 p n 1k\n.model D D(ideal)\n"
    )
    sol = run(text, 5e-3, 500)
    a = 1.0 / (2 * 1e3 * 1e-6)
    w = math.sqrt(1e8 - a * a)
    t = sol.time
    exact = 10.0 * np.exp(-a * t) * (np.cos(w * t) - a / w * np.sin(w * t))
    assert np.abs(sol["v(n1)"] - exact).max() < 1e-12
    assert sol.stats["segments"] == 17


@pytest.mark.parametrize("detuned", [0.0, 1e-12, 1e-8, 1e-4])
def test_critical_damping(detuned):
    """R = 2 sqrt(L/C) (1 + detuned): a double eigenvalue has one eigenvector only."""
    text = f"crit\nV1 a 0 1\nR1 a b {2.0 * (1.0 + detuned)!r}\nL1 b c 1 IC=0\nC1 c 0 1 IC=0\n"
    sol = run(text, 10.0)
    t, z = sol.time, 1.0 + detuned
    if detuned == 0.0:
        exact = 1.0 - (1.0 + t) * np.exp(-t)
    else:
        s = math.sqrt((z - 1.0) * (z + 1.0))
        exact = 1.0 - np.exp(-z * t) * (np.cosh(s * t) + z * np.sinh(s * t) / s)
    # a rate that differs by 1e-4 of itself is given by rounding to 1e-12
    assert np.abs(sol["v(c)"] - exact).max() < (1e-13 if detuned < 1e-8 else 1e-11)


def test_critical_damping_under_waves_and_ramps():
    """x'' + 2 x' + x = u from rest, for a sine near the double rate, one far above, and a ramp."""
    text = "crit\nV1 a 0 {}\nR1 a b 2\nL1 b c 1 IC=0\nC1 c 0 1 IC=0\n"
    for w in (1.0, 50.0):
        sol = run(text.format(f"SIN(0 1 {{{w}/(2*pi)}})"), 10.0)
        t = sol.time
        response = 1.0 / (1.0 + 1j * w) ** 2
        # the free part starts where the driven one does not
        start, slope = -response.imag, -(1j * w * response).imag
        exact = (response * np.exp(1j * w * t)).imag + np.exp(-t) * (start + (start + slope) * t)
        assert np.abs(sol["v(c)"] - exact).max() < 1e-13
    sol = run(text.format("PWL(0 0 10 10)"), 10.0)
    t = sol.time
    assert np.abs(sol["v(c)"] - (t - 2.0 + (2.0 + t) * np.exp(-t))).max() < 1e-13


def test_resonance_and_integrators():
    """sin(t) into an undamped LC of the same frequency, and an inductor at a constant voltage."""
    sol = run("res\nV1 a 0 SIN(0 1 {1/(2*pi)})\nL1 a b 1 IC=0\nC1 b 0 1 IC=0\n", 20.0)
    t = sol.time
    assert np.abs(sol["v(b)"] - 0.5 * (np.sin(t) - t * np.cos(t))).max() < 1e-12
    sol = run("int\nV1 a 0 PWL(0 0 1 1)\nL1 a 0 2 IC=1\n", 3.0)
    t = sol.time
    exact = 1.0 + np.where(t < 1, t * t / 4, 0.25 + (t - 1) / 2)
    assert np.abs(sol["i(l1)"] - exact).max() < 1e-14


def test_exponential_and_damped_sources():
    """x' = u - x with u = exponential rise, and u = e^(-s) sin(2 s) from s = t - 1/2."""
    sol = run("exp\nV1 a 0 EXP(0 2 0.5 0.25 10 1)\nR1 a b 1\nC1 b 0 1 IC=0\n", 4.0)
    s = np.maximum(sol.time - 0.5, 0.0)
    exact = 2.0 * (1.0 - np.exp(-s)) - 2.0 * (np.exp(-s) - np.exp(-4.0 * s)) / 3.0
    assert np.abs(sol["v(b)"] - exact).max() < 1e-13
    sol = run("damped\nV1 a 0 SIN(0 1 {1/pi} 0.5 1)\nR1 a b 1\nC1 b 0 1 IC=0\n", 4.0)
    s = np.maximum(sol.time - 0.5, 0.0)
    exact = np.exp(-s) * (1.0 - np.cos(2.0 * s)) / 2.0  # driven at the rate of the mode itself
    assert np.abs(sol["v(b)"] - exact).max() < 1e-13


def test_controlled_sources():
    """F and H: C v' = -g v with g = 1/R + beta/Rs, and a voltage proportional to a current."""
    text = "fh\nC1 a 0 1 IC=1\nR1 a 0 2\nRs a s 4\nVs s 0 0\nF1 a 0 Vs 3\nH1 h 0 Vs 5\nRh h 0 1\n"
    sol = run(text, 2.0)
    exact = np.exp(-(0.5 + 0.25 + 0.75) * sol.time)
    assert np.abs(sol["v(a)"] - exact).max() < 1e-13
    assert np.abs(sol["v(h)"] - 5.0 * exact / 4.0).max() < 1e-12


def test_three_coupled_windings():
    """Perfectly coupled windings carry one flux: voltages in the ratio of turns."""
    text = (
        "wind\nV1 a 0 1\nR1 a p 1\nL1 p 0 1 IC=0\nL2 s 0 4 IC=0\nL3 t 0 9 IC=0\n"
        "K1 L1 L2 1\nK2 L1 L3 1\nK3 L2 L3 1\nR2 s 0 8\nR3 t 0 18\n"
    )
    sol = run(text, 2.0)
    # loads refer to the primary as 8/4 and 18/9: g = 1/2 + 1/2, L i' = v, i + g v = 1 - v
    v = 0.5 * np.exp(-0.5 * sol.time)
    assert np.abs(sol["v(p)"] - v).max() < 1e-12
    assert np.abs(sol["v(s)"] - 2.0 * v).max() < 1e-12
    assert np.abs(sol["v(t)"] - 3.0 * v).max() < 1e-12


def test_coincident_edges_are_one_breakpoint():
    """Two gates of one clock written differently: no sliver with both switches open."""
    text = (
        "edges\nV1 p 0 10\nS1 p a g1 0 SW\nS2 a 0 g2 0 SW\nL1 a 0 1m IC=0\n"
        "Vg1 g1 0 PULSE(0 1 0.3u 0 0 0.4u 1u)\nVg2 g2 0 PULSE(1 0 {0.1u+0.2u} 0 0 {0.7u-0.3u} 1u)\n"
        ".model SW SW(VT=0.5)\n"
    )
    sol = run(text, 100e-6, 100)
    assert sol["i(l1)"][-1] == pytest.approx(10 * 0.4e-6 * 100 / 1e-3, rel=1e-12)
    assert sol.stats["breakpoints"] == 200
    assert not sol.impulses


def test_switch_on_a_threshold_of_its_own_circuit():
    """A relaxation oscillator: C charges to 2 V through 1 Ohm, then discharges to 1 V."""
    text = (
        "relax\nV1 a 0 3\nR1 a c 1\nC1 c 0 1 IC=0\nS1 c d c 0 SW\nR2 d 0 0.25\n"
        ".model SW SW(VT=1.5 VH=0.5)\n"
    )
    sol = run(text, 4.0)
    on = [e.time for e in sol.events if e.change == "on"]
    rise = math.log(3.0)
    fall = 0.2 * math.log((2.0 - 0.6) / (1.0 - 0.6))
    again = math.log(2.0)
    assert on[0] == pytest.approx(rise, rel=1e-14)
    assert on[1] == pytest.approx(rise + fall + again, rel=1e-13)


def test_a_switch_that_slides_is_sampled():
    """One that cannot stay on either side of its threshold: v' is 8 kV/s or -1 kV/s, never both."""
    text = (
        "slide\nV1 in 0 10\nR1 in a 1k\nS1 a c ref c SW\nC1 c 0 1u IC=0\nR2 c 0 1k\nVr ref 0 1\n"
        ".model SW SW(VT=0)\n"
    )
    sol = run(text, 2e-3, 200)
    assert sol.stats["fixed_steps"] == 0
    # five millionths of the run, at the larger of both rates
    assert sol["v(c)"][sol.time > 1e-3] == pytest.approx(1.0, abs=8e3 * 5e-6 * 2e-3)
    assert "reacts at multiples of 1e-08 s" in sol.warnings[0].message


def test_start_from_the_dc_solution_and_late_rows():
    text = "dc\nV1 a 0 SIN(1 1 50)\nR1 a b 1k\nC1 b 0 1u\n"
    sol = nsspice.tran(nsspice.read(text), stop=20e-3, row_step=1e-3, start=5e-3, method="modewise")
    assert sol.time[0] == 5e-3
    w, tau = 2 * math.pi * 50, 1e-3
    t = sol.time
    driven = (np.sin(w * t) - w * tau * np.cos(w * t)) / (1 + (w * tau) ** 2)
    exact = 1.0 + driven + w * tau / (1 + (w * tau) ** 2) * np.exp(-t / tau)
    assert np.abs(sol["v(b)"] - exact).max() < 1e-13


def test_scale_does_not_matter():
    """The same rectifier at 1 nV and at 1 GV switches at the same instants."""
    text = "scale\nV1 a 0 SIN(0 {v} 50)\nD1 a b D\nC1 b 0 1m IC=0\nR1 b 0 100\n.model D D(ideal)\n"
    times = []
    for v in (1e-9, 1.0, 1e9):
        circuit = nsspice.read(text.replace("{v}", repr(v)))
        sol = nsspice.tran(circuit, stop=0.1, row_step=1e-3, uic=True, method="modewise")
        times.append([e.time for e in sol.events])
    assert times[0] == pytest.approx(times[1], rel=1e-12)
    assert times[2] == pytest.approx(times[1], rel=1e-12)


def test_what_it_cannot_do_is_said():
    text = "fm\nV1 a 0 SFFM(0 1 1k 5 100)\nR1 a b 1\nC1 b 0 1u\n.tran 10u 1m\n"
    with pytest.raises(UsageError, match=r"NS4020.*sffm"):
        nsspice.tran(nsspice.read(text), method="modewise")
    run = nsspice.tran(nsspice.read(text))
    (island,) = run.islands
    assert island.method == "sdirk"
    assert "sffm" in island.note
    # the next best is as exact as it is asked to be, 1e-5 a step; fixed ones of 10 us err by 1e-2
    sharp = nsspice.tran(nsspice.read(text), method="sdirk", reltol=1e-9)
    assert np.max(np.abs(run["v(b)"] - sharp["v(b)"])) < 1e-4 * np.ptp(sharp["v(b)"])


def test_a_step_or_theta_that_is_asked_for_means_stepping():
    circuit = nsspice.read("rc\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u IC=0\n.tran 10u 1m uic\n")
    assert nsspice.tran(circuit).islands[0].method == "modewise"
    assert nsspice.tran(circuit, step=1e-5).islands[0].method == "moreau"
    assert nsspice.tran(circuit, theta=0.5).islands[0].method == "moreau"


def test_rounding_between_a_loop_and_a_trapped_charge_is_no_guard():
    deck = """an inductor across the source, and a charge that nothing moves: both do not decay
V1 a 0 SIN(0 325 50)
R1 c 0 9751
L1 a 0 1.073m
C1 c x 5.96u
R2 x b 30.21
C2 0 y 2.709u
R3 y b 19.9
D1 c a
D2 c 0
.tran 0.2m 60m
"""
    run = nsspice.tran(nsspice.read(deck))
    assert run.stats["fixed_steps"] == 0
    exact = 325 / (100 * np.pi * 1.073e-3) * (1 - np.cos(100 * np.pi * run.time))
    assert np.max(np.abs(run["i(l1)"] - exact)) < 1e-12 * np.max(exact)


def test_implicit_steps_do_not_prolong_a_ramp_that_ends_where_they_begin():
    """A clock of 1 V, whose ramps of 1 ns went on to 500 V in steps of 0.5 us."""
    run = nsspice.tran(nsspice.read(MODULATOR), method="modewise")
    assert run.stats["fixed_steps"] > 1000
    assert run.certificate.laws < 1e-8
    # steps of 5 ns through chatter at gigahertz are told
    assert run.certificate.taken > run.certificate.granted
    assert not run.certificate.passed
    # what they have taken is in the balance of energy, which is whole
    energy = run.certificate.energy
    assert energy.complete
    assert energy.drift < 1e-10
    assert energy.scheme > 0.0
    size = abs(energy.delivered) + abs(energy.dissipated) + abs(energy.stored)
    left = energy.delivered - energy.dissipated - energy.stored - energy.lost - energy.scheme
    assert abs(left) <= 1e-9 * size
    assert np.abs(run["v(clock)"]).max() <= 1.0


#: nothing closes a circuit through R9
SECONDARY = (
    "Secondary of an ideal transformer that one large resistance ties to ground\n"
    + IDEAL_TRANSFORMER
    + """{load}
R9 n 0 {tie}
.model ideal D(ideal)
.tran 5u 0.5m
"""
)


@pytest.mark.parametrize("load", ["C1 u n 100u", "D1 u o ideal\nC1 o n 10u\nR3 o n 100"])
def test_a_large_resistance_ties_a_part_to_ground_and_nothing_more(load: str) -> None:
    """10 mOhm beside 10 GOhm: potentials of the part cost currents their digits, then all."""

    def run(tie: str) -> nsspice.Solution:
        circuit = nsspice.read(SECONDARY.format(load=load, tie=tie))
        return nsspice.tran(circuit, method="modewise")

    near = run("1k")
    for tie in ("1Meg", "100Meg", "1G", "10G"):
        far = run(tie)
        assert far.certificate.laws < 1e-11
        for name in ("i(v1)", "i(vs)"):
            # rounding of 10 A, by the conductances of 10 mOhm and 1 kOhm
            assert np.max(np.abs(far[name] - near[name])) < 1e-9 * np.max(np.abs(near[name]))
