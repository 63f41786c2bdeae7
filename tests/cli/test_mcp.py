"""Tools for agents: what they return, what they may not read, when they are stopped."""

from __future__ import annotations

import asyncio
import json
import math
import sys
from pathlib import Path

import pytest

from nsspice.cli.agent_tools import Tools
from nsspice.errors import UsageError

RC = """RC
.param r=1k
V1 in 0 1
R1 in out {r}
C1 out 0 1u IC=0
.tran 0.1m 1m uic
.measure tran v FIND v(out) AT=1m
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    served = tmp_path / "served"
    served.mkdir()
    (served / "rc.net").write_text(RC, "utf-8")
    (tmp_path / "secret.net").write_text("secret\nV1 a 0 7\n", "utf-8")
    (served / "reference.csv").write_text("time,v(out)\n0,0\n1e-3,0.6321205588\n", "utf-8")
    (served / "link.net").symlink_to(tmp_path / "secret.net")
    return served


def test_decks_are_listed_read_run_measured_and_compared(folder: Path) -> None:
    tools = Tools(folder, 60.0)
    assert tools.files() == ["rc.net", "reference.csv"]
    assert tools.read("rc.net") == RC
    assert "islands" in tools.explain("rc.net")
    (run,) = tools.measure(RC, {"r": 2e3})["runs"]
    assert run["measures"]["v"] == pytest.approx(1.0 - math.exp(-0.5), rel=1e-9)
    assert run["passed"] is True
    found = tools.run("rc.net", signals=["v(out)"], points=6)
    (waveform,) = found["waveforms"].values()
    assert waveform["columns"] == ["time", "v(out)"]
    assert waveform["every"] == 2
    assert waveform["rows"][-1] == pytest.approx([1e-3, 1.0 - math.exp(-1.0)], rel=1e-9)
    # between its two points the reference is a line
    assert tools.compare("rc.net", "reference.csv", 0.5)["exit_code"] == 0
    assert sorted(p.name for p in folder.iterdir()) == ["link.net", "rc.net", "reference.csv"]


@pytest.mark.parametrize("name", ["../secret.net", "link.net", "/etc/passwd", "nothing.net"])
def test_nothing_outside_the_folder_is_read(folder: Path, name: str) -> None:
    tools = Tools(folder, 60.0)
    for call in (tools.read, tools.explain, tools.run, tools.measure):
        with pytest.raises(UsageError, match="no file"):
            call(name)
    with pytest.raises(UsageError, match="no file"):
        tools.compare("rc.net", name)


@pytest.mark.parametrize("card", [".include {}", ".lib {} x"])
def test_a_deck_that_includes_a_file_from_outside_is_refused(folder: Path, card: str) -> None:
    outside = folder.parent / "secret.net"
    for path in (str(outside), "../secret.net"):
        told = Tools(folder, 60.0).run(f"title\nV2 b 0 1\n{card.format(path)}\n.op\n")
        assert told["exit_code"] == 2
        assert "secret\nV1" not in json.dumps(told)
        assert "v1" not in json.dumps(told)


def test_a_long_run_is_stopped(folder: Path) -> None:
    deck = "long\nV1 in 0 SIN(0 10 50)\nD1 in out\nR1 out 0 1k\nC1 out 0 1u\n.tran 1u 1000 0 1u\n"
    assert Tools(folder, 1.0).run(deck) == {"error": "stopped after 1 s"}


def test_a_session_of_the_protocol(folder: Path) -> None:
    mcp = pytest.importorskip("mcp")
    server = mcp.StdioServerParameters(
        command=sys.executable,
        args=["-m", "nsspice", "serve-mcp", "--folder", str(folder)],
        env={"PYTHONPATH": str(Path(__file__).parents[2])},
    )

    deck = "title\nV2 b 0 1\n.include ../secret.net\n.op\n"

    async def session() -> tuple[list[str], dict[str, object], list[object]]:
        async with mcp.Client(server) as client:
            names = sorted(tool.name for tool in (await client.list_tools()).tools)
            found = await client.call_tool("measure", {"deck": "rc.net"})
            refused = [
                await client.call_tool("read", {"file": "../secret.net"}),
                await client.call_tool("run", {"deck": deck}),
            ]
            return names, json.loads(found.content[0].text), refused

    names, found, refused = asyncio.run(session())
    assert names == ["compare", "explain", "files", "measure", "read", "run"]
    measured = found["runs"][0]["measures"]["v"]  # type: ignore[index]
    assert measured == pytest.approx(1.0 - math.exp(-1.0), rel=1e-9)
    by_name, by_deck = refused
    assert by_name.is_error  # type: ignore[attr-defined]
    assert json.loads(by_deck.content[0].text)["exit_code"] == 2  # type: ignore[attr-defined]
    for told in refused:
        assert "secret\nV1" not in told.content[0].text  # type: ignore[attr-defined]
