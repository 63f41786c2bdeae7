"""The compiled core and the numpy oracle agree to 1e-12 on all netlists, step by step."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from oracle.agreement import averaging_distance, compare, short_enough

import nsspice
from nsspice.netlist.deck import TranCard

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).parents[2] / "netlists"
AGREEMENT = 1e-12
#: steps compared: the oracle factors every problem anew
STEPS = 150


#: decks that the oracle cannot judge to 1e-12, and why; their own checks stand beside them
BEYOND = {
    "extreme_picosecond_edges": "the oracle merges corners that are closer than 1e-9 of a step",
    "extreme_edges_one_rounding_apart": "every signal is zero or rounding",
    "extreme_ten_million_steps": "at its row distance every sample of the sine is rounding",
    "extreme_stiff_snubber": "time constants of 3e-14 s cost the oracle's dense solves two digits",
    "degenerate_floating_bridge": "the potential of the floating part is rounding",
    "jump_capacitor_bank": "the star point is at zero but for rounding",
    "report_chopper_with_snubber": "jumps of 1 nF beside 47 uF cost two digits",
    "slide_three_phase_relay_inverter": "rounding decides which way a relay at its threshold falls",
}


def decks() -> list[Path]:
    """Return all netlists but those that are there to be refused, or that hold smooth laws: those
    are compared with references of their own (see their X.expect.toml).
    """
    found = []
    for path in sorted(ROOT.rglob("*.net")):
        expect = path.with_suffix("").with_suffix(".expect.toml")
        refused = expect.exists() and "refused" in tomllib.loads(expect.read_text())
        if path.stem in BEYOND:
            continue
        if not refused and not any(d.smooth for d in nsspice.read(path).devices):
            found.append(path)
    return found


DECKS = decks()
IDS = [p.stem for p in DECKS]


def test_there_are_netlists():
    assert len(DECKS) >= 20


def islands(path: Path):
    """Return the circuit, its transient card (or None) and the systems of its islands."""
    circuit = nsspice.read(path)
    cards = [c for c in circuit.deck.analyses if isinstance(c, TranCard)]
    temperature = circuit.deck.temperature
    return circuit, cards[0] if cards else None, [i.assemble(temperature) for i in circuit.islands]


@pytest.mark.parametrize("theta", [1.0, 0.5])
@pytest.mark.parametrize("path", DECKS, ids=IDS)
def test_core_agrees_with_oracle(path, theta):
    circuit, card, systems = islands(path)
    h = (card.tstep or card.tstop / 1000) if card else 1e-3
    for mna in systems:
        if theta != 1.0 and mna.system.static:
            continue
        count = STEPS if mna.system.n < 60 else 30
        held = {k: float(p.value) for k, p in circuit.deck.initial.items()}
        charges = mna.initial_charges(held) if card and (card.uic or held) else None
        if card:
            count = min(count, max(1, int(card.tstop / h)))
        result = compare(mna, short_enough(mna, h, theta), count, theta, charges)
        assert result.distance <= AGREEMENT, result
        assert result.compared > 0 or mna.system.n == 0


@pytest.mark.parametrize("path", DECKS, ids=IDS)
def test_averaging_terms_agree_with_element_replacement(path):
    _, _, systems = islands(path)
    for mna in systems:
        assert averaging_distance(mna, 0.5) <= 1e-11
