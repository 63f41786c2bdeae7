"""Small-signal responses about periodic orbits: closed forms, brute force, and loop gains."""

from __future__ import annotations

import time

import numpy as np
import pytest

import nsspice

BUCK = """Naturally sampled buck: control to output
.param t=10u eps=0 f=1k
Vin in 0 24{input}
S1 in sw c saw SW1
D1 0 sw
Vc c 0 0.4{control}
Vsaw saw 0 PULSE(0 1 0 {{t}} 0 0 {{t}})
L1 sw out 100u
C1 out 0 47u
R1 out 0 3
Iout out 0 0{load}
.model SW1 SW(VT=0)
.pss
"""
L, C, R, V, D, T = 100e-6, 47e-6, 3.0, 24.0, 0.4, 10e-6
FREQUENCIES = [100.0, 1e3, 2.3e3, 5e3, 12e3, 31e3, 47e3, 81e3, 133e3, 777e3]


def buck(**ac: str) -> nsspice.Circuit:
    parts = {"input": "", "control": "", "load": ""} | {k: f" AC {v}" for k, v in ac.items()}
    return nsspice.read(BUCK.format(**parts))


def filter_of(w: np.ndarray) -> np.ndarray:
    return 1.0 / (1.0 + 1j * w * L / R + (1j * w) ** 2 * L * C)


def test_control_to_output_is_the_filter_at_every_frequency() -> None:
    sol = nsspice.ac(buck(control="1"), FREQUENCIES)
    w = 2.0 * np.pi * sol.axis
    assert np.abs(sol["v(sw)"] / V - 1.0).max() < 1e-12
    # the filter passes 1e-5 at 777 kHz: rounding of the states counts so much more there
    assert np.abs(sol["v(out)"] / (V * filter_of(w)) - 1.0).max() < 1e-9
    assert sol.periodic.verdict == "stable"


def test_the_input_passes_with_the_duty_and_the_load_sees_the_filter() -> None:
    sol = nsspice.ac(buck(input="1"), FREQUENCIES)
    w = 2.0 * np.pi * sol.axis
    assert np.abs(sol["v(out)"] / (D * filter_of(w)) - 1.0).max() < 1e-9
    load = nsspice.ac(buck(load="-1"), FREQUENCIES)
    impedance = 1.0 / (1.0 / R + 1j * w * C + 1.0 / (1j * w * L))
    assert np.abs(load["v(out)"] / impedance - 1.0).max() < 1e-9


def test_sidebands_of_a_chopped_stimulus() -> None:
    """The switch node shows the input times the Fourier coefficients of the duty."""
    sol = nsspice.ac(buck(input="1"), [1e3, 7e3], signals=["v(sw)"], period=None, sidebands=0)
    card = nsspice.read(BUCK.format(input=" AC 1", control="", load="")
                        + ".ac list 1k 7k sidebands=3\n.save v(sw)\n")  # fmt: skip
    shown = card.run()[1]
    assert np.abs(shown["v(sw)"] - sol["v(sw)"]).max() == 0.0
    for n in (-3, -2, -1, 1, 2, 3):
        coefficient = (1.0 - np.exp(-2j * np.pi * n * D)) / (2j * np.pi * n)
        assert np.abs(shown[f"v(sw)@{n}"] - coefficient).max() < 1e-13


BOOST = """Boost with a modulated control: brute force
.param eps=0 f=5k
Vin in 0 12
L1 in sw 50u
S1 sw 0 c saw SW1
D1 sw out
C1 out 0 20u
R1 out 0 20
Vd c m {d}
Vm m 0 SIN(0 {eps} {f}) AC 1
Vsaw saw 0 PULSE(0 1 0 10u 0 0 10u)
.model SW1 SW(VT=0)
.param d=0.4
.pss
"""
DISCONTINUOUS = BOOST.replace("R1 out 0 20", "R1 out 0 2k").replace("d=0.4", "d=0.2")


@pytest.mark.parametrize("deck", [BOOST, DISCONTINUOUS], ids=["continuous", "discontinuous"])
@pytest.mark.parametrize("f", [1e3, 10e3, 130e3])
def test_responses_are_the_limit_of_small_stimuli(deck: str, f: float) -> None:
    """A sine of the control in the common steady state of both, its exact Fourier coefficient."""
    sol = nsspice.ac(nsspice.read(deck), [f])
    eps = 1e-4
    text = deck.replace("eps=0", f"eps={eps}").replace("f=5k", f"f={f!r}")
    both = nsspice.pss(nsspice.read(text))
    order = round(f * both.periodic.period)
    assert abs(order - f * both.periodic.period) < 1e-9
    for name in ("v(out)", "i(l1)"):
        # the coefficient of e^(j w t) in the sine eps sin(w t) is eps/(2j)
        (found,) = both.integrals.coefficients([name], [order])[name] * 2j / eps
        # the second order of eps: 1e-4 of it, and several times as much where conduction is cut off
        assert abs(sol[name][0] - found) < 1e-4 * abs(found), name


CLOSED = """Voltage-mode buck with an integrating controller
.param t=10u
Vin in 0 24
S1 in sw cm saw SW1
D1 0 sw
Vsaw saw 0 PULSE(0 1 0 {t} 0 0 {t})
L1 sw out 100u
Resr out oc 10m
C1 oc 0 100u
R1 out 0 1
Vt fb out 0
Rf fb n 10k
Vref ref 0 12
Rz n z 100
Cz z c 1u
E1 c 0 ref n 1e4
Vcm cm c 0 AC 1
.model SW1 SW(VT=0)
.pss
"""
LOOP = [100.0, 300.0, 1e3, 3e3, 10e3, 30e3]


def test_a_loop_gain_does_not_depend_on_where_it_is_taken() -> None:
    network = nsspice.read(CLOSED)
    at_output = nsspice.loop(network, "vt", LOOP)["t"]
    at_control = nsspice.loop(network, "vcm", LOOP)["t"]
    assert np.abs(at_output / at_control - 1.0).max() < 1e-9
    # the control takes no current and the amplifier has no impedance: a ratio of voltages
    sol = nsspice.ac(network, LOOP)
    assert np.abs(-sol["v(c)"] / sol["v(cm)"] / at_control - 1.0).max() < 1e-9


def test_a_loop_gain_is_the_product_of_its_parts() -> None:
    """Controller, modulator and filter; ripple at the comparator changes the modulator's slope."""
    network = nsspice.read(CLOSED)
    sol = nsspice.loop(network, "vt", LOOP)
    w = 2.0 * np.pi * sol.axis
    s = 1j * w
    load = 1.0 / (1.0 + 1.0 / (10e-3 + 1.0 / (s * 100e-6)))
    plant = load / (load + s * 100e-6)
    zf, zc = 10e3, 100.0 + 1.0 / (s * 1e-6)
    controller = 1e4 / (1.0 + 1e4 * zf / (zf + zc)) * zc / (zf + zc)
    orbit = nsspice.pss(network, row_step=1e-8)
    at = int(np.flatnonzero(orbit["v(sw)"] < 12.0)[0])
    ripple = (orbit["v(c)"][at - 1] - orbit["v(c)"][at - 2]) / 1e-8
    modulator = 24.0 / (1.0 - ripple * 10e-6)
    product = controller * modulator * plant
    apart = np.abs(sol["t"] / product - 1.0)
    # the sampled loop folds sidebands back: T at 100 kHz is 0.24 (1.6/100)^2 = 6e-5, multiples of
    # it and both sides add up to 2 pi^2/6 times as much, 2e-4; 1e-3 leaves room for the ESR's zero
    assert apart.max() < 1e-3, apart
    assert sol.loop.crossovers
    assert sol.loop.phase_margin is not None


def test_margins_are_located_with_the_gain_itself() -> None:
    """Three equal poles: T = 4/(1+s)^3 crosses 1 at s = sqrt(4^(2/3) - 1), -180 deg at sqrt 3."""
    text = """three poles
E1 a 0 0 c 4
R1 a b1 1
C1 b1 0 1
E2 d 0 b1 0 1
R2 d b2 1
C2 b2 0 1
E3 e 0 b2 0 1
Vt x e 0
R3 x c 1
C3 c 0 1
.loop Vt dec 4 0.01 10
"""
    (sol,) = nsspice.read(text).run()
    (crossover,), (reversal,) = sol.loop.crossovers, sol.loop.reversals
    w = np.sqrt(4.0 ** (2.0 / 3.0) - 1.0)
    assert abs(crossover.frequency - w / (2 * np.pi)) < 1e-12
    assert abs(crossover.margin - (180.0 - 3.0 * np.degrees(np.arctan(w)))) < 1e-9
    assert abs(reversal.frequency - np.sqrt(3.0) / (2 * np.pi)) < 1e-12
    assert abs(reversal.margin - 20 * np.log10(2.0)) < 1e-9


def test_sixty_points_are_milliseconds() -> None:
    network, grid = buck(control="1"), np.geomspace(100.0, 300e3, 60)
    nsspice.ac(network, grid)
    best = 1.0
    for _ in range(5):
        begin = time.process_time()
        nsspice.ac(network, grid)
        best = min(best, time.process_time() - begin)
    assert best < 0.05


def test_measures_and_parts_of_responses() -> None:
    text = """low-pass
V1 a 0 AC 1
R1 a b 1k
C1 b 0 159.15494309189535n
.ac dec 10 10 100k
.measure ac corner when vdb(b)=-3.010299956639812
.measure ac top max v(b)
.measure ac phase find vp(b) at=1k
.measure ac part find vi(b) at=1k
"""
    (sol,) = nsspice.read(text).run()
    assert abs(sol.measures["corner"] - 1e3) < 1e-9 * 1e3
    assert abs(sol.measures["top"] - 1.0 / np.hypot(1.0, 0.01)) < 1e-12
    assert abs(sol.measures["phase"] + 45.0) < 1e-9
    assert abs(sol.measures["part"] + 0.5) < 1e-12
    assert np.allclose(sol["vdb(b)"], 20 * np.log10(np.abs(sol["v(b)"])))
    assert sol.columns[:4] == ["re(v(a))", "im(v(a))", "re(v(b))", "im(v(b))"]


def test_current_sources_and_loose_parts() -> None:
    text = """source and tank
I1 0 a AC 2
R1 a 0 50
C1 b 0 1u
R2 b c 1k
V2 c 0 1
.ac list 1k
"""
    (sol,) = nsspice.read(text + ".save v(a) v(b) i(I1) i(R1)\n").run()
    assert sol["v(a)"][0] == 100.0
    assert sol["v(b)"][0] == 0.0
    assert sol["i(i1)"][0] == 2.0
    assert sol["i(r1)"][0] == 2.0


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        (["V1 a 0 AC 1", "L1 a b 1m", "C1 b 0 1m", ".ac list 159.15494309189535"], "NS3063"),
        (["V1 a 0 AC 1", "R1 a 0 1", ".ac dec 10 1k 1"], "NS1080"),
        (["V1 a 0 AC 1", "R1 a 0 1", ".ac log 10 1k 1"], "NS1080"),
        (["V1 a 0 AC 1", "R1 a 0 1", ".loop V1 dec 10 1 1k"], "NS1080"),
        (["V1 a 0 AC 1", "R1 a 0 1", ".loop V2 dec 10 1 1k"], "NS1070"),
        (["V1 a 0 AC 1", "R1 a 0 {vdb(a)}", ".op"], "NS1022"),
    ],
)
def test_errors(lines: list[str], code: str) -> None:
    with pytest.raises(nsspice.NsspiceError) as caught:
        nsspice.read("\n".join(["errors", *lines])).run()
    assert caught.value.diagnostics[0].code == code


def test_without_a_stimulus_nothing_responds() -> None:
    (sol,) = nsspice.read("none\nV1 a 0 1\nR1 a 0 1\n.ac dec 10 1 1k\n").run()
    assert [w.code for w in sol.warnings] == ["NS4016"]
    assert not sol["v(a)"].any()


def test_a_diode_at_its_corner_is_named() -> None:
    (sol,) = nsspice.read("corner\nV1 a 0 AC 1\nR1 a b 1k\nD1 b 0\nR2 b 0 1k\n.ac list 1k\n").run()
    assert [w.code for w in sol.warnings] == ["NS3064"]
    assert abs(sol["v(b)"][0] - 0.5) < 1e-15


def test_files_of_responses(tmp_path) -> None:  # type: ignore[no-untyped-def]
    (sol,) = nsspice.read("rc\nV1 a 0 AC 1\nR1 a b 1k\nC1 b 0 1u\n.ac dec 5 1 10k\n").run()
    sol.plot(tmp_path / "bode.svg")
    assert (tmp_path / "bode.svg").stat().st_size > 10_000
    from nsspice.output.raw import read_raw, write_raw

    write_raw(sol, tmp_path / "a.raw")
    content = (tmp_path / "a.raw").read_bytes()
    assert b"Flags: complex\n" in content
    names, real = read_raw(tmp_path / "a.raw")
    table = np.frombuffer(content.partition(b"Binary:\n")[2], "<c16").reshape(-1, len(names))
    assert names[:3] == ["frequency", "v(a)", "v(b)"]
    assert np.array_equal(table[:, 2], sol["v(b)"])
    assert np.array_equal(real[0], sol.axis)
