"""Periodic steady states against matrix exponentials, closed forms, and many periods run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from decks.steady import (
    DISCONTINUOUS,
    LLC,
    PHASE_SHIFTED,
    SERIES_RESONANT,
    THREE_PHASE,
)
from scipy.linalg import expm
from scipy.optimize import brentq, fsolve

import nsspice

NETLISTS = Path(__file__).parents[3] / "netlists"


def flow(A: np.ndarray, b: np.ndarray, x: np.ndarray, t: float) -> np.ndarray:
    """Return x(t) of x' = A x + b."""
    n = len(b)
    M = np.zeros((n + 1, n + 1))
    M[:n, :n], M[:n, n] = A, b
    return (expm(M * t) @ np.append(x, 1.0))[:n]


def circuit(path: str) -> nsspice.Circuit:
    return nsspice.read((NETLISTS / path).read_text("utf-8"))


def with_pss(path: str) -> nsspice.Circuit:
    """Return a netlist with .pss in place of its transient and the measures of it."""
    lines = (NETLISTS / path).read_text("utf-8").splitlines()
    kept = [line for line in lines if not line.startswith((".tran", ".measure", ".end"))]
    return nsspice.read("\n".join([*kept, ".pss"]))


def two_states(L: float, C: float, R: float) -> np.ndarray:
    return np.array([[0.0, -1.0 / L], [1.0 / C, -1.0 / (R * C)]])


def test_a_buck_in_continuous_conduction() -> None:
    L, C, R, T, D, V = 100e-6, 100e-6, 5.0, 10e-6, 0.5, 24.0
    A = two_states(L, C, R)
    on, off = np.array([V / L, 0.0]), np.zeros(2)
    phi = expm(A * T)
    rest = flow(A, off, flow(A, on, np.zeros(2), D * T), (1.0 - D) * T)
    x = np.linalg.solve(np.eye(2) - phi, rest)
    sol = nsspice.pss(with_pss("converters/buck.net"), row_step=T / 10)
    for k in range(11):
        t = k * T / 10
        y = flow(A, on, x, t) if t <= D * T else flow(A, off, flow(A, on, x, D * T), t - D * T)
        # 1e-12: rounding of the exponentials over 1 - 0.985, the distance of the multipliers from 1
        assert abs(sol["i(l1)"][k] - y[0]) < 1e-12 * 3.0
        assert abs(sol["v(out)"][k] - y[1]) < 1e-12 * 12.0
    found = np.array(sol.periodic.multipliers)
    assert np.allclose(np.sort_complex(found), np.sort_complex(np.linalg.eigvals(phi)), atol=1e-13)
    assert sol.periodic.verdict == "stable"
    assert sol.periodic.steps <= 2  # the instants are fixed by sources: the map is linear


def test_a_boost_and_a_buck_boost() -> None:
    L, C, R, T, V = 100e-6, 100e-6, 10.0, 10e-6, 12.0
    for path, off_drive in (("boost", V / L), ("buck_boost", 0.0)):
        circuit_ = with_pss(f"converters/{path}.net")
        values = {e.name: e.value for e in circuit_.deck.elements if e.letter in "rlc"}
        L, C = values["l1"], values["c1"]
        R = next(v for n, v in values.items() if n.startswith("r"))
        V = next(e.source.dc for e in circuit_.deck.elements if e.name == "vin")
        sol = nsspice.pss(circuit_, row_step=T / 10)
        store = np.array([[0.0, 0.0], [0.0, -1.0 / (R * C)]])
        give = two_states(L, C, R)
        sign = 1.0 if path == "boost" else -1.0
        on, off = np.array([V / L, 0.0]), np.array([off_drive, 0.0])
        half = flow(store, on, np.zeros(2), T / 2)
        rest = flow(give, off, half, T / 2)
        x = np.linalg.solve(np.eye(2) - expm(give * T / 2) @ expm(store * T / 2), rest)
        assert abs(sol["i(l1)"][0] - x[0]) < 1e-11 * abs(x[0])
        assert abs(sign * sol["v(out)"][0] - x[1]) < 1e-11 * abs(x[1])


def test_a_buck_in_discontinuous_conduction() -> None:
    L, C, R, T, V = 10e-6, 2e-6, 50.0, 10e-6, 24.0
    A, decay = two_states(L, C, R), np.array([[0.0, 0.0], [0.0, -1.0 / (R * C)]])
    on, off = np.array([V / L, 0.0]), np.zeros(2)

    def period(v: float) -> float:
        top = flow(A, on, np.array([0.0, v]), 0.3 * T)
        stop = brentq(lambda t: flow(A, off, top, t)[0], 1e-9, 0.7 * T, xtol=1e-20, rtol=1e-15)
        return float(flow(decay, off, flow(A, off, top, stop), 0.7 * T - stop)[1])

    v = brentq(lambda v: period(v) - v, 10.0, 23.9, xtol=1e-14, rtol=1e-15)
    sol = nsspice.pss(nsspice.read(DISCONTINUOUS))
    assert abs(sol["v(out)"][0] - v) < 1e-11 * v
    assert abs(sol["i(l1)"][0]) < 1e-15
    # the diode's turn-off moves with the state: the multiplier contains its saltation matrix
    h = 1e-4
    slope = (period(v + h) - period(v - h)) / (2.0 * h)
    multipliers = [m for m in sol.periodic.multipliers if abs(m) > 1e-12]
    # central differences err by h^2 times the third derivative, and 1e-15 v/h of rounding
    assert len(multipliers) == 1
    assert abs(multipliers[0] - slope) < 1e-8


def test_a_free_period() -> None:
    """The hysteretic buck: period, orbit and multipliers by shooting with matrix exponentials."""
    V, L, Rc, C, R = 12.0, 22e-6, 50e-3, 47e-6, 2.5
    k = R / (R + Rc)
    A = np.array([[-Rc * k / L, -k / L], [k / C, -k / (R * C)]])
    out = np.array([Rc * k, k])
    on, off = np.array([V / L, 0.0]), np.zeros(2)

    def cycle(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, (t1, t2) = u[:2], u[2:] * 1e-5
        top = flow(A, on, x, t1)
        return top, flow(A, off, top, t2)

    def equations(u: np.ndarray) -> np.ndarray:
        top, end = cycle(u)
        return np.array([out @ u[:2] - 4.95, out @ top - 5.05, *(end - u[:2])])

    u = fsolve(equations, [1.0, 5.0, 0.6, 0.9], xtol=1e-13)
    period = (u[2] + u[3]) * 1e-5
    sol = nsspice.pss(circuit("steady/hysteretic_buck.net"))
    assert abs(sol.periodic.period - period) < 1e-11 * period
    assert abs(sol["i(l1)"][0] - 2.0) < 1e-14  # where the trigger is
    # the period map at the section v(out) = 4.95 V, by central differences
    direction = np.array([out[1], -out[0]]) / np.hypot(*out)

    def after(x: np.ndarray) -> np.ndarray:
        t1 = brentq(lambda t: out @ flow(A, on, x, t) - 5.05, 1e-6, 1e-5, xtol=1e-19, rtol=1e-15)
        top = flow(A, on, x, t1)
        t2 = brentq(lambda t: out @ flow(A, off, top, t) - 4.95, 1e-6, 3e-5, xtol=1e-19, rtol=1e-15)
        return flow(A, off, top, t2)

    h = 1e-4
    slope = (after(u[:2] + h * direction) - after(u[:2] - h * direction)) @ direction / (2.0 * h)
    assert len(sol.periodic.multipliers) == 1
    assert abs(sol.periodic.multipliers[0] - slope) < 1e-7


@pytest.mark.parametrize(("vo", "verdict"), [(4.0, "stable"), (4.9, "stable"),
                                             (6.0, "unstable: period doubling")])  # fmt: skip
def test_peak_current_control_doubles_its_period_beyond_half_duty(vo: float, verdict: str) -> None:
    text = (NETLISTS / "steady/peak_current.net").read_text("utf-8").replace("vo=4", f"vo={vo}")
    sol = nsspice.pss(nsspice.read(text))
    assert sol.periodic.verdict == verdict
    assert abs(sol.periodic.multipliers[0] + vo / (10.0 - vo)) < 1e-11
    assert abs(sol["i(l1)"][0] - (3.0 - vo * (1.0 - vo / 10.0) * 10e-6 / 20e-6)) < 1e-11


@pytest.mark.parametrize(
    ("text", "period", "periods"),
    [
        (LLC, 1.0 / 90e3, 800),
        (SERIES_RESONANT, 10e-6, 300),
        (PHASE_SHIFTED, 10e-6, 300),
        (THREE_PHASE, 20e-3, 40),
        ("steady/cuk.net", 10e-6, 1500),
        ("steady/sepic.net", 10e-6, 5000),
        ("converters/flyback.net", 10e-6, 2000),
    ],
    ids=["llc", "series", "bridge", "rectifier", "cuk", "sepic", "flyback"],
)
def test_the_orbit_is_where_many_periods_lead(text: str, period: float, periods: int) -> None:
    deck = text if "\n" in text else (NETLISTS / text).read_text("utf-8")
    lines = [x for x in deck.splitlines() if not x.startswith((".tran", ".measure", ".pss"))]
    network = nsspice.read("\n".join(lines))
    sol = nsspice.pss(network, row_step=period / 16)
    largest = abs(sol.periodic.multipliers[0])
    assert largest**periods < 1e-12, largest
    assert sol.periodic.steps <= 8
    begin = (periods - 1) * period
    run = nsspice.tran(network, begin + period, period / 16, start=begin, uic=True)
    for name in sol.columns:
        swing = max(float(np.abs(run[name]).max()), 1e-300)
        inner = slice(1, 16)  # at the ends sources jump, and rows hold one side of it
        apart = np.abs(sol[name][inner] - run[name][inner])
        # a row may stand at an instant of switching, known to the rounding of the time
        assert np.sort(apart)[:-2].max() < 1e-11 * swing, name


def test_a_run_begins_in_the_steady_state() -> None:
    text = DISCONTINUOUS + ".tran 1u 100u start=pss\n"
    (run,) = nsspice.read(text).run()
    once = run["v(out)"]
    assert np.abs(once[10:21] - once[0:11]).max() < 1e-12 * once.max()
    assert np.abs(once[90:101] - once[0:11]).max() < 1e-12 * once.max()


def test_a_sweep_goes_on_from_its_neighbour() -> None:
    text = LLC + ".pss\n.step param f list 90k 91k 92k\n"
    solutions = nsspice.read(text).run()
    for sol, f in zip(solutions, (90e3, 91e3, 92e3), strict=True):
        assert abs(sol.periodic.period * f - 1.0) < 1e-15
        alone = nsspice.pss(nsspice.read(LLC.replace("f=90k", f"f={f}")))
        assert abs(alone["v(o)"][0] - sol["v(o)"][0]) < 1e-11 * sol["v(o)"][0]
    assert solutions[2].periodic.periods < solutions[0].periodic.periods


def test_a_free_charge_is_named() -> None:
    sol = nsspice.pss(with_pss("converters/dual_active_bridge.net"))
    assert sol.periodic.verdict == "neutral"
    assert {"lk", "l1"} <= set(sol.periodic.free)
    assert [w.code for w in sol.warnings].count("NS3061") == 1


@pytest.mark.parametrize("star", ["1meg", "1g"])
def test_a_star_point_on_a_large_resistance(star: str) -> None:
    """No current flows there: all differences are those with 1 kOhm, and the certificate holds.

    The common potential is a sum of currents times the resistance, of which both sides of a branch
    have the rounding.
    """
    near = nsspice.pss(nsspice.read(THREE_PHASE))
    far = nsspice.pss(nsspice.read(THREE_PHASE.replace("Rn n 0 1k", f"Rn n 0 {star}")))
    assert far.certificate.passed
    for name in ("i(la)", "i(lb)", "i(d1)", "i(d4)"):
        assert np.abs(far[name] - near[name]).max() < 1e-11 * np.abs(near[name]).max()
    # sums of currents of 15 A known to some units of rounding, times the resistance
    resistance = float(star.replace("meg", "e6").replace("1g", "1e9"))
    apart = np.abs((far["v(p)"] - far["v(m)"]) - (near["v(p)"] - near["v(m)"])).max()
    assert apart < 1e-11 * 490.0 + 100.0 * 2.2e-16 * 15.0 * resistance


@pytest.mark.parametrize("vref", [5, 12, 19])
@pytest.mark.parametrize(
    "control",
    [
        "Rf out n 10k\nRz n z 100\nCz z c 1u\nE1 c 0 ref n 1e4",
        "G1 0 c ref out 0.1m\nRz c z 100\nCz z 0 1u",  # which nothing pulls back
        "Rf out n 10k\nRff out x 500\nCff x n 3.3n\nRz n z 4.7k\nCz z c 10n\nCp n c 220p\n"
        "E1 c 0 ref n 1e5",
    ],
)
def test_closed_loops_from_rest_in_few_steps(control: str, vref: float) -> None:
    """The integrator is wound up by the start, and its mean decides: the output is the reference.

    From rest the switch is stuck for a thousand periods, in which no step of Newton's method leads
    anywhere; the guards tell how far to go.
    """
    sol = nsspice.pss(
        nsspice.read(f"""Buck with an integrating controller
Vin in 0 24
S1 in sw c saw SWITCH
D1 0 sw
Vsaw saw 0 PULSE(0 1 0 10u 0 0 10u)
L1 sw out 100u
C1 out 0 100u
R1 out 0 1
Vref ref 0 {vref}
{control}
.model SWITCH SW(VT=0)
""")
    )
    assert sol.periodic.steps <= 8
    assert sol.periodic.residual < 1e-14
    assert sol.periodic.verdict == "stable"
    # a gain of 1e4 leaves the control voltage, below 1 V, over the gain
    assert abs(sol.average("v(out)") - vref) < 1.0 / 1e4


@pytest.mark.parametrize(
    ("lines", "code", "words"),
    [
        (["I1 0 c PULSE(0 1 0 0 0 1m 20m)", "C1 c 0 1u", ".pss"], "NS3062", "c1"),
        (["V1 a 0 5", "R1 a b 1k", "C1 b 0 1u", ".pss"], "NS4015", "no source is periodic"),
        (["V1 a 0 SIN(0 1 1k)", "V2 b 0 SIN(0 1 1414.2135623)", "R1 a b 1", "C1 b 0 1u", ".pss"],
         "NS4015", "no common period"),
        (["V1 a 0 SIN(0 1 1k)", "R1 a b 1", "C1 b 0 1u", ".pss period=1.5m"], "NS4005", "multiple"),
        (["V1 a 0 5", "R1 a b 1k", "C1 b 0 1u", ".pss trigger=v(b) level=2"], "NS3062", "v(b)"),
    ],
)  # fmt: skip
def test_errors_say_why(lines: list[str], code: str, words: str) -> None:
    with pytest.raises(nsspice.NsspiceError) as caught:
        nsspice.read("\n".join(["errors", *lines])).run()
    (found,) = caught.value.diagnostics
    assert found.code == code
    assert words in found.message
    assert found.span is not None


def test_switches_that_move_apart_have_no_single_derivative() -> None:
    """Two equal rectifiers switch together, but each for itself: a perturbation parts them."""
    text = """twins
V1 a 0 SIN(0 10 1k)
R0 a s 1
R1 s b 10
D1 b c
C1 c 0 10u
R2 c 0 100
R3 s d 10
D2 d e
C2 e 0 10u
R4 e 0 100
.pss
"""
    with pytest.raises(nsspice.NumericalError) as caught:
        nsspice.read(text).run()
    (found,) = caught.value.diagnostics
    assert found.code == "NS3060"
    assert "d1, d2" in found.message
