"""The netlist collection is readable: titles, and a reason for every tolerance."""

from __future__ import annotations

from pathlib import Path

from nsspice.compare.expectation import read_expectation

ROOT = Path(__file__).parents[2] / "netlists"
NETLISTS = sorted(ROOT.rglob("*.net"))


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).with_suffix("").as_posix()


def test_every_tolerance_has_a_reason() -> None:
    without = []
    for path in NETLISTS:
        expectation = read_expectation(path)
        if expectation.refused is None:
            without += [name_of(path) for check in expectation.checks if not check.why]
    assert without == []


def test_titles_say_what_decks_are() -> None:
    titles = {name_of(p): p.read_text("utf-8").splitlines()[0] for p in NETLISTS}
    assert [n for n, t in titles.items() if len(t.split()) < 3 or t.startswith("*")] == []


def test_no_line_is_too_long() -> None:
    long = {name_of(p) for p in NETLISTS for t in p.read_text("utf-8").splitlines() if len(t) > 120}
    assert long == set()


def test_every_expectation_has_its_netlist() -> None:
    found = {p.name.removesuffix(".expect.toml") for p in ROOT.rglob("*.expect.toml")}
    assert found == {p.stem for p in NETLISTS}
