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
    assert "(basics/capacitor_sharing.report.html)" in text
    explored = gallery.report(netlist)
    assert explored is not None
    assert 100_000 < len(explored) < 400_000
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
GENERATED = {"work-precision.md", "ngspice.md", "hard-cases.md", "public-decks.md"}


def test_pictures_of_steady_states_are_drawn() -> None:
    import steady

    found = steady.pictures(ROOT)
    for name, content in found.items():
        assert len(content) > 5_000, name
        page = ROOT / "docs" / "how-to"
        shown = f"]({Path(name).name})"
        assert any(shown in p.read_text("utf-8") for p in page.glob("*.md")), name


def test_decks_are_coloured_as_spice_reads_them() -> None:
    import spice_lexer
    from pygments.lexers import get_lexer_by_name
    from pygments.token import Comment, Error, Keyword, Name, Number

    spice_lexer.register()
    lexer = get_lexer_by_name("spice")
    deck = (
        "Buck converter, 24 V\nVin in 0 24\nC1 out 0 0.1m IC=0 ; start\n.tran 0.1m 5meg uic\n"
        "B1 a 0 V={v(out)*2k}\n+ tc=1u\n* end\n"
    )
    tokens = [(kind, text) for kind, text in lexer.get_tokens(deck) if text.strip()]
    assert tokens[0] == (Name.Namespace, "Buck converter, 24 V\n")
    numbers = [text for kind, text in tokens if kind in Number]
    assert numbers == ["0", "24", "0", "0.1m", "0", "0.1m", "5meg", "0", "2k", "1u"]
    assert (Keyword, ".tran") in tokens
    assert [text for kind, text in tokens if kind in Comment] == ["; start", "* end"]
    # no text of the collection is unknown to the lexer, and none is lost
    for path in sorted((ROOT / "netlists").rglob("*.net")):
        text = path.read_text("utf-8")
        found = list(get_lexer_by_name("spice", stripnl=False).get_tokens(text))
        assert "".join(part for _, part in found).rstrip("\n") == text.rstrip("\n"), path
        assert not any(kind in Error for kind, _ in found), path
    assert type(get_lexer_by_name("spice")).__name__ == "SpiceDeckLexer"


def test_the_tutorial_shows_schematics_results_and_pictures() -> None:
    import tutorial

    text, pictures = tutorial.shown(ROOT)
    assert sum(name.endswith(".schematic.svg") for name in pictures) >= 6
    assert sum(name.endswith(".png") for name in pictures) >= 6
    for name in pictures:
        assert f"]({Path(name).name})" in text
    # the numbers that the text mentions are those that the program prints
    assert "v_mean = 8.448" in text
    assert "certificate holds" in text
    assert "error NS" in text.partition("## 9.")[2]


def test_every_folder_of_netlists_has_a_page_in_the_menu() -> None:
    import gallery

    folders = {path.parent.name for path in (ROOT / "netlists").glob("*/*.net")}
    assert set(gallery.HEADINGS) == folders
    menu = (ROOT / "mkdocs.yml").read_text("utf-8")
    assert all(f": gallery/{name}.md\n" in menu for name in folders)


def test_thumbnails_lead_to_sections_of_the_gallery() -> None:
    import gallery

    text = gallery.thumbnails(ROOT / "netlists")
    cards = re.findall(r"- \[!\[\]\((\w+)/(\w+)\.schematic\.svg\).*?\]\((\w+)\.md#([\w-]+)\)", text)
    assert len(cards) > 60
    assert all(a == c and b.lower().replace("_", "-") == d for a, b, c, d in cards)
    assert gallery.THUMBNAILS in (ROOT / "docs" / "gallery" / "index.md").read_text("utf-8")


def test_figures_of_ideas_are_drawn_where_they_are_shown() -> None:
    import concepts

    for name, content in concepts.pictures(ROOT).items():
        assert len(content) > 5_000, name
        folder = ROOT / "docs" / Path(name).parent
        shown = f"]({Path(name).name})"
        assert any(shown in p.read_text("utf-8") for p in folder.glob("*.md")), name
