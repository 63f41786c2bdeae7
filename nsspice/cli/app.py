"""The command group: commands are imported when they are called."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from .. import __version__
from ..analyses.request.interrupts import end_like_ctrl_c
from ..errors import NsspiceError, suggest
from .help import examples_of
from .report import broken_pipe, report_error, report_interrupt, report_os_error

_PIPE = 141  # what a shell shows of a program that SIGPIPE ended: 128 + 13

_COMMANDS = {
    "run": "simulate a netlist: CSV, plot and summary",
    "explain": "show how a netlist would be solved, without solving it",
    "effects": "find out which effects matter, and what they cost",
    "cost": "measure what accuracy costs with every method",
    "test": "check netlists against the numbers in X.expect.toml",
    "sweep": "run a netlist at many points and print one table",
    "tune": "find parameters that bring measures to given values",
    "tolerance": "show how parameter tolerances spread the measures",
    "bounds": "prove what measures cannot leave over tolerances",
    "compare": "compare a simulation with ngspice or a reference waveform",
    "plot": "draw CSV files on a shared axis",
    "draw": "draw the schematic of a netlist",
    "convert": "turn a deck of another program into a clean one",
    "verify": "certify a stored result again, without running it",
    "examples": "list or copy the collection of netlists",
    "plecs": "turn a PLECS thermal description into a model card",
    "magnetics": "write currents and voltages of windings for OpenMagnetics",
    "fmu": "export a deck as an FMU for co-simulation",
    "serve-mcp": "serve decks to agents over MCP",
    "completion": "let the shell complete commands and options",
}


class _Lazy(click.Group):
    """A group that imports a command's module when it is called, and turns errors into exit codes.

    0 done, 1 a check failed, 2 usage or netlist error, 3 no numerical solution, 130 interrupted.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the commands in the order in which they are documented."""
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return a command from the module of its name."""
        if cmd_name not in _COMMANDS:
            return None
        module = import_module(f".commands.{cmd_name.replace('-', '_')}", __package__)
        command: click.Command = module.command
        command.epilog = command.epilog or examples_of(cmd_name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that the arguments name, or fail with the nearest name."""
        if args and args[0] not in _COMMANDS and not args[0].startswith("-"):
            if args[0].lower().endswith((".net", ".cir", ".sp", ".asc")):
                hint = f"did you mean nsspice run {args[0]}?"
            else:
                hint = suggest(args[0], _COMMANDS) or f"commands: {', '.join(_COMMANDS)}"
            raise click.UsageError(f"there is no command {args[0]!r}; {hint}", ctx)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl(list(_COMMANDS.items()))

    def main(self, args: Sequence[str] | None = None, *rest: Any, **extra: Any) -> Any:
        """Run, with every foreseen failure described in a sentence."""
        given = list(sys.argv[1:] if args is None else args)
        if args is None:  # a process of its own
            end_like_ctrl_c()
        as_json = "--json" in given
        try:
            return super().main(given, *rest, **extra)
        except NsspiceError as error:
            report_error(error, as_json)
            code = error.exit_code
        except BrokenPipeError:
            broken_pipe()
            code = _PIPE
        except OSError as error:
            report_os_error(error, as_json)
            code = 2
        except KeyboardInterrupt:
            report_interrupt()
            code = 130
        raise SystemExit(code)

    def invoke(self, ctx: click.Context) -> Any:
        """Keep Ctrl-C and closed pipes from click, which would exit with 1."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            report_interrupt()
            ctx.exit(130)
        except BrokenPipeError:
            broken_pipe()
            ctx.exit(_PIPE)
        except OSError as error:
            report_os_error(error, "--json" in sys.argv)
            ctx.exit(2)


def _include(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    if value:
        click.echo(Path(__file__).resolve().parents[1] / "include")
        ctx.exit()


@click.group(cls=_Lazy, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--include",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_include,
    help="Print the folder of nsspice/controller.h, and exit.",
)
@click.version_option(__version__, message="nsspice %(version)s")
def app() -> None:
    """Simulate circuits with ideal diodes, switches and other set-valued elements.

    Exit codes: 0 done, 1 a check or comparison failed, 2 usage or netlist error, 3 no numerical
    solution, 130 interrupted.
    """
