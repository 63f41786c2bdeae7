"""Messages on standard error, as text or as JSON."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from typing import Any

import click

from ..errors import Diagnostic, NsspiceError
from ..output.safe_text import visible


def say(text: str = "") -> None:
    """Print a line on standard error, as far as its encoding can show it."""
    text = visible(text)
    stream = sys.stderr
    try:
        stream.write(text + "\n")
        stream.flush()
    except UnicodeEncodeError:
        encoding = stream.encoding or "ascii"
        stream.write(text.encode(encoding, "replace").decode(encoding) + "\n")
        stream.flush()
    except OSError:  # nobody reads messages any more; the exit code still says it
        pass


def show(text: str, nl: bool = True) -> None:
    """Print a text on standard output."""
    click.echo(visible(text), nl=nl)


def print_json(data: Any, stream: Any = None) -> None:
    """Print one JSON document on standard output, or on the given stream."""
    import json

    stream = stream or sys.stdout
    text = json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False)
    stream.write(visible(text, "\\u00{:02x}") + "\n")
    stream.flush()


def report_error(error: NsspiceError, as_json: bool) -> None:
    """Print all findings of an error."""
    if as_json:
        print_json(
            {
                "errors": [d.to_dict() for d in error.diagnostics],
                "exit_code": error.exit_code,
            },
            sys.stderr,
        )
        return
    for diagnostic in error.diagnostics:
        say(diagnostic.render())
    count = sum(d.severity == "error" for d in error.diagnostics)
    if count > 1:
        say(f"{count} errors")


def report_warnings(warnings: Iterable[Diagnostic]) -> None:
    """Print warnings."""
    for warning in warnings:
        say(warning.render())


def report_os_error(error: OSError, as_json: bool) -> None:
    """Print an error of the file system that no command foresaw."""
    from ..output.files import output_error

    report_error(output_error(error, str(error.filename or "a file")), as_json)


def report_interrupt() -> None:
    """Say that Ctrl-C ended the program before anything was computed."""
    say("interrupted")


def broken_pipe() -> None:
    """Let the interpreter end quietly when the reading end of standard output has gone.

    ``nsspice run a.net -o - | head`` has shown what was asked for: nothing is wrong.
    """
    # the interpreter flushes standard output once more when it ends
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
