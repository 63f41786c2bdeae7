"""``nsspice draw``: a file, who conducts, and what it refuses."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

Call = Callable[..., Result]


def test_a_schematic_is_written_and_may_be_replaced(call: Call) -> None:
    assert call("draw", "rectifier.net").exit_code == 0
    assert "<svg" in Path("rectifier.svg").read_text("utf-8")
    assert call("draw", "rectifier.net").exit_code == 0
    Path("rectifier.svg").write_text("<svg>mine</svg>", "utf-8")
    assert call("draw", "rectifier.net").exit_code == 2


def test_who_conducts_at_an_instant(call: Call) -> None:
    told = call("draw", "rectifier.net", "--at", "5m", "--json")
    assert json.loads(told.stdout) == {"files": ["rectifier.svg"], "conducting": {"d1": True}}
    assert "at 15 ms conducting: nothing" in call("draw", "rectifier.net", "--at", "15m").stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("rectifier.net", "-o", "a.png"), "NS4008"),
        (("rectifier.net", "--at", "-1"), "NS4006"),
        (("stepped.net", "--at", "1m"), "NS4006"),
    ],
)
def test_what_cannot_be_drawn(call: Call, arguments: tuple[str, ...], words: str) -> None:
    told = call("draw", *arguments)
    assert told.exit_code == 2
    assert words in told.stderr
