"""Junctions as broken lines: their bound, its order, closed forms, and what is refused."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import quad, solve_ivp
from scipy.special import lambertw

import nsspice
from nsspice.cli.app import app
from nsspice.devices.diodes.junction import JunctionLaw
from nsspice.devices.diodes.junction_lines import JunctionLines, Settings, junction_lines
from nsspice.devices.stamper import Conditions

#: k T / q at 27 degrees Celsius (CODATA 2018)
VT = 1.380649e-23 * 300.15 / 1.602176634e-19
IS, N, RS = 1e-9, 1.7, 0.05
CARD = f"D(IS={IS} N={N} RS={RS})"
#: the bound is met by pieces whose ends are found to 2^-12 of their length, at second order
FOUND = 1.001


def current(v: np.ndarray, rs: float = RS) -> np.ndarray:
    """Return the current of the junction behind a resistance, by Lambert's W."""
    a = N * VT
    # W(exp(x)) by its asymptotic series and Newton's method where exp overflows
    x = (v + rs * IS) / a + math.log(rs * IS / a)
    w = np.where(x < 500.0, lambertw(np.exp(np.minimum(x, 500.0))).real, x - np.log(np.abs(x)))
    for _ in range(6):
        w = np.where(x < 500.0, w, w - (w + np.log(np.abs(w)) - x) / (1.0 + 1.0 / w))
    return np.asarray(a / rs * w - IS)


def lines(tolerance: float, **card: float) -> JunctionLines:
    junction = JunctionLaw(**{"is_": IS, "n": N, "rs": RS, **card}).at(Conditions(), None, 0.0)
    return junction_lines(junction, Settings(tolerance, 1.0, 20.0))


def behind(found: JunctionLines, ohms: float, v: float) -> float:
    """Return the current of the lines behind a resistance, by bisection."""
    low, high = min(v, 0.0), max(v, 0.0)
    for _ in range(60):
        u = 0.5 * (low + high)
        low, high = (u, high) if u + ohms * found.current.at(u) < v else (low, u)
    return (v - low) / ohms if v > 0.0 else found.current.at(low)


@pytest.mark.parametrize("tolerance", [0.2, 0.05, 0.01, 1e-3])
def test_the_current_differs_by_the_tolerance_at_most(tolerance: float):
    found = lines(tolerance)
    scale = N * VT / RS
    assert found.scales[0] == pytest.approx(scale, rel=1e-12)
    # up to a million amperes: a bound of a law is none of a range
    volts = np.concatenate([np.linspace(-1.0, 2.0, 301), np.geomspace(2.0, 5e4, 60)])
    exact = current(volts)
    line = np.array([behind(found, RS, float(v)) for v in volts])
    errors = np.abs(line - exact) / np.maximum(scale, np.abs(exact))
    assert errors.max() <= FOUND * tolerance
    # and it is used up: fewer pieces would not do
    assert errors.max() >= 0.9 * tolerance
    assert found.current.error == pytest.approx(tolerance, rel=1e-3)


@pytest.mark.parametrize("ohms", [RS, 0.0])
def test_the_characteristic_has_the_points_of_the_lines(ohms: float):
    card = f"D(IS={IS} N={N} RS={ohms} BV=8 IBV=1m)"
    circuit = nsspice.read(
        f"x\nV1 a 0 1\nD1 a 0 d 2\n.model d {card}\n.options junctions=lines:0.02\n.op\n"
    )
    (_, body), *_ = circuit.device("d1").bodies()
    found, curve = body.lines(), circuit.device("d1").curve(Conditions())
    assert len(curve.vertices) == len(found.current.forward) + len(found.current.reverse)
    for v in (-8.6, -8.3, -1.0, 0.4, 0.7, 0.9, 5.0):
        # two junctions in parallel, each behind its resistance
        i = found.current.at(v)
        total = v + ohms * i
        size = 1e-13 * (abs(total) + abs(i))
        assert curve.contains(2.0 * i, total, size), v
        assert not curve.contains(2.0 * i + 1e-3, total, size), v


def test_the_error_is_of_second_order_in_the_number_of_pieces():
    tolerances = np.array([1e-2, 1e-3, 1e-4])
    pieces = np.array([len(lines(float(t)).current.forward) for t in tolerances])
    orders = np.diff(np.log(tolerances)) / -np.diff(np.log(pieces))
    # the first and the last piece are no part of the integral that pieces share
    assert orders == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("tolerance", [0.1, 0.01])
def test_the_charge_differs_by_the_tolerance_at_most(tolerance: float):
    cjo, vj, m = 60e-12, 0.8, 0.4
    found = lines(tolerance, cjo=cjo, vj=vj, m=m)
    volts = np.linspace(-200.0, 0.39, 801)  # ten times the usual voltage; to fc vj
    exact = cjo * vj / (1.0 - m) * (1.0 - (1.0 - volts / vj) ** (1.0 - m))
    line = np.array([found.charge(float(v)) for v in volts])
    scale = cjo * vj / (1.0 - m) * ((1.0 + 20.0 / vj) ** (1.0 - m) - 1.0)
    errors = np.abs(line - exact) / np.maximum(scale, np.abs(exact))
    assert errors.max() <= FOUND * tolerance
    assert found.scales[1] == pytest.approx(scale, rel=1e-12)


def test_breakdown_is_bounded_as_the_forward_direction_is():
    found = lines(0.02, bv=50.0)
    scale, a = N * VT / RS, N * VT
    # i(-BV) = -IBV = -1 mA, and an exponential beyond
    for ampere in (0.01, 0.3, 3.0, 300.0):
        v = 50.0 + a * math.log(ampere / 1e-3) + RS * ampere
        line = -behind_reverse(found, v)
        assert abs(line - ampere) <= FOUND * 0.02 * max(scale, ampere) + 2e-3


def behind_reverse(found: JunctionLines, v: float) -> float:
    low, high = 0.0, v
    for _ in range(60):
        u = 0.5 * (low + high)
        low, high = (u, high) if u - RS * found.current.at(-u) < v else (low, u)
    return found.current.at(-low)


def rectifier(options: str = "", card: str = CARD) -> str:
    return (
        f"half wave\nV1 in 0 SIN(0 5 1k)\nD1 in out DM\nR1 out 0 10\n.model DM {card}\n"
        f".tran 10u 1m\n.measure tran mean avg v(out)\n{options}\n"
    )


def test_the_average_of_a_rectifier_converges_to_its_integral():
    """Half a sine behind a junction and 10 Ohm: the integral of Lambert's W over a period."""
    exact = 10.0 * quad(
        lambda x: float(current(np.array(5.0 * math.sin(x)), 10.0 + RS)), 0.0, 2.0 * math.pi,
        epsabs=1e-13, limit=200, points=[math.pi],
    )[0] / (2.0 * math.pi)  # fmt: skip
    tolerances, errors = (0.1, 2e-3, 2e-4), []
    for tolerance in tolerances:
        circuit = nsspice.read(rectifier(), junctions=f"lines:{tolerance}")
        solution = circuit.run()[0]
        assert solution.islands[0].method == "modewise"
        assert solution.certificate.passed
        assert not solution.certificate.several
        errors.append(abs(solution.measures["mean"] - exact))
        # 10 Ohm see a smaller difference than the card's own resistance does
        assert errors[-1] <= 10.0 * tolerance * N * VT / RS
    # in the number of pieces of second order, and so of first in the tolerance
    assert errors[2] == pytest.approx(0.1 * errors[1], rel=0.2)
    assert errors[0] < 2e-3 * exact


def test_recovery_follows_the_differential_equation():
    """Diffusion and depletion charge, a resistor and an inductance, turned off by a ramp."""
    cjo, tt, ohms, henries = 2e-9, 50e-9, 10.0, 1e-6
    card = f"D(IS={IS} N={N} RS={RS} CJO={cjo} VJ=1 M=0.5 TT={tt})"
    deck = (
        f"recovery\nV1 in 0 PWL(0 10 100n 10 150n -10 1 -10)\nR1 in a {ohms}\nL1 a b {henries}\n"
        f"D1 b 0 DM\n.model DM {card}\n.tran 2n 800n\n"
    )
    a = N * VT

    def law(v: float) -> tuple[float, float]:
        e = math.exp(v / a)
        c = cjo / math.sqrt(1.0 - v) if v < 0.5 else cjo * math.sqrt(2.0) * (0.5 + v)
        return IS * (e - 1.0), c + tt * IS * e / a

    def rates(t: float, y: np.ndarray) -> list[float]:
        source = float(np.interp(t, [100e-9, 150e-9], [10.0, -10.0]))
        i, c = law(y[1])
        return [(source - (ohms + RS) * y[0] - y[1]) / henries, (y[0] - i) / c]

    solution = nsspice.read(deck, junctions="lines:0.001").run()[0]
    start = float(current(np.array(10.0), ohms + RS))
    exact = solve_ivp(rates, (0.0, 800e-9), [start, a * math.log1p(start / IS)], "Radau",
                      solution.time, rtol=1e-9, atol=1e-12)  # fmt: skip
    errors = []
    for tolerance in (0.05, 0.005):
        solution = nsspice.read(deck, junctions=f"lines:{tolerance}").run(signals=["i(l1)"])[0]
        assert solution.stats["fixed_steps"] == 0
        assert solution.certificate.passed
        errors.append(float(np.sqrt(np.mean((solution["i(l1)"] - exact.y[0]) ** 2))))
    reach = float(np.ptp(exact.y[0]))
    # charges within 5 % move the instants at which the current turns by as much
    assert errors[0] < 0.05 * reach
    assert errors[1] < 0.2 * errors[0]


def test_pairs_are_those_of_a_passive_network_without_charge():
    circuit = nsspice.read(rectifier(), junctions="lines")
    system = circuit.islands[0].assemble().system
    assert system.passive
    assert system.smooth is None


def test_option_keyword_and_flag_say_the_same(tmp_path):
    by_option = nsspice.read(rectifier(".options junctions=lines:0.02"))
    by_keyword = nsspice.read(rectifier(), junctions="lines:0.02")
    assert by_option.broken_junctions() == by_keyword.broken_junctions()
    assert by_keyword.broken_junctions()["d1"]["tolerance"] == 0.02
    # the caller goes before the deck
    smooth = nsspice.read(rectifier(".options junctions=lines"), junctions="model")
    assert smooth.broken_junctions() == {}
    file = tmp_path / "a.net"
    file.write_text(rectifier())
    arguments = [
        "run",
        str(file),
        "--junctions",
        "lines:0.02",
        "--json",
        "-o",
        str(tmp_path / "a.csv"),
    ]
    result = CliRunner().invoke(app, arguments)
    data = json.loads(result.stdout)
    assert data["junctions"] == by_option.broken_junctions()
    (warning,) = (w for w in data["warnings"] if w["code"] == "NS2065")
    assert "current within 0.02 of 0.879 A" in warning["message"]


def test_a_sweep_of_a_parameter_keeps_the_lines():
    text = rectifier(".step param r 5 10 5").replace("R1 out 0 10", "R1 out 0 {r}\n.param r=1")
    for solution in nsspice.read(text, junctions="lines").run():
        assert solution.islands[0].method == "modewise"


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ("junctions=curves", "NS1010"),
        ("junctions=lines:2", "NS1010"),
        ("junctions=lines:x", "NS1010"),
    ],
)
def test_what_is_no_tolerance_is_an_error(options: str, code: str):
    with pytest.raises(nsspice.NetlistError) as caught:
        nsspice.read(rectifier(f".options {options}"))
    assert caught.value.diagnostics[0].code == code
    with pytest.raises(nsspice.UsageError) as usage:
        nsspice.read(rectifier(), junctions=options.partition("=")[2])
    assert usage.value.diagnostics[0].code == "NS4005"


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("M1 out g 0 0 X\n.model X NMOS(VTO=1 KP=1)", "mosfet=switch"),
        ("Q1 out g 0 X\n.model X NPN(BF=100)", "alphaN"),
        ("J1 out g 0 X\n.model X NJF(VTO=-1)", "junctions=lines"),
        ("D2 out g X V={0.1*i}\n.model X D(IS=1n)", "V="),
    ],
)
def test_other_semiconductors_are_refused_by_name(line: str, hint: str):
    with pytest.raises(nsspice.NetlistError) as caught:
        nsspice.read(rectifier(f"{line}\nVg g 0 1"), junctions="lines")
    (found,) = caught.value.diagnostics
    assert found.code == "NS2066"
    assert line.split()[0].lower() in found.message
    assert hint in found.hint


def test_the_end_of_the_bound_is_told():
    # without RS: up to a thousand times 5 V over 10 Ohm
    fine = nsspice.read(rectifier(card="D(IS=1n)"), junctions="lines").run()[0]
    assert not [w for w in fine.warnings if w.code == "NS5007"]
    far = rectifier(card="D(IS=1n)").replace("R1 out 0 10", "R1 out 0 10\nI1 0 in SIN(0 90k 1k)")
    far = far.replace("V1 in 0 SIN(0 5 1k)", "V1 ref 0 5\nR2 ref 0 1\nR3 in 0 1")
    (warning,) = (
        w for w in nsspice.read(far, junctions="lines").run()[0].warnings if w.code == "NS5007"
    )
    assert warning.message.startswith("d1:")


def test_diodes_inside_transistors_and_switches_are_lines():
    deck = (
        "inside\nV1 c 0 5\nRc c k 100\nIb 0 b 1m\nQ1 k b 0 QM\n.model QM NPN(alphaN=0.99 "
        "alphaI=0.5 DE=DJ DC=DJ)\n.model DJ D(IS=1e-14 RS=0.1)\nM1 k 0 0 MM\n"
        ".model MM NMOS(VTO=2 body=DJ)\n.op\n"
    )
    circuit = nsspice.read(deck, junctions="lines:0.01")
    assert set(circuit.broken_junctions()) == {"q1.de", "q1.dc", "m1.bd"}
    exact, line = (nsspice.op(nsspice.read(deck, junctions=j)) for j in ("model", "lines:0.001"))
    # a saturated transistor: milliamperes are far below the scale of 0.26 A
    assert line["v(b)"][0] == pytest.approx(exact["v(b)"][0], abs=0.03)
