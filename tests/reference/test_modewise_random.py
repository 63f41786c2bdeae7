"""The mode-wise engine on fresh random networks, against an integration of the whole equations."""

from __future__ import annotations

import pytest
from decks.random_circuits import CLASSES, generate
from oracle.modewise import Check

import nsspice
from nsspice.errors import NsspiceError
from nsspice.solvers.moreau import MoreauStepper
from nsspice.solvers.stepper import UnsolvedStep

#: seeds that no one has looked at while the engine was made
FRESH = range(7000, 7028)
#: Radau's own estimate has to be below this for an interval to count
PROVED = 1e-9


def islands(text: str):
    for island in nsspice.read(text).islands:
        mna = island.assemble(27.0)
        if not mna.system.static:
            yield mna


def step_through(stepper: MoreauStepper, charges, step: float) -> None:
    stepper.start_charges(0.0, charges, step)
    while not stepper.advance(10)[1]:
        pass


@pytest.mark.parametrize("kind", [c for c in CLASSES if c != "large"])
def test_agrees_with_the_unreduced_equations(kind):
    proved = solved = refused = 0
    for seed in FRESH:
        circuit = generate(kind, seed)
        for mna in islands(circuit.text):
            stop = 6 * circuit.step
            try:
                intervals = Check(mna, stop, 8).intervals()
            except UnsolvedStep:
                # then time stepping finds no solution either
                refused += 1
                stepper = MoreauStepper(mna.system, ())
                stepper.plan(0.0, stop, stop / 100, 0.0, stop)
                with pytest.raises(UnsolvedStep):
                    step_through(stepper, mna.initial_charges(), stop / 100)
                continue
            solved += 1
            good = [i for i in intervals if i.estimate < PROVED]
            proved += bool(good)
            for i in intervals:
                assert i.negative < 1e-9, (seed, i)
                # Radau's order falls for stiff equations, and its estimate with it
                if i.estimate < 1e-3:
                    assert i.error < 100 * i.estimate + 1e-9, (seed, i)
    assert solved + refused >= len(FRESH) // 2
    assert proved >= 0.6 * solved


@pytest.mark.parametrize("seed", range(7000, 7012))
def test_large_networks(seed):
    circuit = generate("large", seed)
    deck = nsspice.read(circuit.text)
    try:
        sol = nsspice.tran(deck, stop=6 * circuit.step, uic=True, method="modewise")
    except NsspiceError as error:
        with pytest.raises(type(error)):
            nsspice.tran(deck, stop=6 * circuit.step, uic=True, method="moreau")
        return
    assert sol.certificate.complementarity < 1e-9
