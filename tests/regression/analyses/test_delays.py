"""Delays and lossless lines: reflections on paper, the method of steps, shifted waveforms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nsspice
from nsspice import Controller
from nsspice.errors import NsspiceError, UsageError

#: a delay of 1 ns, rows between the edges
ROWS = (np.arange(60) + 0.5) * 0.25


def lattice(rs: float, rl: float, z0: float, time: float) -> tuple[float, float]:
    """Both ends of a line of 1 ns, 1 V behind rs from t = 0 on: a sum over the waves."""
    source, load = (rs - z0) / (rs + z0), (rl - z0) / (rl + z0)
    near = far = 0.0
    wave, there = z0 / (rs + z0), True
    for k in range(int(time) + 1):
        # the wave that leaves at k reaches the other end at k + 1, and adds to both there
        if there:
            near += wave if k == 0 else 0.0
            if time >= k + 1:
                far += wave * (1.0 + load)
                wave *= load
        elif time >= k + 1:
            near += wave * (1.0 + source)
            wave *= source
        there = not there
    return near, far


@pytest.mark.parametrize(
    ("rs", "rl"), [(50.0, 50.0), (20.0, 150.0), (200.0, 10.0), (1e-3, 1e9), (75.0, 1e-3)]
)
def test_reflections_are_those_of_the_lattice_diagram(rs: float, rl: float) -> None:
    deck = f"""line
V1 s 0 PULSE(0 1 0 0 0 1 2)
Rs s a {rs}
T1 a 0 b 0 Z0=50 TD=1n
RL b 0 {rl}
.tran 0.125n 14.9n
"""
    solution = nsspice.tran(nsspice.read(deck))
    assert solution.certificate.passed
    for time in ROWS[ROWS < 14.9]:
        k = round(time / 0.125)
        near, far = lattice(rs, rl, 50.0, float(time))
        # 15 waves, each with the rounding of its size
        assert solution["v(a)"][k] == pytest.approx(near, abs=1e-12)
        assert solution["v(b)"][k] == pytest.approx(far, abs=1e-12)


def test_two_lines_and_a_resistor_between() -> None:
    deck = """a line of 75 Ohm and 1 ns, 100 Ohm across, a line of 30 Ohm and 2 ns with f= and nl=
V1 s 0 PULSE(0 1 0 0 0 1 2)
Rs s a 40
T1 a 0 b 0 Z0=75 TD=1n
Rb b 0 100
T2 b 0 c 0 Z0=30 F=125meg NL=0.25
Rc c 0 500
.tran 0.25n 19.9n
"""
    solution = nsspice.tran(nsspice.read(deck))
    # waves that leave ends: a to the right, b to the left and right, c to the left, in ns
    a, bl, br, c = (np.zeros(60) for _ in range(4))
    va, vb, vc = (np.zeros(60) for _ in range(3))
    for k in range(20):
        into_a, into_bl = (bl[k - 1], a[k - 1]) if k >= 1 else (0.0, 0.0)
        into_br, into_c = (c[k - 2], br[k - 2]) if k >= 2 else (0.0, 0.0)
        # Thevenin: 2 times the wave behind the impedance
        va[k] = (1.0 / 40.0 + 2.0 * into_a / 75.0) / (1.0 / 40.0 + 1.0 / 75.0)
        vb[k] = (2.0 * into_bl / 75.0 + 2.0 * into_br / 30.0) / (1 / 75.0 + 1 / 30.0 + 0.01)
        vc[k] = (2.0 * into_c / 30.0) / (1.0 / 30.0 + 1.0 / 500.0)
        a[k], bl[k], br[k] = va[k] - into_a, vb[k] - into_bl, vb[k] - into_br
        c[k] = vc[k] - into_c
    for k in range(20):
        row = 4 * k + 2
        for name, wanted in (("v(a)", va), ("v(b)", vb), ("v(c)", vc)):
            assert solution[name][row] == pytest.approx(wanted[k], abs=1e-12), (name, k)
    assert solution.certificate.passed


def test_a_line_is_a_wire_at_the_operating_point() -> None:
    deck = "line\nV1 s 0 3\nRs s a 50\nT1 a 0 b 0 Z0=75 TD=1n\nRL b 0 100\n.tran 1n 20n\n.op\n"
    for solution in nsspice.read(deck).run():
        assert solution["v(a)"] == pytest.approx(np.full(solution.axis.size, 2.0), abs=1e-13)
        assert solution["v(b)"] == pytest.approx(np.full(solution.axis.size, 2.0), abs=1e-13)


def test_a_matched_line_into_a_capacitor() -> None:
    deck = """a wave of 0.5 V charges 10 pF through 50 Ohm
V1 s 0 PULSE(0 1 0 0 0 1 2)
Rs s a 50
T1 a 0 b 0 Z0=50 TD=1n
C1 b 0 10p
.tran 0.1n 5n
.options reltol=1e-8
"""
    solution = nsspice.tran(nsspice.read(deck))
    t = solution.time * 1e9
    charged = np.where(t > 1.0, 1.0 - np.exp(-np.maximum(t - 1.0, 0.0) / 0.5), 0.0)
    assert np.abs(solution["v(b)"] - charged).max() <= 1e-6  # steps of 1e-8 each
    # what comes back after 2 ns
    back = np.where(t > 2.0, 0.5 - np.exp(-np.maximum(t - 2.0, 0.0) / 0.5), 0.0)
    edges = (np.abs(t - 2.0) > 1e-6) & (t > 0.0)
    assert np.abs(solution["v(a)"] - 0.5 - back)[edges].max() <= 1e-6
    assert solution.certificate.passed


def test_a_delayed_sine() -> None:
    deck = """what was there 3.3 ms ago
V1 a 0 SIN(0 1 50)
B1 b 0 V={delay(v(a), 3.3m)}
R1 b 0 1
G1 0 c VALUE={absdelay(2*v(a), 1m, 5m) - v(b)}
R2 c 0 1
.tran 0.1m 40m
"""
    solution = nsspice.tran(nsspice.read(deck))
    t = solution.time

    def sine(late: float) -> np.ndarray:
        return np.where(t > late, np.sin(100.0 * np.pi * (t - late)), 0.0)

    # polynomials of a sixth of the row distance at most
    assert np.abs(solution["v(b)"] - sine(3.3e-3)).max() <= 1e-6
    assert np.abs(solution["v(c)"] - 2.0 * sine(1e-3) + sine(3.3e-3)).max() <= 3e-6
    assert solution.certificate.passed


def test_a_delay_equation_by_the_method_of_steps() -> None:
    deck = """x' = -x(t - 1), nothing before
C1 x 0 1 IC=1
B1 0 x I={-delay(v(x), 1)}
.tran 0.01 4 uic
.options reltol=1e-8
"""
    solution = nsspice.tran(nsspice.read(deck))
    t = solution.time
    # 1 - (t - 1) + (t - 2)^2/2 - (t - 3)^3/6, each from its own instant on
    wanted = 1.0 + sum(
        (-1.0) ** k * np.maximum(t - k, 0.0) ** k / math.factorial(k) for k in (1, 2, 3)
    )
    assert np.abs(solution["v(x)"] - wanted).max() <= 1e-6
    assert solution.certificate.passed


def test_a_controller_samples_what_is_late() -> None:
    deck = """a sampled loop around a delay
Vset u 0 0
B1 y 0 V={delay(v(u), 0.25)}
R1 y 0 1
.tran 0.05 4.01 uic
"""
    seen = []

    def law(time, values):
        seen.append(values[0])
        return 1.0 - 0.5 * values[0]

    controller = Controller(0.4, ["v(y)"], ["vset"], law)
    solution = nsspice.tran(nsspice.read(deck), controllers=[controller])
    wanted, y = [], 0.0
    for _ in range(11):
        wanted.append(y)
        y = 1.0 - 0.5 * y
    assert seen == pytest.approx(wanted, abs=1e-12)
    assert solution.certificate.passed


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("T1 a 0 b 0 Z0=50", "NS1008"),
        ("T1 a 0 b 0 TD=1n", "NS1008"),
        ("T1 a 0 b 0 Z0=50 TD=0", "NS1025"),
        ("T1 a 0 b 0 Z0=-50 TD=1n", "NS1025"),
        ("T1 a 0 b 0 Z0=50 TD=1n IC=1,0,0,0", "NS1002"),
        ("B1 a 0 V={delay(v(b))}", "NS1022"),
        ("B1 a 0 V={delay(v(b), 0)}", "NS1025"),
        ("B1 a 0 V={delay(v(b), v(a))}", "NS1025"),
    ],
)
def test_lines_that_are_refused(line: str, code: str) -> None:
    with pytest.raises(NsspiceError) as error:
        nsspice.read(f"x\n{line}\nRa a 0 1\nRb b 0 1\n")
    assert error.value.code == code


def test_analyses_that_know_no_delays_refuse() -> None:
    deck = "x\nV1 s 0 SIN(0 1 50)\nRs s a 50\nT1 a 0 b 0 Z0=50 TD=1m\nCL b 0 1u\n"
    circuit = nsspice.read(deck + ".tran 1m 20m\n")
    for analysis in (
        lambda: nsspice.pss(circuit),
        lambda: nsspice.pss(circuit, 0.02),
        lambda: nsspice.ac(circuit, [1e3], period=0.02),
        lambda: nsspice.start(circuit),
        lambda: nsspice.tran(circuit, method="modewise"),
        lambda: nsspice.tran(circuit, method="moreau"),
    ):
        with pytest.raises(UsageError):
            analysis()


def test_small_signals_are_late() -> None:
    """A line and 1 pF in closed form, beside a delayed integral whose loop gain has a phase."""
    circuit = nsspice.read("""line
V1 s 0 AC 1
Rs s a 20
T1 a 0 b 0 Z0=50 TD=1n
C1 b 0 10p
B1 y 0 V={v(s) - delay(v(x), 0.1n)}
R2 y x 1k
C2 x 0 1p
""")
    f = np.array([1e6, 2.7e8, 1e10])
    found, w = nsspice.ac(circuit, f), 2j * np.pi * f
    load = 1.0 / (w * 10e-12)
    turn = np.tanh(w * 1e-9)
    seen = 50.0 * (load + 50.0 * turn) / (50.0 + load * turn)
    near = seen / (20.0 + seen)
    far = near / (np.cosh(w * 1e-9) + 50.0 / load * np.sinh(w * 1e-9))
    assert found["v(a)"] == pytest.approx(near, rel=1e-12)
    assert found["v(b)"] == pytest.approx(far, rel=1e-12)
    # sixty turns at 10 GHz: their rounding
    loop = 1.0 / (1.0 + w * 1e-9)
    assert found["v(x)"] == pytest.approx(loop / (1.0 + loop * np.exp(-w * 0.1e-9)), rel=1e-12)


def test_many_lines_in_a_row() -> None:
    """Sparse equations: 60 matched lines of 1 ns are one of 60 ns."""
    lines = [f"T{k} n{k} 0 n{k + 1} 0 Z0=50 TD=1n" for k in range(60)]
    deck = "\n".join(["chain", "V1 s 0 AC 1", "R1 s n0 50", *lines, "R2 n60 0 50"])
    f = np.array([1e7, 3.3e8])
    found = nsspice.ac(nsspice.read(deck), f, signals=["v(n60)"])["v(n60)"]
    assert found == pytest.approx(0.5 * np.exp(-2j * np.pi * f * 60e-9), rel=1e-11)
