"""``.control`` blocks, lines after ``.end``, and analyses beside those that are computed."""

from __future__ import annotations

import pytest

from nsspice import read
from nsspice.analyses.studies.batch import jobs_of
from nsspice.errors import UsageError
from nsspice.netlist import Deck, parse_text
from nsspice.netlist.deck import DcCard, OpCard, TranCard

CIRCUIT = "title\nV1 in 0 5\nR1 in out 1k\nC1 out 0 1u\n"


def deck(*lines: str) -> Deck:
    return parse_text(CIRCUIT + "\n".join(lines))


def test_analyses_of_a_script_that_only_looks() -> None:
    found = deck(
        ".control",
        "  set color0=white",
        "  op",
        "  TRAN 1u 1m uic",
        "  dc v1 0 5 1",
        "  meas tran late find v(out) at=1m",
        "  plot v(out)",
        ".endc",
    )
    point, transient, sweep = found.analyses
    assert isinstance(point, OpCard)
    assert isinstance(sweep, DcCard)
    assert isinstance(transient, TranCard)
    assert (transient.tstep, transient.tstop, transient.uic) == (1e-6, 1e-3, True)
    assert (transient.span.line, transient.span.column) == (8, 3)
    (warning,) = found.warnings
    assert "'op', 'TRAN 1u 1m uic', 'dc v1 0 5 1' is read;" in warning.message
    assert warning.message.endswith("'plot v(out)'")


def test_the_script_runs_as_the_card_does() -> None:
    script = read(CIRCUIT + ".control\ntran 10u 1m uic\nplot v(out)\n.endc\n").run()[0]
    card = read(CIRCUIT + ".tran 10u 1m uic\n").run()[0]
    assert (script["v(out)"] == card["v(out)"]).all()


@pytest.mark.parametrize(
    "command",
    [
        "alter r1 = 2k",
        "foreach r 1 2 3",
        "let k = 1\nwhile k < 3",
        "if 1",
        "set temp = 50",
        "option temp=50",
        "source other.cir",
        "reset",
    ],
)
def test_a_program_is_not_executed(command: str) -> None:
    found = deck(".control", command, "tran 1u 1m", ".endc")
    assert not found.analyses
    (warning,) = found.warnings
    assert warning.hint == "write it as a card: .tran 1u 1m"
    with pytest.raises(UsageError) as caught:
        jobs_of(found)
    assert caught.value.diagnostics[0].hint == (
        ".control block is not executed; write it as a card: .tran 1u 1m"
    )


def test_variables_of_a_program_are_no_values() -> None:
    assert not deck(".control", "let stop = 1m", "tran 1u $&stop", ".endc").analyses


def test_cards_of_the_deck_come_first() -> None:
    found = deck(".tran 1u 1m", ".control", "tran 1u 9m", ".endc")
    (card,) = found.analyses
    assert isinstance(card, TranCard)
    assert card.tstop == 1e-3
    assert found.warnings[0].hint == "write it as a card: .tran 1u 9m"


@pytest.mark.parametrize("line", [".pz a b c d cur pol", ".disto dec 1 1 1", ".sp dec 1 1 1"])
@pytest.mark.parametrize("computed", [".op", ".tran 1u 1m", ".control\nop\n.endc"])
def test_analyses_beside_computed_ones_are_skipped(line: str, computed: str) -> None:
    found = deck(line, computed)
    assert len(found.analyses) == 1
    warning = next(w for w in found.warnings if w.code == "NS1003")
    assert warning.message == f"{line.split()[0]} is skipped"


def test_lines_after_the_end_are_told() -> None:
    found = deck(".op", ".end", "* a remark", "R2 out 0 1k", ".temp 50")
    (warning,) = found.warnings
    assert warning.code == "NS1093"
    assert warning.message == "lines after .end are not read: 'R2 out 0 1k', '.temp 50'"
    assert warning.span is not None
    assert warning.span.line == 8
    assert len(found.elements) == 3


def test_a_script_after_the_end_explains_the_missing_analysis() -> None:
    with pytest.raises(UsageError) as caught:
        jobs_of(deck(".end", ".control", "tran 1u 1m", ".endc"))
    assert "lines after .end are not read; move .end after them" in str(caught.value)


def test_a_title_card_in_the_first_line_is_no_missing_analysis() -> None:
    with pytest.raises(UsageError) as caught:
        jobs_of(parse_text(".title divider\nV1 a 0 1\nR1 a 0 1\n"))
    assert ".title" not in str(caught.value)
