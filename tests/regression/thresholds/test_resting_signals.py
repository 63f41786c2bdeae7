"""Signals that rest on thresholds: comparisons as written, switches that have come there turn.

The decks are those of five public circuits, cut down.  All values follow from their sources.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nsspice
from nsspice.devices.expressions import expression_nodes as inner
from nsspice.problems.descriptor import Switch

FOLDER = Path(__file__).parent
#: what makes a deck one with stored energy, and its control nodes
STORED = {
    "vt0": "Rq g q 1k\nCq q 0 1n\n",
    "cmp0": "Rq g q 1k\nCq q 0 1n\n",
    "cmp1": "Rq g q 1k\nCq q 0 1n\n",
    "eq": "Rq m q 1k\nCq q 0 1n\n",
    "integ": "Rq x q 1k\nCq q 0 1n\n",
}
#: instants [us] in the middle of each level
PULSE = (0.5, 3.0, 8.0, 13.0, 18.0, 23.0, 28.0, 33.0, 38.0)
#: 10 V through 1 mOhm or 1 MOhm in series with 10 Ohm
LOW, HIGH = 10.0 * 10.0 / (10.0 + 1e6), 10.0 * 10.0 / (10.0 + 1e-3)


def alternate(low: float, high: float) -> list[float]:
    return [high if k % 2 else low for k in range(len(PULSE))]


EXPECTED: dict[str, tuple[tuple[float, ...], dict[str, list[float]]]] = {
    "vt0": (PULSE, {"v(b)": alternate(LOW, HIGH)}),
    "cmp1": (PULSE, {f"v({n})": alternate(LOW, HIGH) for n in "bcde"}),
    "cmp0": (
        PULSE,
        {
            "v(b1)": alternate(0.0, 1.0),
            "v(b2)": alternate(0.5, 1.0),  # u(0) is one half, as in ngspice
            "v(b3)": alternate(0.0, 1.0),
            "v(b4)": alternate(1.0, 0.0),
            "v(b5)": alternate(0.0, 1.0),
        },
    ),
    "eq": (
        (0.5, 1.5, 2.5, 3.5, 4.5),
        {
            "v(b1)": [0.0, 5.0, 0.0, 5.0, 0.0],
            "v(b2)": [0.0, 5.0, 5.0, 5.0, 0.0],
            "v(b3)": [0.0, 0.0, 5.0, 0.0, 0.0],
            "v(b4)": [5.0, 5.0, 0.0, 5.0, 5.0],
            "v(b5)": [5.0, 0.0, 0.0, 0.0, 5.0],
            "v(b6)": [0.0, 5.0, 0.0, 5.0, 0.0],
            "v(b7)": [5.0, 0.0, 5.0, 0.0, 5.0],
            "v(b8)": [0.5, 1.0, 1.0, 1.0, 0.5],
        },
    ),
    "integ": (
        (0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.25, 3.75),
        {"v(e)": [0.0, 5.0, 5.0, 0.0, 0.0, 5.0, 5.0, 0.0]},
    ),
}


def text_of(deck: str, method: str) -> str:
    text = (FOLDER / f"{deck}.cir").read_text(encoding="utf-8")
    if method == "static":
        return text
    return text.replace(".tran", f"{STORED[deck]}.options method={method}\n.tran")


@pytest.mark.parametrize("method", ["static", "auto", "sdirk", "moreau"])
@pytest.mark.parametrize("deck", EXPECTED)
def test_values_between_edges(deck: str, method: str) -> None:
    run = nsspice.read(text_of(deck, method)).run()[0]
    assert run.certificate is not None
    assert run.certificate.passed
    times, signals = EXPECTED[deck]
    rows = np.searchsorted(run.time, np.array(times) * 1e-6)
    for name, values in signals.items():
        # resistors from 1 mOhm to 1 MOhm: 1e9 roundings
        assert np.abs(run[name][rows] - values).max() <= 1e9 * np.finfo(float).eps, name
    names = {w.code for w in run.warnings}
    assert "NS3056" in names


def test_the_warning_names_the_elements() -> None:
    run = nsspice.read(text_of("cmp1", "static")).run()[0]
    (warning,) = (w for w in run.warnings if w.code == "NS3056")
    assert all(name in warning.message for name in ("s1", "s2", "s4", "w1"))


@pytest.mark.parametrize("method", ["static", "auto", "sdirk"])
@pytest.mark.parametrize("deck", ["cmp0", "eq", "integ"])
def test_the_certificate_would_have_noticed(
    deck: str, method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Comparators that keep the other state at equality miss the text."""

    def wrong(*args: object, at_threshold: bool, **given: object) -> Switch:
        return Switch(*args, at_threshold=not at_threshold, **given)  # type: ignore[arg-type]

    monkeypatch.setattr(inner, "Switch", wrong)
    run = nsspice.tran(nsspice.read(text_of(deck, method)))
    assert run.certificate is not None
    assert not run.certificate.passed
    assert "comparison" in run.certificate.worst


@pytest.mark.parametrize("method", ["auto", "sdirk"])
def test_what_only_tends_to_a_threshold_never_comes(method: str) -> None:
    """After 50 time constants 1 V is reached up to rounding, and 0 V."""
    run = nsspice.read(
        "decay\nV1 in 0 1\nR1 in up 1k\nC1 up 0 1n IC=0\nR2 down 0 1k\nC2 down 0 1n IC=1\n"
        "B1 b1 0 V=if(v(up)>=1,1,0)\nB2 b2 0 V=if(v(down)>0,1,0)\nRb1 b1 0 1k\nRb2 b2 0 1k\n"
        "S1 in c1 up 0 high\nRc1 c1 0 1k\nS2 in c2 down 0 low\nRc2 c2 0 1k\n"
        ".model high SW(VT=1)\n.model low SW(VT=0)\n"
        "Vx x 0 PULSE(0 1 40u 1n 1n 1u 3u)\nRx x 0 1k\n"
        f".options method={method}\n.tran 0.1u 50u uic\n"
    ).run()[0]
    assert run.certificate is not None
    assert run.certificate.passed
    inside = run.time > 0.0
    for name, value in (("v(b1)", 0.0), ("v(b2)", 1.0), ("v(c1)", 0.0), ("v(c2)", 1.0)):
        assert np.abs(run[name][inside] - value).max() <= 1e-12, name


def test_a_control_that_only_touches_its_threshold_turns_nothing() -> None:
    """Hysteresis would keep the state that the touch has led to."""
    deck = (
        "touch\nV1 g 0 PWL(0 0 1u 1 2u 0.5 3u 0.5 4u 1 5u 1 6u 0.5 10u 0.5)\nVa a 0 1\n"
        "S1 a b g 0 m\nRb b 0 1k\n.model m SW(VT=0.5 VH=0.5)\n{}.tran 0.25u 10u\n"
    )
    for more in ("", "Rq g q 1k\nCq q 0 1n\n", "Rq g q 1k\nCq q 0 1n\n.options method=sdirk\n"):
        run = nsspice.read(deck.format(more)).run()[0]
        t = run.time
        clear = np.abs(t - 4e-6) > 1e-12
        assert np.array_equal(run["v(b)"][clear], (t > 4e-6)[clear].astype(float))


def test_sliding_along_a_threshold_stays_sliding() -> None:
    """The switch takes its control back at once: it chatters about 1 V, as without any rest."""
    run = nsspice.read(
        "slide\nV1 in 0 2\nR1 in x 1k\nC1 x 0 1u\nS1 x 0 x 0 m\n.model m SW(VT=1 RON=100)\n"
        ".tran 10u 10m uic\n"
    ).run()[0]
    assert any(w.code == "NS3052" for w in run.warnings)
    late = run.time > 2e-3
    assert np.abs(run["v(x)"][late] - 1.0).max() <= 1e-2
