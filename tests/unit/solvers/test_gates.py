"""Switches at the start: what sources alone decide is what a solution of the circuit finds."""

from __future__ import annotations

from pathlib import Path

import pytest

import nsspice
from nsspice.analyses.request.cards import Tran
from nsspice.errors import NsspiceError
from nsspice.netlist.deck import TranCard
from nsspice.problems.descriptor import DescriptorSystem
from nsspice.solvers.modewise import ModewiseStepper, refusal
from nsspice.solvers.moreau import MoreauStepper

NETLISTS = Path(__file__).parents[3] / "netlists"


def by_sources(system: DescriptorSystem) -> list[bool] | None:
    return ModewiseStepper(system, [])._core.gates_by_sources()


def switched_systems():
    """Yield name, system and initial charges of each island with switches."""
    for path in sorted(NETLISTS.rglob("*.net")):
        try:
            circuit = nsspice.read(path)
        except NsspiceError:
            continue
        card = next((c for c in circuit.deck.analyses if isinstance(c, TranCard)), None)
        for island in circuit.islands:
            if card is not None and any(d.letter in "sw" for d in island.devices):
                stop = Tran.from_card(card).stop
                mna = island.assemble(tstop=stop)
                if refusal(mna.system) is None:
                    yield path.stem, mna.system, mna.initial_charges(), 1e-6 * stop


def test_states_by_sources_are_those_of_the_first_solution():
    decided = []
    for name, system, charges, step in switched_systems():
        found = by_sources(system)
        if found is not None:
            stepper = MoreauStepper(system, ())
            stepper.start_charges(0.0, charges, step)
            assert found == stepper.gates, name
            decided.append(name)
    assert {"buck", "boost", "flyback"} <= set(decided)


@pytest.mark.parametrize(
    ("gate", "state"),
    [
        ("Vg g 0 2", [True]),
        ("Vg g 0 PULSE(0 2 0 0 0 1 2)", [True]),  # the value after the edge
        ("Vg g 0 0", [False]),
        ("Vg g x 3\nVx x 0 -1.5", [True]),
        ("Vg g x 3\nVx x 0 -2.5", [False]),
        ("Vg x 0 4\nR1 x g 1\nR2 g 0 1", [True]),  # a divider of resistors is decided too
        ("Rg g a 1\nCg g 0 1u IC=2", None),  # a capacitor is not
    ],
)
def test_what_decides(gate, state):
    deck = f"""switch
V1 a 0 1
S1 a b g 0 SW
R9 b 0 1
C1 b 0 1u
{gate}
.model SW SW(VT=1)
"""
    assert by_sources(nsspice.read(deck).islands[0].assemble().system) == state
