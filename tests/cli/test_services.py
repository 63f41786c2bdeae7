"""What keeps a command inside its folder, and from files of others: the same in all commands."""

from __future__ import annotations

from pathlib import Path

import pytest

COMMANDS = ("run", "explain", "cost", "effects", "tune", "tolerance", "bounds", "compare")


@pytest.mark.parametrize("command", COMMANDS)
def test_a_confined_command_includes_nothing_from_outside(call, decks, command: str):
    inner = Path("inner")
    inner.mkdir()
    Path("outer.inc").write_text(".param secret=1\n")
    (inner / "a.net").write_text("t\n.include ../outer.inc\nR1 a 0 {secret}\nV1 a 0 1\n.op\n")
    found = call(command, str(inner / "a.net"), "--confined")
    assert found.exit_code == 2
    assert "NS1054" in found.stderr
    assert ".param secret" not in found.stderr


@pytest.mark.parametrize(
    "command", [("cost", "rectifier.net", "--plot", "lab.png"),
                ("compare", "rectifier.net", "--plot", "lab.png"),
                ("compare", "rectifier.net", "--deck", "lab.png")],
)  # fmt: skip
def test_files_of_others_are_not_replaced(call, decks, command: tuple[str, ...]):
    lab = Path("lab.png")
    lab.write_bytes(b"a picture of a laboratory")
    found = call(*command)
    assert found.exit_code != 0
    assert "NS4018" in found.stderr
    assert lab.read_bytes() == b"a picture of a laboratory"
