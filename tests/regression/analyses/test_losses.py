"""Average powers: a buck with resistances by matrix exponentials, jumps, and the certificate."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm

import nsspice
from nsspice.analyses.averages.recorded_integrals import RecordedIntegrals

LOSSY = """Buck with resistances
Vin in 0 24
S1 in sw g 0 SH
D1 0 sw DX
L1 sw x 100u
RL x out 20m
C1 out 0 100u
R1 out 0 5
Vg g 0 PULSE(-1 1 0 0 0 5u 10u)
.model SH SW(VT=0 RON=30m)
.model DX D(Ron=10m Vfwd=0.6)
.pss
.measure pss pd AVG p(d1)
.measure pss effective RMS i(L1)
.measure pss v AVG v(out)
"""


def request(**more):  # type: ignore[no-untyped-def]
    from nsspice.analyses import Request

    return Request(power=True, **more)


def table(text: str, **more):  # type: ignore[no-untyped-def]
    from nsspice.analyses import jobs_of, run_job

    network = nsspice.read(text)
    return run_job(network, jobs_of(network.deck)[-1], request(**more))


def exact_buck() -> dict[str, float]:
    L, C, R, T = 100e-6, 100e-6, 5.0, 10e-6

    def matrix(r: float) -> np.ndarray:
        return np.array([[-(r + 20e-3) / L, -1 / L], [1 / C, -1 / (R * C)]])

    parts = [(matrix(30e-3), np.array([24.0 / L, 0.0])), (matrix(10e-3), np.array([-0.6 / L, 0.0]))]

    def flow(part: int, x: np.ndarray, t: float) -> np.ndarray:
        M = np.zeros((3, 3))
        M[:2, :2], M[:2, 2] = parts[part]
        return (expm(M * t) @ np.append(x, 1.0))[:2]

    half = T / 2
    phi = expm(parts[1][0] * half) @ expm(parts[0][0] * half)
    x0 = np.linalg.solve(np.eye(2) - phi, flow(1, flow(0, np.zeros(2), half), half))
    x1 = flow(0, x0, half)

    def mean(part: int, start: np.ndarray, f) -> float:  # type: ignore[no-untyped-def]
        return quad(lambda t: f(flow(part, start, t)), 0.0, half, epsabs=1e-16, epsrel=1e-13)[0] / T

    on, off = (mean(0, x0, lambda x: x[0] ** 2), mean(1, x1, lambda x: x[0] ** 2))
    charge = mean(0, x0, lambda x: x[0])
    forward = mean(1, x1, lambda x: x[0])
    load = mean(0, x0, lambda x: x[1] ** 2) + mean(1, x1, lambda x: x[1] ** 2)
    return {
        "vin": -24.0 * charge,
        "s1": 30e-3 * on,
        "d1": 10e-3 * off + 0.6 * forward,
        "rl": 20e-3 * (on + off),
        "r1": load / R,
    }


def test_powers_of_a_buck_with_resistances() -> None:
    sol = table(LOSSY, loads=("r1",))
    exact = exact_buck()
    found = {row.element: row.power for row in sol.powers.rows}
    for name, power in exact.items():
        # 1e-11: rounding of the orbit over 1 - 0.98, the distance of the multipliers from 1
        assert abs(found[name] - power) < 1e-11 * 28.0, name
    assert abs(found["l1"]) < 1e-12
    assert abs(found["c1"]) < 1e-12
    assert sol.powers.imbalance < 1e-13
    assert abs(sol.powers.efficiency - exact["r1"] / -exact["vin"]) < 1e-11
    assert abs(sol.measures["pd"] - exact["d1"]) < 1e-11
    energy = sol.certificate.energy
    assert abs(sol.powers.delivered * 10e-6 - energy.delivered) < 1e-10 * energy.delivered
    assert abs((sol.powers.lost + sol.powers.useful) * 10e-6 - energy.dissipated) < (
        1e-10 * energy.dissipated
    )


def test_jumps_have_their_place_in_the_table() -> None:
    """A charge pump of ideal switches: half of what it takes is lost in jumps, its sum closes."""
    text = (Path(__file__).parents[3] / "netlists/converters/charge_pump.net").read_text("utf-8")
    sol = table(text)
    energy, powers, length = sol.certificate.energy, sol.powers, 2e-3
    assert powers.imbalance < 1e-13
    assert powers.jumps * length == pytest.approx(energy.lost, rel=1e-10)
    assert powers.delivered * length == pytest.approx(energy.delivered, rel=1e-10)


def test_a_transient_has_powers_too() -> None:
    text = "rc\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.tran 1m 5m uic\n"
    sol = table(text)
    found = {row.element: row.power * 5e-3 for row in sol.powers.rows}
    e = np.exp(-5.0)
    assert found["r1"] == pytest.approx(0.5e-6 * (1 - e * e), rel=1e-12)
    assert found["c1"] == pytest.approx(0.5e-6 * (1 - e) ** 2, rel=1e-12)
    assert found["v1"] == pytest.approx(-1e-6 * (1 - e), rel=1e-12)


def test_smooth_laws_have_their_table_from_steps() -> None:
    """A diode's power is what the resistor and the capacitor leave of the source's."""
    text = "d\nV1 a 0 SIN(0 5 1k)\nR1 a b 1k\nD1 b 0 DX\nC1 b 0 1n\n.model DX D(IS=1e-14)\n"
    sol = table(text + ".tran 1u 1m\n.options reltol=1e-7\n")
    assert not sol.warnings
    power = {row.element: row.power for row in sol.powers.rows}
    # Tellegen's theorem holds for the polynomials as it does for values
    assert sol.powers.imbalance < 1e-12
    # mean square of a current by the rectangle rule, which is of high order over a period
    current = sol["i(r1)"][:-1]
    assert power["r1"] == pytest.approx(1e3 * float(np.mean(current**2)), rel=1e-5)
    # what a capacitor holds at the end, over the time of the run, to ten tolerances of what flows
    held = 0.5e-9 * (sol["v(b)"][-1] ** 2 - sol["v(b)"][0] ** 2)
    flows = np.sqrt(np.mean(sol["v(b)"] ** 2) * np.mean(sol["i(c1)"] ** 2))
    assert power["c1"] == pytest.approx(held / 1e-3, abs=1e-6 * flows)


def test_an_orbit_by_steps_has_powers_and_spectra() -> None:
    text = """Rectifier
V1 a 0 SIN(0 5 1k)
R1 a b 100
D1 b c DX
C1 c 0 1u
R2 c 0 1k
.model DX D(IS=1e-14)
.pss
.four i(r1)
.measure pss distortion THD i(r1)
.measure pss lost AVG p(d1)
"""
    sol = table(text)
    assert not sol.warnings
    assert sol.powers.imbalance < 1e-12
    power = {row.element: row.power for row in sol.powers.rows}
    assert power["d1"] == pytest.approx(sol.measures["lost"], rel=1e-12)
    # the tolerance of steps, over a period at whose end a capacitor holds what it held
    assert abs(power["c1"]) < 1e-5 * power["r2"]
    (spectrum,) = sol.spectra
    again = nsspice.pss(nsspice.read(text)).losses("r2")
    assert again.efficiency == pytest.approx(power["r2"] / -power["v1"], rel=1e-9)
    # sums over rows are the coefficients up to those of orders near their number
    rows = np.fft.fft(sol["i(r1)"][:-1])[:10] / (sol.axis.size - 1)
    assert np.abs(rows - spectrum.coefficients[:10]).max() < 1e-6 * abs(rows[1])
    assert spectrum.distortion == pytest.approx(sol.measures["distortion"], rel=1e-12)


def test_polynomials_of_a_run_give_its_closed_forms() -> None:
    """A buck's powers and Fourier coefficients, from either description of one run."""
    text = (Path(__file__).parents[3] / "netlists/converters/buck.net").read_text("utf-8")
    sol = table(text)
    steps = RecordedIntegrals.of(sol)
    names = [row.element for row in sol.powers.rows]
    exact, found = (np.array(way.powers(names)) for way in (sol.integrals, steps))
    assert np.abs(found - exact).max() < 1e-11 * np.abs(exact).max()
    currents = [f"i({name})" for name in names if name.startswith(("r", "l"))]
    one, other = (np.array(way.squares(currents)) for way in (sol.integrals, steps))
    assert other == pytest.approx(one, rel=1e-11)
    orders = [0, 1, 20, 100, 1000]
    for name in currents:
        one, other = (w.coefficients([name], orders)[name] for w in (sol.integrals, steps))
        assert np.abs(one - other).max() < 1e-11 * np.abs(one).max()


def test_the_command_prints_the_table(tmp_path: Path) -> None:
    (tmp_path / "a.net").write_text(LOSSY)
    done = subprocess.run(
        [sys.executable, "-m", "nsspice", "run", "a.net", "--load", "R1", "--json"],
        cwd=tmp_path, capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    (run,) = json.loads(done.stdout)["runs"]
    assert run["powers"]["efficiency"] == pytest.approx(0.967, abs=1e-3)
    assert run["periodic"]["verdict"] == "stable"
    wrong = subprocess.run(
        [sys.executable, "-m", "nsspice", "run", "a.net", "--load", "R9"],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert wrong.returncode == 2
    assert "R9".lower() in wrong.stderr


def test_losses_and_powers_without_the_command_line() -> None:
    """A divider on 10 V, chopped to half of the time: mean powers in closed form."""
    deck = """chopper
V1 a 0 10
S1 a b g 0 SW
R1 b c 2
R2 c 0 3
L1 c d 1m
R3 d 0 1k
Vg g 0 PULSE(0 1 0 0 0 5u 10u)
.model SW SW(VT=0.5)
"""
    circuit = nsspice.read(deck.replace("L1 c d 1m\nR3 d 0 1k\n", "C1 a 0 1u\n"))
    solution = nsspice.pss(circuit)
    table = solution.losses("R2")
    # 10 V / 5 Ohm for half of the time
    assert table.useful == pytest.approx(0.5 * 4.0 * 3.0, rel=1e-12)
    assert table.efficiency == pytest.approx(0.6, rel=1e-12)
    assert solution.average("p(R1)") == pytest.approx(0.5 * 4.0 * 2.0, rel=1e-12)
    assert nsspice.tran(circuit, stop=2e-5).losses("R2").efficiency == pytest.approx(0.6, rel=1e-12)
    with pytest.raises(nsspice.UsageError, match="average powers"):
        nsspice.ac(circuit, [1.0]).losses()
