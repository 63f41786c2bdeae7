"""Unknowns that are voltages of the heaviest spanning tree: what node voltages lose, they keep."""

from __future__ import annotations

import numpy as np
import pytest
from decks.fired_at_rest import FIRED_AT_REST
from decks.random_converters import converter
from oracle.agreement import compare

import nsspice
from nsspice.analyses.studies.refinement import stored_quantities

#: 1 MOhm from each input of two three-phase bridges to ground, behind one line inductance
BRIDGES = "\n".join(
    [
        "bridges",
        *(f"V{p} v{p} 0 SIN(0 325 50 0 0 {a})" for p, a in zip("abc", (0, -120, 120), strict=True)),
        *(f"L{p} v{p} g{p} 100u IC=0" for p in "abc"),
        *(
            f"L{p}{k} g{p} x{p}{k} 0.{5 + k}m IC=0\nDU{p}{k} x{p}{k} p{k} dm\n"
            f"DL{p}{k} m{k} x{p}{k} dm\nRB{p}{k} x{p}{k} 0 1meg"
            for k in range(2)
            for p in "abc"
        ),
        *(f"C{k} p{k} m{k} 470u IC=0\nR{k} p{k} m{k} 2{k}" for k in range(2)),
        ".model dm D(Vfwd=0.8 Ron=5m)",
        ".tran 50u 20m uic",
        ".end",
    ]
)


@pytest.mark.parametrize("text", [BRIDGES, converter(14)], ids=["bleeders", "converter"])
def test_both_engines_are_certified_and_agree(text: str) -> None:
    circuit = nsspice.read(text)
    names = stored_quantities(circuit)
    exact, steps = (
        nsspice.tran(circuit, method=method, reltol=1e-6, signals=names)
        for method in ("modewise", "sdirk")
    )
    for kind in "vi":
        own = [name for name in names if name[0] == kind]
        largest = max(np.abs(exact[name]).max() for name in own)
        for name in own:
            assert np.abs(steps[name] - exact[name])[1:].mean() <= 1e-3 * largest, name


def test_no_current_is_taken_for_one_while_nothing_flows() -> None:
    """Rounding of potentials was 1e-21 A, and fired a thyristor."""
    run = nsspice.tran(nsspice.read(FIRED_AT_REST), method="moreau")
    assert np.abs(run["i(d0)"]).max() == 0.0


@pytest.mark.parametrize("method", ["modewise", "moreau", "sdirk"])
def test_rows_are_those_of_node_voltages(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (
        "rectifier\nV1 in 0 SIN(0 10 50)\nL1 in a 1m\nD1 a out\nD2 0 a\nC1 a x 1u\nR1 x out 10\n"
        "C2 out 0 100u\nR2 out 0 100\n.tran 0.1m 20m\n"
    )
    runs = []
    for in_use in (True, False):
        if not in_use:
            monkeypatch.setattr("nsspice.circuit.mna.spanning_tree", lambda *_: {})
        circuit = nsspice.read(text)
        tree = circuit.islands[0].assemble().system.elements.before
        assert any(before >= 0 for before in tree) is in_use
        runs.append(nsspice.tran(circuit, method=method))
    tolerance = 1e-4 if method == "sdirk" else 1e-9
    for name in ("v(out)", "v(x)", "i(l1)", "i(d1)"):
        one, other = (run[name] for run in runs)
        assert np.abs(one - other).mean() <= tolerance * np.abs(other).max(), name


@pytest.mark.parametrize("seed", [3, 8])
def test_steps_are_those_of_an_oracle_with_node_voltages(seed: int) -> None:
    mna = nsspice.read(converter(seed)).islands[0].assemble()
    assert any(before >= 0 for before in mna.system.elements.before)
    assert compare(mna, 1e-7, 20, charges=mna.initial_charges()).distance < 1e-9
