"""``nsspice serve-mcp``: the simulator as tools of the Model Context Protocol."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ... import __version__
from ...lazy import need_library
from ..agent_tools import Tools

_INSTRUCTIONS = (
    "Simulates SPICE netlists with ideal diodes and switches.  A deck is the text of a netlist "
    "(first line: title) or the name of a file that files() lists.  Errors have a code, a line and "
    "a hint.  A result is reliable if its certificate passed."
)


@click.command("serve-mcp", short_help="serve decks to agents over MCP")
@click.option(
    "--folder",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    default=".",
    help="Folder of decks; nothing outside is read, nothing is written.",
    show_default=True,
)
@click.option("--seconds", default=30.0, show_default=True, help="Longest time of a call [s].")
@click.option("--memory", default=2048.0, show_default=True, help="Largest memory of a call [MB].")
def command(folder: Path, seconds: float, memory: float) -> None:
    """Offer reading, explaining, running, measuring and comparing decks to agents.

    Speaks the Model Context Protocol on standard input and output, until that is closed.  Needs the
    package mcp.
    """
    server_of(Tools(folder, seconds, memory)).run("stdio")


def server_of(tools: Tools) -> Any:
    """Return a server with these tools.

    Raises
    ------
    UsageError
        NS4010 without the package mcp.
    """
    server = need_library("mcp.server", "'nsspice[mcp]'").MCPServer(
        "nsspice", instructions=_INSTRUCTIONS, version=__version__
    )
    for tool in tools.all():
        server.add_tool(tool)
    return server
