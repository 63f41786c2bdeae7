"""Logical lines: continuations, comments, places, encodings."""

from __future__ import annotations

import pytest

from nsspice.netlist import NetlistError, parse_file, parse_text
from nsspice.netlist.text.lines import logical_lines, physical_lines, without_comment
from nsspice.netlist.text.source import decode


def texts(text: str) -> list[str]:
    return [" ".join(line.text.split()) for line in logical_lines(physical_lines(text), "x.net")]


def test_comments_and_continuations() -> None:
    assert texts("R1 a\n* note\n\n+ 0 1K ; end\n  * also\n;x\n+ tc1=1\nR2 b 0 1") == [
        "r1 a 0 1k tc1=1",
        "r2 b 0 1",
    ]


def test_a_line_with_the_closing_bracket_alone() -> None:
    assert texts("D1 a 0 dm\n.model dm D (\n+ is=1f\n  )\nR1 a 0 1") == [
        "d1 a 0 dm",
        ".model dm d ( is=1f )",
        "r1 a 0 1",
    ]


@pytest.mark.parametrize(
    ("raw", "kept"),
    [
        ("R1 a 0 1 ; x", "R1 a 0 1"),
        ("R1 a 0 1;x", "R1 a 0 1"),
        ("R1 a 0 1 $ x", "R1 a 0 1"),
        ("R1 a$b 0 1", "R1 a$b 0 1"),
        ("R1 a 0 1 // x", "R1 a 0 1"),
        ("R1 a 0 1 # x", "R1 a 0 1 # x"),
        ("R1 a 0 {2*3}", "R1 a 0 {2*3}"),
        ('.include "a//b;c.lib" ; x', '.include "a//b;c.lib"'),
        ("$ all", ""),
    ],
)
def test_end_of_line_comments(raw: str, kept: str) -> None:
    assert without_comment(raw) == kept


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_line_ends(ending: str) -> None:
    deck = parse_text(ending.join(["title", "R1 a 0 1", "R2 a 0 2"]))
    assert [e.span.line for e in deck.elements] == [2, 3]


def test_the_place_in_a_continued_line() -> None:
    with pytest.raises(NetlistError) as caught:
        parse_text("title\nR1 a 0\n* note\n+   1k\n+ tcx=5")
    assert (caught.value.line, caught.value.column) == (5, 3)
    assert caught.value.diagnostics[0].span.text == "+ tcx=5"


def test_the_first_line_is_the_title() -> None:
    deck = parse_text("R1 a 0 1k\nR2 a 0 1k")
    assert deck.title == "R1 a 0 1k"
    assert [e.name for e in deck.elements] == ["r2"]
    assert [w.code for w in deck.warnings] == ["NS1092"]


@pytest.mark.parametrize(
    "title", ["Buck converter 12 V to 5 V", "RC filter", "* title", "V and I", ""]
)
def test_ordinary_titles_are_not_doubted(title: str) -> None:
    deck = parse_text(f"{title}\nR1 a 0 1k")
    assert deck.title == title
    assert not deck.warnings


def test_title_card_and_end() -> None:
    deck = parse_text("old\n.title The New One\nR1 a 0 1k\n.END\nnonsense ( here")
    assert deck.title == "The New One"
    assert len(deck.elements) == 1


def test_letters_that_grow_when_lowered_keep_their_columns() -> None:
    deck = parse_text("title\nR1 İİ 0 2k2")
    assert deck.warnings[0].span.column == 9


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16", "utf-16-le"])
def test_encodings(tmp_path, encoding: str) -> None:
    path = tmp_path / "a.net"
    path.write_bytes("* by some program\nC1 out 0 10µF\n.end\n".encode(encoding))
    deck = parse_file(path)
    assert deck.title == "* by some program"
    assert deck.elements[0].value == 10e-6


def test_utf_16_big_endian_without_mark() -> None:
    assert decode("* title".encode("utf-16-be")) == "* title"


def test_unreadable_files(tmp_path) -> None:
    for path in (tmp_path / "none.net", tmp_path):
        with pytest.raises(NetlistError) as caught:
            parse_file(path)
        assert caught.value.code == "NS1050"
