"""nsspice examples: the collection is there, and copies of it are checked like any other deck."""

from __future__ import annotations

import json
import re
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


def test_waveforms_that_a_netlist_is_compared_with_are_copied_too(call):
    """They were files of the sources, which an installed program does not have."""
    assert call("examples", "copy", "ex11_ideal_diode", "ex11_zener_diode").exit_code == 0
    assert Path("thesis/data/ch1_static_R_diode.csv").exists()
    assert call("test", "thesis").exit_code == 0


def test_the_collection_needs_no_file_from_elsewhere():
    for expected in (ROOT / "netlists").rglob("*.expect.toml"):
        for name in re.findall(r'^reference = "(.*)"', expected.read_text("utf-8"), re.MULTILINE):
            there = (expected.parent / name).resolve()
            assert there.exists()
            assert (ROOT / "netlists").resolve() in there.parents


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
