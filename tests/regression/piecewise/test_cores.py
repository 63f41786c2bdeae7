"""Windings on cores of Jiles and Atherton, against an integration of their equations by SciPy."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsspice
from nsspice.errors import NsspiceError

MU0 = 4e-7 * np.pi
AREA, PATH, TURNS = 2e-4, 0.05, 30.0  # m^2, m


def loop(ms: float, a: float, k: float, c: float, alpha: float, tip: float) -> list[np.ndarray]:
    """Density over fields from 0 to the tip, back to minus the tip, and to the tip again."""

    def rate(h: float, m: np.ndarray, way: float) -> np.ndarray:
        effective = h + alpha * m
        lag = np.maximum(way * (ms * effective / (a + np.abs(effective)) - m), 0.0)
        slope = ms * a / (a + np.abs(effective)) ** 2
        irreversible = lag / (k - alpha * lag)
        return ((1.0 - c) * irreversible + c * slope) / (1.0 - alpha * c * slope)

    found, m = [], 0.0
    for begin, end in ((0.0, tip), (tip, -tip), (-tip, tip)):
        fields = np.linspace(begin, end, 2001)
        way = np.sign(end - begin)
        done = solve_ivp(rate, (begin, end), [m], t_eval=fields, args=(way,), rtol=1e-8, atol=1e-3,
                         max_step=tip / 200)  # fmt: skip
        m = done.y[0][-1]
        found.append(np.array([fields, MU0 * (fields + done.y[0])]))
    return found


@pytest.mark.parametrize(
    ("card", "values"),
    [
        ("", (1e6, 1000.0, 500.0, 0.2, 0.0)),
        ("MS=4e5 A=26 K=18 C=0.1 LEVEL=2", (4e5, 26.0, 18.0, 0.1, 0.0)),
        ("MS=1.6e6 A=1100 K=400 C=0.2 ALPHA=5e-5", (1.6e6, 1100.0, 400.0, 0.2, 5e-5)),
    ],
)
def test_a_core_is_fitted_as_well_as_it_says(card: str, values: tuple[float, ...]) -> None:
    tip = 5.0 * (values[1] + values[2])
    peak = tip * PATH / TURNS
    circuit = nsspice.read(f"""current ramps up, down and up
I1 0 a PWL(0 0 1 {peak} 3 {-peak} 5 {peak})
L1 a 0 {TURNS}
K1 L1 0.999 iron
.model iron CORE({card} AREA={AREA * 1e4} PATH={PATH * 1e2})
B1 0 f I=v(a)
C1 f 0 1 IC=0
.tran 2m 5 uic
""")
    (note,) = [w for w in circuit.warnings if w.code == "NS1101"]
    told, first = (float(part) / 100.0 for part in re.findall(r"([\d.]+)%", note.message))
    assert 0.01 < told < 0.1
    solution = nsspice.tran(circuit)
    assert solution.certificate.passed
    time, density = solution.time, solution["v(f)"] / (TURNS * AREA)
    field = solution["i(l1)"] * TURNS / PATH
    curves = loop(*values, tip)
    top = curves[0][1][-1]
    # errors are told to a tenth of a percent; here at 250 rows of a branch, there at others
    parts = ((time < 1.0, first), ((time > 1.0) & (time < 3.0), told), (time > 3.0, told))
    for (fields, densities), (rows, error) in zip(curves, parts, strict=True):
        order = np.argsort(fields)
        expected = np.interp(field[rows], fields[order], densities[order])
        assert np.abs(density[rows] - expected).max() <= (error + 0.002) * top


def test_windings_share_a_core() -> None:
    """What magnetises a transformer gives a core alone the voltage of one turn."""
    solution = nsspice.tran(
        nsspice.read("""a transformer, and its core once more
V1 s 0 SIN(0 20 50)
R1 s a 1
L1 a 0 100
L2 b 0 50
R2 b 0 20
K1 L1 L2 1 iron
B3 0 c I={i(L1) + 0.5*i(L2)}
L3 c 0 100
K2 L3 1 iron
.model iron CORE(MS=4e5 A=26 K=18 C=0.1 AREA=10 PATH=10 GAP=0.01)
.tran 0.2m 40m uic
""")
    )
    assert solution.certificate.passed
    assert np.abs(solution["v(a)"] - 2.0 * solution["v(b)"]).max() <= 1e-12 * 20.0
    assert np.ptp(solution["i(l1)"]) > 3.0  # it saturates
    # the third winding's current is a sum of two, each known to their rounding, times 1/L of stops
    assert np.abs(solution["v(a)"] - solution["v(c)"])[1:].max() <= 1e-9 * 20.0


def test_leakage_is_what_the_coupling_leaves() -> None:
    """A short circuit at small currents: the leakage of both windings."""
    solution = nsspice.ac(
        nsspice.read("""shorted
I1 0 a AC 1
L1 a 0 10
L2 b 0 20
Rb b 0 1u
K1 L1 L2 0.9 iron
I2 0 c AC 1
L3 c 0 10
K2 L3 0.9 iron
.model iron CORE()
"""),
        [1e6],
    )
    open_, short = (abs(solution[f"v({n})"][0]) for n in "ca")
    # leakages l and 4 l on an inductance L: l + L || l, seen from the first winding
    expected = 0.1 * open_ + 1.0 / (1.0 / open_ + 1.0 / (0.1 * open_))
    assert short == pytest.approx(expected, rel=1e-6)  # 1 uOhm beside some ohms


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        ("K1 L1 1 iron\n.model iron CORE(MSAT=1)", "NS2003"),
        ("K1 L1 1 iron\n.model iron CORE(K=0)", "NS1025"),
        ("K1 L1 1 iron\n.model iron CORE(C=2)", "NS1025"),
        ("K1 L1 1 iron\n.model iron CORE(ALPHA=0.1)", "NS1025"),
        ("K1 L1 1 iron\n.model iron D(IS=1e-14)", "NS2001"),
        ("K1 L1 1 iron", "NS1060"),
        ("K1 L1 2 iron\n.model iron CORE()", "NS2010"),
        ("K1 L1 1 iron\nK2 L1 1 iron\n.model iron CORE()", "NS2010"),
        ("K1 L2 1 iron\nL2 a 0 5 IC=1\n.model iron CORE()", "NS1002"),
        ("K1 L2 1 iron\nL2 a 0 -5\n.model iron CORE()", "NS1025"),
    ],
)
def test_refused(lines: str, code: str) -> None:
    with pytest.raises(NsspiceError) as error:
        nsspice.read(f"x\nL1 a 0 10\nR1 a 0 1\n{lines}\n")
    assert error.value.code == code


def test_an_operating_point_is_not_magnetised() -> None:
    """What nothing else decides at DC: a run without uic rises along the initial curve."""
    deck = """a ramp of the current
I1 0 a {source}
L1 a 0 10
K1 L1 1 iron
.model iron CORE()
.tran 1m 1{uic}
"""
    runs = [
        nsspice.tran(nsspice.read(deck.format(source="PWL(0 0 1 4)", uic=uic)))
        for uic in ("", " uic")
    ]
    # both begin without any flux; 1e-9 of a volt of 1e-4 is what the first row's side of 0 s leaves
    assert runs[0]["v(a)"][1:] == pytest.approx(runs[1]["v(a)"][1:], rel=1e-9)
