"""Circuits on which implicit steps once failed or did not end, beside the exact engine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nsspice

STEPS = ("sdirk", "moreau")
NETLISTS = Path(__file__).parents[3] / "netlists"


def run(deck: str, method: str, **options: float) -> nsspice.Solution:
    """Return a certified run: any other raises."""
    return nsspice.tran(nsspice.read(deck), method=method, **options)


def largest_gap(exact: nsspice.Solution, found: nsspice.Solution, signals: list[str]) -> float:
    """Return the largest distance, each relative to its signal."""
    gaps = [np.abs(exact[s] - found[s]).max() / np.abs(exact[s]).max() for s in signals]
    return float(max(gaps))


@pytest.mark.parametrize("method", ["modewise", *STEPS])
def test_a_capacitor_across_a_sine_carries_its_current_at_once(method: str):
    deck = """C dv/dt from the first output point on, where it was 0
V1 a 0 SIN(0 10 50)
C1 a 0 1u
R1 a 0 1k
.save i(C1)
.tran 0.1m 1m uic
.end
"""
    first = run(deck, method)["i(c1)"][0]
    assert first == pytest.approx(1e-6 * 10.0 * 2.0 * np.pi * 50.0, rel=1e-9)


@pytest.mark.parametrize("method", ["modewise", *STEPS])
@pytest.mark.parametrize("load", ["V2 b 0 SIN(0 5 50)\nD1 a 0", "D1 a b\nR2 b 0 1k"])
def test_a_current_without_a_path_is_refused(method: str, load: str):
    """Beside a capacitor in another part or the same one `sdirk` had no end."""
    deck = f"""a sine into a blocking diode
I1 0 a SIN(0 1 50)
{load}
R1 b c 1k
C1 c 0 1u
.tran 0.1m 40m uic
.end
"""
    with pytest.raises(nsspice.NumericalError, match="i1 and d1 at node a contradict") as refused:
        run(deck, method)
    assert refused.value.code == "NS3001"


def test_complementary_switches_at_a_threshold_of_zero():
    """Both closed for an instant at t = 0, where the floating sine between their gates is zero."""
    deck = """complementary switches
V1 a b SIN(0 10 50)
R9 b 0 1meg
S1 p a a b sw
S2 p b b a sw
V2 s 0 12
R1 s p 10
.model sw SW(VT=0 RON=1m)
.tran 0.1m 40m uic
.end
"""
    exact, found = (run(deck, method).events for method in ("modewise", "sdirk"))
    told = [[(e.element, e.change) for e in events] for events in (exact, found)]
    assert told[0] == told[1]
    gaps = [abs(a.time - b.time) for a, b in zip(exact, found, strict=True)]
    assert max(gaps) < 1e-9


def pump(stages: int) -> str:
    """Return a charge pump of ideal diodes without any resistance but its load."""
    lines = ["charge pump", "V1 in 0 10"]
    lines += ["VA a 0 PULSE(0 10 0 10n 10n 0.49u 1u)", "VB b 0 PULSE(10 0 0 10n 10n 0.49u 1u)"]
    for k in range(stages):
        before = f"n{k - 1}" if k else "in"
        lines += [f"D{k} {before} n{k}", f"C{k} n{k} {'ab'[k % 2]} 1n"]
    lines += [f"DO n{stages - 1} out", "CO out 0 10n", "RO out 0 100k"]
    return "\n".join([*lines, ".tran 50n 3u uic", ".end"])


@pytest.mark.parametrize("stages", [12, 60])
def test_charge_pumps_of_ideal_diodes(stages: int):
    """At each clock edge all diodes change; points after it were off by a hundred tolerances."""
    exact, found = (run(pump(stages), method) for method in ("modewise", "sdirk"))
    signals = ["v(out)", "i(do)", "v(n5)", "v(n11)"]
    assert largest_gap(exact, found, signals) < 1e-6  # of reltol = 1e-4 a hundredth


def leds(side: int) -> str:
    """Return a multiplexed matrix of LEDs with 100 pF each, between switches."""
    lines = ["matrix of LEDs", "V1 s 0 5"]
    for r in range(side):
        lines.append(f"VR{r} cr{r} 0 PULSE(0 5 {10 * r}u 10n 10n 9.9u {10 * side}u)")
        lines.append(f"SR{r} s r{r} cr{r} 0 sw")
        lines += [f"D{r}_{c} r{r} c{c} led" for c in range(side)]
        lines += [f"C{r}_{c} r{r} c{c} 100p" for c in range(side)]
    for c in range(side):
        lines.append(f"VC{c} cc{c} 0 PULSE(0 5 {7 * c}u 10n 10n 60u 130u)")
        lines += [f"SC{c} c{c} g{c} cc{c} 0 sw", f"RC{c} g{c} 0 100"]
    lines += [".model led D(Vfwd=1.8 Ron=5)", ".model sw SW(VT=2.5 RON=0.1 ROFF=1meg)"]
    return "\n".join([*lines, ".tran 0.5u 5u uic", ".end"])


@pytest.mark.parametrize("method", STEPS)
def test_the_first_output_point_of_a_matrix_of_leds(method: str):
    exact, found = (run(leds(12), name) for name in ("modewise", method))
    signals = ["v(r0)", "v(c0)", "v(r3)", "v(c3)"]
    for signal in signals:
        assert found[signal][0] == pytest.approx(exact[signal][0], rel=1e-9, abs=1e-9)


def test_six_ideal_thyristors_over_thirty_periods():
    """KVL was off by 1.1e-8 after 600 ms."""
    deck = (NETLISTS / "rectifiers" / "thyristor_bridge.net").read_text()
    assert run(deck, "sdirk", stop=0.6, step=1e-3).certificate.laws < 1e-11


def test_nearly_perfect_coupling_over_a_hundred_periods():
    """The error of a diode's law grew with the length of the run, to 3.5e-8."""
    deck = """rectifier with RS and no capacitance behind K = 0.9999
V1 p 0 SIN(0 325 50)
R1 p q 0.5
L1 q 0 1
L2 s 0 10m
K1 L1 L2 0.9999
D1 s o dj
C1 o 0 1m
R2 o 0 20
.model dj D(IS=1e-12 RS=10m)
.tran 1m 2
.end
"""
    assert run(deck, "sdirk").certificate.laws < 1e-11


def test_a_phase_shifted_bridge_with_perfect_coupling():
    """Steps were picoseconds long; now a period of 10 us takes some two hundred."""
    gates = [("A", 0), ("B", 5), ("C", 2), ("D", 7)]
    lines = ["phase-shifted bridge", "VDC d 0 400"]
    lines += [f"V{g} g{g} 0 PULSE(0 5 {t}u 10n 10n 4.8u 10u)" for g, t in gates]
    for leg, upper, lower in (("a", "A", "B"), ("b", "C", "D")):
        lines += [f"S{upper} d {leg} g{upper} 0 sw", f"D{upper} {leg} d d"]
        lines += [f"S{lower} {leg} 0 g{lower} 0 sw", f"D{lower} 0 {leg} d", f"C{leg} {leg} 0 200p"]
    lines += ["LK a p 10u", "L1 p b 1m", "L2 s1 0 40u", "L3 0 s2 40u", "K1 L1 L2 L3 1"]
    lines += ["D1 s1 o d", "D2 s2 o d", "LO o out 20u", "CO out 0 100u IC=40", "RO out 0 2"]
    lines += [".model sw SW(VT=2.5 RON=20m ROFF=1meg)", ".model d D(Vfwd=0.7 Ron=10m)"]
    deck = "\n".join([*lines, ".tran 0.5u 0.1m uic", ".end"])
    exact, found = (run(deck, method) for method in ("modewise", "sdirk"))
    assert found.stats["steps"] < 400 * 10
    assert largest_gap(exact, found, ["v(out)", "i(lo)"]) < 1e-4
