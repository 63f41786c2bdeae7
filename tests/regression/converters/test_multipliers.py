"""Cockcroft-Walton multipliers: hundreds of modes, each visited once or twice."""

from __future__ import annotations

import numpy as np
import pytest
from oracle.multiplier_ode import Multiplier

import nsspice


def deck(stages: int, model: str = "Ron=0.1 Roff=1G", more: str = "") -> str:
    """Return a multiplier of 10 V, 1 kHz, 1 uF throughout, 100 kOhm per stage."""
    lines = ["multiplier", "V1 in 0 SIN(0 10 1k)", "Rs in a0 1", more]
    for s in range(1, stages + 1):
        low = "0" if s == 1 else f"b{s - 1}"
        lines += [
            f"Ca{s} a{s - 1} a{s} 1u IC=0", f"Da{s} {low} a{s} DI",
            f"Db{s} a{s} b{s} DI", f"Cb{s} {low} b{s} 1u IC=0",
        ]  # fmt: skip
    return "\n".join([*lines, f"RL b{stages} 0 {100e3 * stages:g}", f".model DI D({model})"])


def run(text: str, stop: float, rows: int = 50):
    """Run mode by mode and return the solution."""
    circuit = nsspice.read(text)
    sol = nsspice.tran(circuit, stop=stop, row_step=stop / rows, uic=True, method="modewise")
    assert sol.certificate.passed
    assert sol.stats["fixed_steps"] == 0
    return sol


@pytest.mark.parametrize(("stages", "last"), [(4, 62.5686225), (16, 68.9775145)])
def test_the_last_node_of_two_multipliers(stages, last):
    """Values of another program, nine digits of them."""
    sol = run(deck(stages), 50e-3)
    assert sol[f"v(b{stages})"][-1] == pytest.approx(last, rel=3e-9)


@pytest.mark.parametrize("stages", [1, 3])
def test_short_multipliers_agree_with_an_independent_integration(stages):
    """Radau takes steps over kinks of the right side with errors of its tolerance, times a few."""
    sol = run(deck(stages), 3e-3)
    other = Multiplier(stages).last_node(3e-3, 1e-9)
    assert sol[f"v(b{stages})"][-1] == pytest.approx(other, rel=2e-8)


@pytest.mark.soak
def test_sixty_four_stages():
    """The same: 45.4592163 V; with a tolerance of 1e-10 it gives 6e-9 less."""
    sol = run(deck(64), 20e-3)
    assert sol.stats["modes"] > 6000
    assert sol["v(b64)"][-1] == pytest.approx(Multiplier(64).last_node(20e-3, 1e-8), rel=1e-8)


@pytest.mark.parametrize("stages", [3, 9])
def test_modes_from_their_neighbours_are_those_from_the_network(stages):
    """An idle switch makes the engine reduce each mode by itself."""
    idle = "Vg g 0 0\nS1 in q g 0 SX\nRq q 0 1k\n.model SX SW(VT=1)"
    one, other = run(deck(stages), 4e-3, 200), run(deck(stages, more=idle), 4e-3, 200)
    for s in range(1, stages + 1):
        assert np.abs(one[f"v(b{s})"] - other[f"v(b{s})"]).max() < 1e-11 * 20.0 * stages


def test_values_do_not_depend_on_the_number_of_rows():
    """One by one through the unknowns of modes hardly met, or by rows made for modes."""
    signals = ["v(a2)", "v(b9)", "v(a3,b5)", "i(da4)", "i(ca2)", "i(v1)"]
    few, many = (
        nsspice.tran(nsspice.read(deck(9)), stop=4e-3, row_step=4e-3 / rows, uic=True,
                     method="modewise", signals=signals)
        for rows in (20, 4000)
    )  # fmt: skip
    for name in signals:
        assert np.abs(few[name] - many[name][::200]).max() < 1e-13 * np.abs(many[name]).max()


def test_a_long_chain_at_rest_starts_with_values_below_rounding():
    """The waves reach the far stages as powers of the time: nothing but rounding at first."""
    sol = run(deck(40), 20e-6, 20)
    stepped = nsspice.tran(nsspice.read(deck(40)), stop=20e-6, step=5e-9, row_step=1e-6, uic=True)
    assert stepped.islands[0].method == "moreau"
    for node in ("v(b1)", "v(b20)", "v(b40)"):  # implicit Euler's error: half a step in time
        assert np.abs(sol[node] - stepped[node]).max() < 1e-3 * sol[node].max()


@pytest.mark.parametrize("reltol", [1e-4, 1e-5, 1e-6])
def test_error_control_does_not_stop_at_every_diode(reltol):
    """Diodes that change within nanoseconds, one after the other, have kinks and no jumps."""
    circuit, last = nsspice.read(deck(16)), "v(b16)"
    exact = nsspice.tran(circuit, stop=2e-3, row_step=4e-5, uic=True, method="modewise")
    sol = nsspice.tran(circuit, stop=2e-3, row_step=4e-5, uic=True, method="sdirk", reltol=reltol)
    assert sol.certificate.passed
    # each located end of a mode takes a step at least; a change in ten steps would be 5000
    assert sol.stats["steps"] < 2 * exact.stats["segments"]
    assert sol.stats["passed"] > sol.stats["located"]
    assert sol.stats["forced"] <= 5
    # resistances lie between all stores
    assert sol.stats["jumps"] == 0
    # errors of some hundred steps
    assert np.abs(sol[last] - exact[last]).max() <= 10 * reltol * exact[last].max()
