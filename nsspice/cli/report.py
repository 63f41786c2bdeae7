"""Messages on standard error, as text or as JSON."""

from __future__ import annotations

import os
import re
import shutil
import sys
import textwrap
from collections.abc import Iterable
from typing import Any

import click

from ..errors import Diagnostic, NsspiceError
from ..output.safe_text import visible

#: what is coloured on a terminal: findings, and verdicts
_COLOURED = re.compile(
    r"(?P<red>\berror NS\d{4}:|\bcertificate FAILS\b|\btolerance not met:|\bINTERRUPTED\b)"
    r"|(?P<yellow>\bwarning NS\d{4}:)"
    r"|(?P<green>\bcertificate holds\b)"
    r"|(?P<cyan>^ +\^+$|^ +hint:)",
    flags=re.MULTILINE,
)
_NARROWEST = 40


def say(text: str = "") -> None:
    """Print lines on standard error, as far as its encoding can show them.

    On a terminal findings and verdicts are coloured (unless NO_COLOR is set), and long lines are
    broken between words.
    """
    text = visible(text)
    stream = sys.stderr
    try:
        if stream.isatty():
            text = wrapped(text, shutil.get_terminal_size().columns)
            text = text if "NO_COLOR" in os.environ else coloured(text)
        stream.write(text + "\n")
        stream.flush()
    except UnicodeEncodeError:
        encoding = stream.encoding or "ascii"
        stream.write(text.encode(encoding, "replace").decode(encoding) + "\n")
        stream.flush()
    except OSError:  # nobody reads messages now; the exit code still reports it
        pass


def coloured(text: str) -> str:
    r"""Return a text whose findings and verdicts have colours.

    Examples
    --------
    >>> coloured("  certificate holds: laws 0")
    '  \x1b[32m\x1b[1mcertificate holds\x1b[0m: laws 0'
    """
    return _COLOURED.sub(lambda m: click.style(m[0], fg=m.lastgroup, bold=True), text)


def wrapped(text: str, width: int) -> str:
    r"""Return a text with long lines broken between words, the rest of each moved in.

    Lines of a deck with a caret below them stay as they are.

    Examples
    --------
    >>> print(wrapped("  energy: delivered 1 J, dissipated 1 J, stored 0 J", 40))
      energy: delivered 1 J, dissipated 1 J,
        stored 0 J
    """
    lines = text.split("\n")
    marked = {k - 1 for k, line in enumerate(lines) if re.fullmatch(r" +\^+", line)}
    shown = []
    for k, line in enumerate(lines):
        indent = len(line) - len(line.lstrip()) + 2
        if len(line) <= width or k in marked or width < max(_NARROWEST, 2 * indent):
            shown.append(line)
        else:
            shown += textwrap.wrap(
                line,
                width,
                subsequent_indent=" " * indent,
                break_long_words=False,
                break_on_hyphens=False,
            )
    return "\n".join(shown)


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
