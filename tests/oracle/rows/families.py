"""Families of random decks that the judge of rows can read, each a function of a seed."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from decks import everyday_circuits, random_circuits, random_events, resting
from decks.random_blocks import block_deck
from decks.random_controllers import controller_deck
from decks.random_converters import converter

Family = Callable[[int], str]


def _random_circuit(kind: str) -> Family:
    return lambda seed: random_circuits.generate(kind, seed).text


FAMILIES: dict[str, Family] = {
    "converter": converter,
    "smooth converter": lambda seed: converter(seed, smooth=True),
    "controller": controller_deck,
    "blocks": block_deck,
    "zener chain": lambda seed: random_events.zener_chain(Random(seed)),
    "gated load": lambda seed: random_events.gated_load(Random(seed)),
    "transformer": lambda seed: random_events.perfect_transformer(Random(seed)),
    "everyday": everyday_circuits.ideal,
    "everyday smooth": everyday_circuits.smooth,
    "thresholds": lambda seed: resting.deck(seed).text,
    **{kind: _random_circuit(kind) for kind in random_circuits.CLASSES},
}
