"""Random values of a deck: their distributions, and when they repeat."""

from __future__ import annotations

import math
import statistics

import pytest

from nsspice import read
from nsspice.netlist import parse_text

COUNT = 4000


def drawn(call: str, seed: int = 0, params: dict[str, float] | None = None) -> list[float]:
    """The values of many resistors, each of which draws."""
    lines = "\n".join(f"R{k} a 0 {{{call}}}" for k in range(COUNT))
    deck = parse_text(f"many\n.param run=0\nV1 a 0 1\n{lines}\n.op", seed=seed, params=params)
    return [float(e.value) for e in deck.elements[1:]]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("call", "mean", "deviation"),
    [
        ("agauss(1k, 60, 3)", 1e3, 20.0),
        ("gauss(1k, 0.06, 3)", 1e3, 20.0),
        ("1k + gauss(20)", 1e3, 20.0),
        # a uniform distribution of half width w has the deviation w / sqrt(3)
        ("aunif(1k, 50)", 1e3, 50.0 / math.sqrt(3.0)),
        ("unif(1k, 0.05)", 1e3, 50.0 / math.sqrt(3.0)),
        ("mc(1k, 0.05)", 1e3, 50.0 / math.sqrt(3.0)),
        ("1k + flat(50)", 1e3, 50.0 / math.sqrt(3.0)),
        ("limit(1k, 50)", 1e3, 50.0),
    ],
)
def test_distributions(call: str, mean: float, deviation: float) -> None:
    values = drawn(call)
    # five deviations of the estimates: d / sqrt(n) of a mean; at most d / sqrt(2 n) of a deviation
    error = deviation / math.sqrt(COUNT)
    assert statistics.fmean(values) == pytest.approx(mean, abs=5 * error)
    assert statistics.pstdev(values) == pytest.approx(deviation, abs=5 * error / math.sqrt(2.0))


def test_the_seed_decides() -> None:
    assert drawn("mc(1,0.1)", 3) == drawn("mc(1,0.1)", 3)
    assert drawn("mc(1,0.1)", 3) != drawn("mc(1,0.1)", 4)
    assert drawn("mc(1,0.1)") != drawn("mc(1,0.1)", params={"run": 1.0})


def test_each_step_draws_and_reading_again_does_not() -> None:
    text = "t\n.param r={mc(1k,0.1)}\nI1 0 a 1\nR1 a 0 {r}\n.op\n.step param run 1 3 1\n"
    first, second = ([run["v(a)"][0] for run in read(text).run()] for _ in range(2))
    assert first == second
    assert len(set(first)) == 3


def test_it_is_told() -> None:
    warnings = parse_text("t\nV1 a 0 1\nR1 a 0 {mc(1,0.1)}\n.op").warnings
    assert [w.code for w in warnings] == ["NS1096"]


def test_calls_need_no_braces_as_parameters() -> None:
    found = parse_text("t\nD1 a 0 dm\n.model dm D(n=max(1, 2) is=flat(1e-15))\nR1 a 0 1\n.op")
    model = found.elements[0].model
    assert model is not None
    assert model.params["n"].value == 2.0
    assert abs(float(model.params["is"].value)) <= 1e-15  # type: ignore[arg-type]
