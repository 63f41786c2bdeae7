"""The parts of the site that are made from the code: they list everything, and say it right."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def _tools(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [str(ROOT / "tools"), str(ROOT / "tools" / "site"), *sys.path])


def test_every_command_has_a_section_with_its_options() -> None:
    import commands

    from nsspice.cli.app import _COMMANDS

    text = commands.page()
    for name in _COMMANDS:
        assert f"## nsspice {name}\n" in text
    assert "`--theta NUMBER`" in text


def test_every_parameter_table_is_listed() -> None:
    import parameters

    text = parameters.page()
    for word in ("`ron`", "`vfwd`, ", "`cjo`", "`bf`", "`vt`", "`tc1`"):
        assert word.rstrip(", ") in text, word


def test_a_gallery_entry_has_picture_deck_and_expectations() -> None:
    import gallery

    netlist = ROOT / "netlists" / "basics" / "capacitor_sharing.net"
    picture = gallery.draw(netlist)
    assert picture is not None
    assert b"<svg" in picture
    scheme = gallery.draw_schematic(netlist)
    assert scheme is not None
    assert b'data-name="c1"' in scheme
    shown = "basics/capacitor_sharing.svg", "basics/capacitor_sharing.schematic.svg"
    text = gallery.entry(netlist, *shown)
    assert all(name in text for name in shown)
    assert "Expected results" in text
    assert "```spice" in text


def test_words_of_the_field() -> None:
    """Pages and comments of the core use the words of textbooks: `python tools/words.py`."""
    import words

    assert words.main([]) == 0


def test_pages_are_short_enough_to_be_read() -> None:
    """No page that people wrote has more than 2500 words, generated references apart."""
    for page in (ROOT / "docs").rglob("*.md"):
        if page.name not in {*GENERATED, "errors.md"}:
            assert len(page.read_text("utf-8").split()) <= 2500, page


def test_the_site_is_short_enough_to_be_read() -> None:
    """All pages that people wrote have at most 42 000 words, code apart."""
    pages = [p for p in (ROOT / "docs").rglob("*.md") if p.name not in GENERATED]
    prose = [re.sub(r"(?ms)^ *```.*?^ *```", "", p.read_text("utf-8")) for p in pages]
    assert sum(len(text.split()) for text in prose) <= 42_000


#: tables of measurements, written by tools
GENERATED = {"work-precision.md", "ngspice.md", "hard-cases.md"}


def test_pictures_of_steady_states_are_drawn() -> None:
    import steady

    found = steady.pictures(ROOT)
    for name, content in found.items():
        assert len(content) > 5_000, name
        page = ROOT / "docs" / "how-to"
        shown = f"]({Path(name).name})"
        assert any(shown in p.read_text("utf-8") for p in page.glob("*.md")), name
