"""The netlist collection is readable: titles, and a reason for every tolerance."""

from __future__ import annotations

from pathlib import Path

import pytest

from nsspice.compare.expectation import read_expectation

ROOT = Path(__file__).parents[2] / "netlists"
NETLISTS = sorted(ROOT.rglob("*.net"))


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).with_suffix("").as_posix()


@pytest.mark.parametrize("path", NETLISTS, ids=name_of)
def test_every_tolerance_has_a_reason(path: Path) -> None:
    expectation = read_expectation(path)
    assert expectation.refused is not None or all(check.why for check in expectation.checks)


@pytest.mark.parametrize("path", NETLISTS, ids=name_of)
def test_the_title_says_what_it_is(path: Path) -> None:
    title = path.read_text("utf-8").splitlines()[0]
    assert len(title.split()) >= 3
    assert not title.startswith("*")
    assert all(len(line) <= 120 for line in path.read_text("utf-8").splitlines())


def test_every_expectation_has_its_netlist() -> None:
    found = {p.name.removesuffix(".expect.toml") for p in ROOT.rglob("*.expect.toml")}
    assert found == {p.stem for p in NETLISTS}
