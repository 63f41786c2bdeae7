"""Random decks that have an operating point, though not in every state of their switches.

Each part contradicts itself in one state of its switch: a current source has no way where it is
open, two voltage sources are joined where it is closed.  What its control is follows from the
solution, by resistors, behind a capacitor, or from another part; a proof that looks at the first
state alone is none.
"""

from __future__ import annotations

import random

import pytest

import nsspice


def deck(seed: int) -> tuple[str, dict[str, float]]:
    """Return a deck and the voltages of its operating point."""
    rng = random.Random(seed)
    cards: list[str] = []
    exact: dict[str, float] = {}
    highs: list[str] = []
    for k in range(rng.randint(1, 5)):
        closed = rng.random() < 0.6
        flag = "on" if rng.random() < (0.2 if closed else 0.8) else "off"
        kind = rng.choice(["stored", "divider", "chain" if highs else "stored"])
        control = f"c{k}"
        if kind == "chain":
            # 5 V of another part, or that of its difference to 5 V
            source = rng.choice(highs)
            cards += [f"E{k} {control} 0 {source} 0 1"] if closed else [
                f"Ve{k} e{k} 0 5", f"E{k} {control} 0 e{k} {source} 1"
            ]  # fmt: skip
        else:
            level = 10.0 if closed else 2.0
            cards.append(f"Vc{k} s{k} 0 {level}")
            cards.append(f"Ra{k} s{k} {control} 1k")
            cards.append(f"Rb{k} {control} 0 1k")
            if kind == "stored":
                cards.append(f"C{k} {control} 0 {rng.choice([1, 10, 100])}p")
        hysteresis = rng.choice([0.0, 0.5])
        cards.append(f".model m{k} SW(VT=2.5 VH={hysteresis})")
        if closed:
            cards += [
                f"I{k} 0 p{k} 5m",
                f"S{k} p{k} q{k} {control} 0 m{k} {flag}",
                f"R{k} q{k} 0 1k",
            ]
            exact |= {f"v(p{k})": 5.0, f"v(q{k})": 5.0}
            highs.append(f"p{k}")
        else:
            cards += [f"V{k} p{k} 0 5", f"S{k} p{k} q{k} {control} 0 m{k} {flag}"]
            cards.append(f"Vq{k} q{k} 0 3")
            exact |= {f"v(p{k})": 5.0, f"v(q{k})": 3.0}
    rng.shuffle(cards)
    return "\n".join(
        [f"states of switches, seed {seed}", *cards, ".tran 10n 1u", ".end", ""]
    ), exact


def _all_solved(seeds: range) -> None:
    for seed in seeds:
        text, exact = deck(seed)
        for method in ("auto", "sdirk", "moreau"):
            run = nsspice.tran(nsspice.read(text), method=method)
            assert run.certificate is not None
            assert run.certificate.passed, seed
            for name, value in exact.items():
                assert run[name][0] == pytest.approx(value, rel=1e-9), (seed, method, name)
                assert run[name][-1] == pytest.approx(value, rel=1e-9), (seed, method, name)
        point = nsspice.op(nsspice.read(text))
        assert all(
            point[name][0] == pytest.approx(value, rel=1e-9) for name, value in exact.items()
        )


def test_decks_with_an_operating_point() -> None:
    _all_solved(range(40))


@pytest.mark.soak
def test_many_decks_with_an_operating_point() -> None:
    _all_solved(range(1000))


def test_a_contradiction_in_every_state_is_proved() -> None:
    """Closed, the control is low and opens the switch; open, the current has no way."""
    text = (
        "no state\nI1 0 p 1m\nS1 p 0 p 0 m\n.model m SW(VT=2.5)\n"
        ".tran 10n 1u\nC1 x 0 1n\nRx x 0 1\n"
    )
    with pytest.raises(nsspice.InfeasibleError) as caught:
        nsspice.read(text).run()
    assert caught.value.diagnostics[0].code == "NS3001"


def test_a_control_that_is_stored_closes_the_switch() -> None:
    run = nsspice.read(
        "a\nI5 0 3 1m\nS2 3 2 4 0 m\nR2 2 0 1k\nV7 7 0 4\nR7 7 4 100\nC4 4 0 10p\n"
        ".model m SW(VT=2.5)\n.tran 10n 1u\n"
    ).run()[0]
    assert run["v(2)"] == pytest.approx(1.0, rel=1e-12)
