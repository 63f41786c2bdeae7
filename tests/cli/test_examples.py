"""nsspice examples: the collection is there, and copies of it are checked like any other deck."""

from __future__ import annotations

import json
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_every_netlist_is_listed(call):
    listed = json.loads(call("examples", "--json").stdout)
    names = {entry["name"] for entry in listed}
    there = {
        p.relative_to(ROOT / "netlists").with_suffix("").as_posix()
        for p in (ROOT / "netlists").rglob("*.net")
    }
    assert names == there
    assert "Buck converter" in call("examples").stdout


def test_copied_netlists_pass_their_checks(call):
    assert call("examples", "copy", "capacitor_sharing", "--to", "mine").exit_code == 0
    assert Path("mine/basics/capacitor_sharing.net").exists()
    assert call("test", "mine").exit_code == 0


def test_nothing_is_replaced_without_being_told(call):
    call("examples", "copy", "converters/buck")
    Path("converters/buck.net").write_text("mine\n")
    again = call("examples", "copy", "converters/buck")
    assert again.exit_code == 2
    assert "NS4019" in again.stderr
    assert Path("converters/buck.net").read_text() == "mine\n"
    assert call("examples", "copy", "converters/buck", "--force").exit_code == 0
    assert Path("converters/buck.net").read_text() != "mine\n"


def test_a_misspelt_name_gets_the_nearest(call):
    result = call("examples", "show", "bukc")
    assert result.exit_code == 2
    assert "buck" in result.stderr


def test_a_deck_is_printed_as_it_is(call):
    text = (ROOT / "netlists" / "converters" / "buck.net").read_text("utf-8")
    assert call("examples", "show", "converters/buck").stdout.strip() == text.strip()
