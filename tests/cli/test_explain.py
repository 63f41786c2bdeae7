"""nsspice explain: class, effects and matrices without a simulation."""

from __future__ import annotations

import json
from pathlib import Path


def test_text(call):
    result = call("explain", "rc.net")
    assert result.exit_code == 0
    assert "LINEAR_DAE" in result.stdout
    assert "c1" in result.stdout
    assert not list(Path().glob("*.csv"))


def test_json_with_matrices(call):
    data = json.loads(call("explain", "rc.net", "--json", "--matrices").stdout)
    (island,) = data["islands"]
    assert island["class"] == "LINEAR_DAE"
    assert island["dlcp"]["A"] == [[-1000.0]]


def test_errors(call):
    assert call("explain", "wrong.net").exit_code == 2
    assert call("explain", "none.net").exit_code == 2


def test_the_method_named_is_the_one_that_runs(call):
    deck = Path("rc.net").read_text()
    for extra, said, done in (
        ("", "mode-wise", "modewise"),
        (".options method=moreau\n", "implicit time steps", "moreau"),
        (".options method=sdirk\n", "error control", "sdirk"),
    ):
        Path("one.net").write_text(deck.replace(".tran", f"{extra}.tran", 1))
        assert said in call("explain", "one.net").stdout
        (island,) = json.loads(call("run", "one.net", "--json").stdout)["runs"][0]["islands"]
        assert island["method"] == done
