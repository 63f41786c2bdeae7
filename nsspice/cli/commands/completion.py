"""``nsspice completion``: let the shell complete commands and options."""

from __future__ import annotations

import os
from pathlib import Path

import click
from click.shell_completion import get_completion_class

from ...errors import Diagnostic, UsageError
from ..report import say

#: where each shell looks for completions of a user, and what is still to be done there
_HOMES = {
    "bash": ("XDG_DATA_HOME", ".local/share", "bash-completion/completions/nsspice", ""),
    "fish": ("XDG_CONFIG_HOME", ".config", "fish/completions/nsspice.fish", ""),
    "zsh": (
        "ZDOTDIR",
        "",
        ".zfunc/_nsspice",
        "add these lines to .zshrc if they are not there: fpath+=~/.zfunc; "
        "autoload -Uz compinit; compinit",
    ),
}


@click.command("completion", short_help="let the shell complete commands and options")
@click.argument("shell", required=False, type=click.Choice(list(_HOMES)))
@click.option("--install", is_flag=True, help="Write it where the shell looks for it.")
def command(shell: str | None, install: bool) -> None:
    """Print the completion script of a SHELL, or install it.

    Without SHELL it is the one that $SHELL names.  New shells complete after `nsspice completion
    --install`.
    """
    shell = shell or Path(os.environ.get("SHELL", "")).name
    kind = get_completion_class(shell) if shell in _HOMES else None
    if kind is None:
        raise UsageError(
            Diagnostic(
                "NS4005",
                f"there is no completion for the shell {shell or 'with an unknown name'}",
                hint=f"name one: nsspice completion {'|'.join(_HOMES)}",
            )
        )
    from ..app import app

    text = kind(app, {}, "nsspice", "_NSSPICE_COMPLETE").source()
    if not install:
        click.echo(text)
        return
    variable, folder, name, rest = _HOMES[shell]
    target = Path(os.environ.get(variable) or Path.home() / folder) / name
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text, "utf-8")
    say(f"written: {target}" + (f"\n{rest}" if rest else "; it works in new shells"))
