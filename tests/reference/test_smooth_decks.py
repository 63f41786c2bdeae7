"""The smooth decks: where their expected numbers come from, sharp junctions, the limit N -> 0."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tomllib
from oracle.smooth_decks import DECKS

import nsspice

FOLDER = Path(__file__).parents[2] / "netlists" / "smooth"
SHARP = (0.1, 0.01, 0.001)


@pytest.mark.parametrize("name", sorted(DECKS))
def test_expected_numbers_are_those_of_the_oracle(name: str):
    expected = tomllib.loads((FOLDER / f"{name}.expect.toml").read_text(encoding="utf-8"))
    checks = expected["check"]
    times = np.array(sorted({c["at"] for c in checks}))
    table = DECKS[name](times)
    for check in checks:
        value = table[check["signal"]][np.searchsorted(times, check["at"])]
        # Radau's relative tolerance of 1e-9 is one of each step
        assert value == pytest.approx(check["value"], abs=1e-6)


@pytest.mark.parametrize("n", SHARP)
@pytest.mark.parametrize("name", sorted(DECKS))
def test_sharp_junctions_converge(name: str, n: float):
    (solution,) = nsspice.read(FOLDER / f"{name}.net", params={"n": n}).run(method="moreau")
    assert solution.certificate.passed
    assert all(np.isfinite(values).all() for values in solution.signals.values())


def ideal(name: str) -> str:
    """Return a deck with ideal diodes (a practical one for the Zener diode)."""
    text = (FOLDER / f"{name}.net").read_text(encoding="utf-8")
    curve = "D(Vfwd=0 Vrev=5.1)" if name == "zener" else "D(ideal)"
    return "\n".join(
        f"{line.split('D(')[0]}{curve}" if line.startswith(".model") and " D(" in line else line
        for line in text.splitlines()
    )


@pytest.mark.parametrize("name", sorted(DECKS))
def test_the_limit_is_the_ideal_diode(name: str):
    """A junction at current i drops N kT/q ln(1 + i/IS): the distance to the ideal one is O(N)."""
    signals = list(DECKS[name](np.array([1e-5])))
    (limit,) = nsspice.read(ideal(name)).run(signals=signals, method="moreau")
    distances = []
    for n in SHARP:
        (found,) = nsspice.read(FOLDER / f"{name}.net", params={"n": n}).run(
            signals=signals, method="moreau"
        )
        distances.append(max(float(np.abs(found[s] - limit[s]).max()) for s in signals))
    orders = np.log10(np.array(distances[:-1]) / distances[1:])
    # ln(i/IS) varies along the curve, and the conduction angles with it, by far less than i
    assert orders == pytest.approx([1.0, 1.0], abs=0.1), distances
