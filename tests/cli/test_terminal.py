"""What people see in a terminal: results first, colours, whole words, help with examples."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable
from pathlib import Path

import click
import pytest
from click.testing import Result

from nsspice.cli.app import app
from nsspice.cli.report import coloured, say, wrapped

Call = Callable[..., Result]


def test_measures_come_first_and_details_on_request(call: Call) -> None:
    short = call("run", "rc.net").stderr
    lines = short.splitlines()
    assert lines[1] == "  measures:"
    assert "  certificate holds: " in short
    assert "island" not in short
    assert "energy" not in short
    long = call("run", "rc.net", "-v", "--force").stderr
    assert "island 1: " in long
    assert "energy: delivered" in long


def test_every_help_page_ends_with_examples_that_can_be_typed() -> None:
    context = click.Context(app, info_name="nsspice")
    found = 0
    for name in app.list_commands(context):  # type: ignore[attr-defined]
        command = app.get_command(context, name)  # type: ignore[attr-defined]
        if name == "completion":
            continue
        text = command.get_help(click.Context(command, info_name=name, parent=context))
        text = text.partition("Examples:\n")[2]
        examples = [x.strip() for x in text.splitlines() if x.strip().startswith("nsspice ")]
        assert examples, name
        for example in examples:
            program, called, *arguments = shlex.split(example)
            assert (program, called) == ("nsspice", name)
            # unknown options and values that cannot be read are refused here
            command.make_context(called, arguments, parent=context)
            found += 1
    assert found >= 14


def test_findings_and_verdicts_are_coloured_on_a_terminal_only(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = "a.net:2:1: error NS1001: unknown card .trn\n  .trn 1 2\n  ^^^^\n  hint: .tran?"
    say(text)
    assert capsys.readouterr().err == text + "\n"
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    say(text)
    shown = capsys.readouterr().err
    assert "\x1b[31m" in shown
    assert click.unstyle(shown) == text + "\n"
    monkeypatch.setenv("NO_COLOR", "1")
    say(text)
    assert capsys.readouterr().err == text + "\n"


def test_long_lines_are_broken_between_words_but_not_those_with_a_caret() -> None:
    text = f"{'word ' * 30}\n  {'x' * 100}\n  {'^' * 3}"
    first, *rest, code, caret = wrapped(text, 60).split("\n")
    assert max(map(len, (first, *rest))) <= 60
    assert " ".join((first, *rest)).split() == ["word"] * 30
    assert (code, caret) == (f"  {'x' * 100}", "  ^^^")
    assert coloured("nothing to see") == "nothing to see"


@pytest.mark.parametrize(
    "line",
    ["D1 a 0 xx", "S1 a 0 b 0 xx", "W1 a 0 V1 xx", "Q1 a b 0 xx", "M1 a b 0 xx", "J1 a b 0 xx",
     "Z1 a b 0 xx"],
)  # fmt: skip
def test_the_hint_for_a_missing_model_is_a_card_that_works(call: Call, line: str) -> None:
    deck = f"title\nV1 a 0 1\nV2 b 0 1\n{line}\n.op\n"
    Path("x.net").write_text(deck, "utf-8")
    told = call("explain", "x.net")
    assert told.exit_code == 2
    (card,) = (x.split("add ")[1] for x in told.stderr.splitlines() if "hint: add .model" in x)
    Path("x.net").write_text(deck + card + "\n", "utf-8")
    assert call("explain", "x.net").exit_code == 0


def test_random_values_name_the_command_that_draws_them(call: Call) -> None:
    Path("x.net").write_text("title\nV1 a 0 1\nR1 a 0 {mc(1k, 0.1)}\n.op\n", "utf-8")
    assert "nsspice tolerance" in call("run", "x.net").stderr
