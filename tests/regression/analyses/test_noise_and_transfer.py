""".noise, .tf and .sens about the operating point: closed forms, differences, ngspice."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.analyses.steady.noise import noise
from nsspice.analyses.steady.transfer import op_sensitivities
from nsspice.output.summary import describe, to_dict

BOLTZMANN, CHARGE, T = 1.380649e-23, 1.602176634e-19, 300.15


def runs(text: str) -> list[nsspice.Solution]:
    return list(nsspice.read(text).run())


def test_a_capacitor_has_k_t_over_c() -> None:
    (sol,) = runs("rc\nV1 a 0 AC 1\nR1 a b 2k\nC1 b 0 1n\n.noise v(b) V1 dec 10 1 1g\n")
    f = sol.axis
    exact = np.sqrt(4 * BOLTZMANN * T * 2e3 / (1 + (2 * np.pi * f * 2e-6) ** 2))
    assert np.abs(sol["onoise"] / exact - 1.0).max() < 1e-13
    assert np.abs(sol["inoise"] / math.sqrt(4 * BOLTZMANN * T * 2e3) - 1.0).max() < 1e-13
    # powers between points: (ln r)^2/12 of the density's largest curvature over ln f, 1/2: 0.2 %;
    # beyond 1 GHz is 2/pi/(2 pi 1e9 2e-6) = 5e-5
    assert sol.measures["onoise_total"] == pytest.approx(math.sqrt(BOLTZMANN * T / 1e-9), rel=2e-3)


def test_its_picture_is_written(tmp_path: Path) -> None:
    (sol,) = runs("rc\nV1 a 0 AC 1\nR1 a b 2k\nC1 b 0 1n\n.noise v(b) V1 dec 1 10 1k\n")
    sol.plot(tmp_path / "noise.png")
    assert (tmp_path / "noise.png").stat().st_size > 5_000


def test_a_biased_diode() -> None:
    """2 q I times the square of its slope's resistance, and that of RS, independently."""
    text = """diode
I1 0 a DC 1m AC 1
D1 a 0 DN
.model DN D(IS=1e-14 RS=20)
"""
    sol = noise(nsspice.read(text), "v(a)", "i1", np.array([1e3]))
    slope = BOLTZMANN * T / CHARGE / (1e-3 + 1e-14)
    exact = 2 * CHARGE * 1e-3 * slope**2 + 4 * BOLTZMANN * T * 20.0
    # gmin of 1e-12 S beside 1/26 Ohm, and the operating point's own 1e-9
    assert sol["onoise"][0] ** 2 == pytest.approx(exact, rel=1e-8)
    assert sol["inoise"][0] == pytest.approx(math.sqrt(exact) / (slope + 20.0), rel=1e-8)


def test_what_makes_no_noise() -> None:
    quiet = "q\nV1 a 0 AC 1\nR1 a b 1k noiseless\nR2 b 0 1k\n.noise v(b) V1 list 1k\n"
    (sol,) = runs(quiet)
    assert sol["onoise"][0] == pytest.approx(math.sqrt(4 * BOLTZMANN * T / 1e3) * 500.0, rel=1e-13)
    (same,) = runs(quiet.replace("noiseless", "noisy=0"))
    assert same["onoise"][0] == sol["onoise"][0]
    (told,) = runs("k\nI1 0 a 1m\nD1 a 0 DN\n.model DN D(Vfwd=0.7 Ron=1 KF=1e-15)\n"
                   ".noise v(a) I1 list 1k\n")  # fmt: skip
    assert [w.code for w in told.warnings].count("NS4023") == 1
    with pytest.raises(nsspice.NsspiceError) as caught:
        runs(quiet.replace("AC 1", "SIN(0 1 1k)") + "C1 b 0 1u\n.pss\n")
    assert caught.value.diagnostics[0].code == "NS4022"


def test_flicker_of_a_junction_by_its_formula() -> None:
    """KF |I|^AF / f through the slope of the junction; two in parallel are M=2."""
    deck = "f\nI1 0 a 1m\n{}\n.model DN D(IS=1e-14 KF=1e-15 AF=1.3)\n.noise v(a) I1 list 1 100\n"
    (one,) = runs(deck.format("D1 a 0 DN"))
    T = 300.15
    slope = BOLTZMANN * T / 1.602176634e-19 / 1e-3  # of a large current the saturation is 1e-11
    white = 2.0 * 1.602176634e-19 * 1e-3
    for f, found in zip((1.0, 100.0), one["onoise"], strict=True):
        expected = math.sqrt(white + 1e-15 * 1e-3**1.3 / f) * slope
        assert found == pytest.approx(expected, rel=1e-8)  # gmin and the saturation current
    (two,), (many,) = (runs(deck.format(d)) for d in ("D1 a 0 DN\nD2 a 0 DN", "D1 a 0 DN M=2"))
    assert two["onoise"] == pytest.approx(many["onoise"], rel=1e-9)


TRANSISTORS = (
    ("M1 d g 0 0 MX W=20u L=2u", 3.0, 10.0,
     "NMOS(LEVEL=1 VTO=1 KP=50u LAMBDA=0.01 TOX=50n KF=1e-26 AF=1.2 RD=10 RS=5 LD=0.2u GAMMA=0.5)"),
    ("M1 d g 0 0 MX W=20u L=2u", -3.0, -10.0,
     "PMOS(LEVEL=1 VTO=-1 KP=50u LAMBDA=0.01 KF=1e-26 AF=1.2)"),
    ("J1 d g 0 MX", -1.0, 10.0,
     "NJF(VTO=-3 BETA=1m LAMBDA=0.01 KF=1e-14 AF=1.1 RD=10 RS=10)"),
    ("M1 d g 0 MX", 3.1, 10.0,
     "VDMOS(VTO=3 KP=1 LAMBDA=0.01 RD=0.1 RS=0.05 KF=1e-19 AF=1.1)"),
    ("Rx g x 1k\nQ1 d x 0 MX", 0.7, 10.0,
     "NPN(IS=1e-14 BF=100 KF=1e-14 AF=1.2 RB=50 RE=1)"),
)  # fmt: skip


@pytest.mark.parametrize(("line", "gate", "supply", "card"), TRANSISTORS)
def test_transistors_beside_ngspice(line: str, gate: float, supply: float, card: str) -> None:
    """Thermal, shot and flicker noise of channels, junctions and resistances."""
    text = f"""noise of a transistor
V1 g 0 DC {gate} AC 1
Vd vd 0 {supply}
R1 vd d 1k
{line}
.model MX {card}
.noise v(d) V1 dec 1 1 1meg
"""
    options = ".options reltol=1e-9 abstol=1e-18 vntol=1e-14 gmin=1e-30\n"
    done = subprocess.run(
        [sys.executable, "-c", CHILD], input=text + options + ".end\n", capture_output=True,
        text=True, check=False, timeout=60,
    )  # fmt: skip
    found = next(x for x in done.stdout.splitlines() if x.startswith("RESULT"))
    spectrum = np.array(json.loads(found[6:])["onoise_spectrum"])
    (ours,) = runs(text)
    # its constants have the digits of 2014, its operating point 1e-9 of volts that turn 1e-6 of a
    # current by exponentials
    assert np.abs(ours["onoise"] / spectrum - 1.0).max() < 1e-5


AMPLIFIER = """amplifier
V1 in 0 DC 0 AC 1
Vcc vcc 0 12
Cin in b 1u
R1 vcc b 47k
R2 b 0 10k
Rc vcc c 4.7k
Re e 0 1k
Ce e 0 10u
Q1 c b e QN
D1 c x DN
Rx x 0 10k
.model QN NPN(IS=1e-15 BF=150 VAF=80 RB=100 RC=5 RE=1 CJE=8p CJC=3p)
.model DN D(IS=1e-12 RS=3)
"""

CHILD = """
import json, os, sys
from nsspice.compare.ngspice.child import session
ngspice = session()
ngspice.load_circuit(sys.stdin.read())
ngspice.exec_command("run")
found = {}
for name in ngspice.plot_names:
    if name.startswith(("noise", "tf")):
        for k, v in ngspice.plot(None, name).items():
            found[k.lower()] = v._data.real.tolist()
print("RESULT" + json.dumps(found))
sys.stdout.flush()
os._exit(0)
"""


def test_an_amplifier_beside_ngspice() -> None:
    options = ".options reltol=1e-9 abstol=1e-18 vntol=1e-14 gmin=1e-30\n"
    cards = ".noise v(c) V1 dec 2 10 1meg\n.tf v(c) Vcc\n"
    text = AMPLIFIER + options + cards + ".end\n"
    done = subprocess.run(
        [sys.executable, "-c", CHILD], input=text, capture_output=True, text=True, check=False,
        timeout=60,
    )  # fmt: skip
    line = next(x for x in done.stdout.splitlines() if x.startswith("RESULT"))
    theirs = json.loads(line[6:])
    ours, tf = runs(AMPLIFIER + cards)
    # ngspice's charge and constant of Boltzmann have 2014's digits: 1e-6; its operating point
    # is known to 1e-9
    for name in ("onoise", "inoise"):
        spectrum = np.array(theirs[f"{name}_spectrum"])
        assert np.abs(ours[name] / spectrum - 1.0).max() < 2e-6, name
    by_name = {
        "transfer_function": "transfer_function",
        "input_resistance": "vcc#input_impedance",
        "output_resistance": "output_impedance_at_v(c)",
    }
    for name, other in by_name.items():
        assert tf[name][0] == pytest.approx(theirs[other][0], rel=2e-6), name


def test_resistances_seen_by_sources() -> None:
    text = "t\nV1 a 0 5\nR1 a b 1k\nR2 b 0 3k\nI1 0 b 1m\n"
    one, two, three = runs(text + ".tf v(b) V1\n.tf v(b) I1\n.tf i(V1) V1\n")
    values = [float(s[n][0]) for s in (one, two) for n in s.columns]
    assert values == pytest.approx([0.75, 4000.0, 750.0, 750.0, 750.0, 750.0], rel=1e-14)
    assert three["transfer_function"][0] == pytest.approx(-1 / 4000.0, rel=1e-14)
    assert three["output_resistance"][0] == pytest.approx(4000.0, rel=1e-14)
    assert "input_resistance  = 4000" in describe(one)
    assert to_dict(one)["values"]["transfer_function"] == one["transfer_function"][0]


def test_sensitivities_of_the_operating_point() -> None:
    circuit = nsspice.read(AMPLIFIER)
    found = {(s.signal, s.element): s for s in op_sensitivities(circuit, ["v(c)", "i(rc)"])}
    for name in ("rc", "r1", "r2", "re", "rx", "vcc"):
        value = found["v(c)", name].value
        h = 1e-4 * value
        up, down = (nsspice.op(circuit, values={name: value + d}) for d in (h, -h))
        for signal in ("v(c)", "i(rc)"):
            slope = float(up[signal][0] - down[signal][0]) / (2.0 * h)
            # differences err by h^2 of the third derivative, 1e-8, and the points' 1e-10 over 1e-4
            assert found[signal, name].derivative == pytest.approx(slope, rel=1e-5), (signal, name)
    assert found["v(c)", "cin"].derivative == 0.0
    (run,) = runs(AMPLIFIER + ".sens v(c) rc vcc\n")
    assert run.analysis == "op"
    assert [s.element for s in run.sensitivities] == ["rc", "vcc"]
    assert run.sensitivities[0].derivative == found["v(c)", "rc"].derivative


def test_ideal_elements_keep_their_state() -> None:
    text = "d\nV1 a 0 5\nR1 a b 1k\nD1 b c\nR2 c 0 1k\n.tf v(c) V1\n.sens v(c)\n"
    tf, bias = runs(text)
    assert tf["transfer_function"][0] == pytest.approx(0.5, rel=1e-14)
    slopes = {s.element: s.derivative for s in bias.sensitivities}
    assert slopes["r1"] == pytest.approx(-5.0 * 1e3 / 2e3**2, rel=1e-13)
    assert slopes["r2"] == pytest.approx(5.0 * 1e3 / 2e3**2, rel=1e-13)
