"""What decides the cost of a run: a sentence with names, before the run and after it."""

from __future__ import annotations

from pathlib import Path

import pytest

import nsspice
from nsspice.analyses.request.cost_hints import cost_of
from nsspice.analyses.studies.explanation import explained, tell

NETLISTS = Path(__file__).parents[4] / "netlists"


def readable(deck: Path) -> bool:
    """Return whether a deck is not there to be refused while it is read."""
    try:
        nsspice.read(deck)
    except nsspice.NsspiceError:
        return False
    return True


DECKS = [deck for deck in sorted(NETLISTS.rglob("*.net")) if readable(deck)]
#: what else a sentence may be about
_OTHER = (
    "output points",
    "one solve for each point",
    "its size",
    "asked for",
    "unknowns and pairs",
)


@pytest.mark.parametrize("deck", DECKS, ids=lambda path: path.stem)
def test_every_deck_of_the_collection_is_told_what_decides_its_cost(deck: Path) -> None:
    """Smooth elements where steps are needed, else the events of an element, or output points."""
    circuit = nsspice.read(deck)
    for of in circuit.islands:
        mna = of.assemble()
        told, cost = tell(circuit, of, mna), cost_of(circuit, of, mna)
        assert cost.sentence == told.cost
        assert told.method
        smooth = {device.name for device in of.devices if device.smooth}
        if smooth:
            assert set(cost.elements) == smooth
            assert any(name in cost.sentence for name in smooth)
        else:
            assert cost.elements or any(word in cost.sentence for word in _OTHER), cost
        assert all(name in {device.name for device in of.devices} for name in cost.elements)


BASE = "demo\nV1 a 0 PULSE(0 1 0 1n 1n 5u 10u)\nR1 a b 1\nC1 b 0 1u\n{}.tran 1u 1m\n"


@pytest.mark.parametrize(
    ("line", "said", "hint"),
    [
        ("", "v1: 400 breakpoints in 0.001 s", ""),
        ("D1 b 0\n", "v1: 400 breakpoints in 0.001 s", ""),
        ("D1 b 0 DM\n.model DM D(IS=1p CJO=1n)\n", "d1 (exponential junction, junction", "Vfwd"),
        ("B1 c 0 V={v(a)*v(b)}\nR2 c 0 1\n", "b1 (v(a)*v(b)): Newton", "0 or 1"),
        ("B1 c 0 V={1+2*tanh(9*v(b))}\nR2 c 0 1\n", "b1 (tanh(9*v(b)))", "limit(9*v(b),-1,1)"),
        ("B1 c 0 V={asin(sin(v(b)))}\nR2 c 0 1\n", "b1 (asin(sin(v(b))))", "linear in time"),
        (".options method=moreau\n", "requested by the deck (moreau)", ""),
    ],
)
def test_what_forces_an_engine_is_named(line: str, said: str, hint: str) -> None:
    circuit = nsspice.read(BASE.format(line))
    *_, island = explained(circuit).islands  # behind the filter what is smooth is a block
    assert said in island.told.cost
    assert hint in " ".join(island.told.hints)
    assert bool(hint) == bool(island.told.hints)
    (sol,) = circuit.run()
    assert sol.islands[-1].cost == island.told.cost
    assert len(sol.islands) > 1 or f"cost: {island.told.cost}" in sol.summary()


def test_the_explanation_begins_with_what_is_simulated_and_how() -> None:
    text = (
        "two\nV1 a 0 SIN(0 1 50)\nR1 a 0 1\nV2 b 0 1\nR2 b 0 V={i^3}\n.tran 1m 20m\n.save i(v1)\n"
    )
    shown = explained(nsspice.read(text))
    assert shown.skipped == ("v2", "r2")
    lines = shown.text().splitlines()
    assert lines[0] == "two: 1 island"
    assert "not simulated: v2, r2" in shown.text()
    order = [shown.text().index(word) for word in ("solved by", "cost", "effects", "class", "size")]
    assert order == sorted(order)
    assert shown.to_dict()["skipped"] == ["v2", "r2"]
    assert len(explained(nsspice.read(text), everything=True).islands) == 2


def test_decks_without_a_transient_have_a_sentence_too() -> None:
    (island,) = explained(nsspice.read("op\nV1 a 0 1\nR1 a 0 1\n.op\n")).islands
    assert island.told.cost == "one solve for each point of the analysis"
