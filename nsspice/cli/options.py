"""Options shared by several commands, and the values they take."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

from ..errors import Diagnostic, UsageError

F = TypeVar("F", bound=Callable[..., Any])

if TYPE_CHECKING:  # older versions of click know no such parameter
    _FloatType = click.ParamType[float]
else:
    _FloatType = click.ParamType


class Number(_FloatType):
    """A number as SPICE writes it: 1e-6, 1u, 10k, 2.5meg."""

    name = "number"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the number."""
        if isinstance(value, float):
            return value
        found, why = spice_number(str(value))
        if found is None:
            self.fail(f"{value!r} {why}", param, ctx)
        return found


NUMBER = Number()

#: where a command notes that its netlist may include nothing from outside
CONFINED = "nsspice.confined"
#: where it notes the seed of the values that its netlist draws
SEED = "nsspice.seed"
#: where it notes how junctions are read
JUNCTIONS = "nsspice.junctions"


def _confine(ctx: click.Context, param: click.Parameter, value: bool) -> None:
    ctx.meta[CONFINED] = value


def is_confined() -> bool:
    """Return whether the present command has ``--confined``."""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.meta.get(CONFINED))


def confined_option(command: F) -> F:
    """Add ``--confined``, which :func:`nsspice.cli.source.circuit_of` obeys."""
    return click.option(
        "--confined",
        is_flag=True,
        expose_value=False,
        callback=_confine,
        help="Refuse to include files outside the netlist's folder (for services).",
    )(command)


def junctions_option(command: F) -> F:
    """Add ``--junctions``, which :func:`nsspice.cli.source.circuit_of` obeys."""

    def note(ctx: click.Context, param: click.Parameter, value: str | None) -> None:
        ctx.meta[JUNCTIONS] = value

    return click.option(
        "--junctions",
        metavar="LAW",
        expose_value=False,
        callback=note,
        help="lines[:TOLERANCE]: junctions as broken lines, solved exactly; model: as they are.",
    )(command)


def _seed(ctx: click.Context, param: click.Parameter, value: int) -> None:
    ctx.meta[SEED] = value


def seed_option(command: F) -> F:
    """Add ``--seed``, which :func:`nsspice.cli.source.circuit_of` obeys."""
    return click.option(
        "--seed",
        type=int,
        default=0,
        metavar="N",
        expose_value=False,
        callback=_seed,
        help="Seed of the random values that the netlist draws (agauss, mc ...).",
    )(command)


def spice_number(text: str) -> tuple[float | None, str]:
    """Return the value of a SPICE number, or None and why it is not one.

    Spellings that SPICE reads otherwise than people do are refused: a command line has no place
    for a warning.

    Examples
    --------
    >>> spice_number("2.5meg"), spice_number("1u")
    ((2500000.0, ''), (1e-06, ''))
    >>> spice_number("2k2")
    (None, 'is read as 2000: digits after the suffix are ignored; write 2.2k')
    """
    from ..netlist.text.numbers import read_number

    number = read_number(text)
    if number is None or not math.isfinite(number.value):
        return None, "is not a number; write 1e-6, 1u or 10k"
    if number.trap:
        return None, f"{number.trap.partition(' ')[2]}; {number.hint}"
    return number.value, ""


def solver_options(command: F) -> F:
    """Add --method, --theta, --step and --param to a command."""
    for option in (
        click.option(
            "--param",
            "params",
            multiple=True,
            metavar="NAME=VALUE",
            help="Replace the value of a .param; may be repeated.",
        ),
        click.option("--step", type=NUMBER, metavar="H", help="Solver step [s]."),
        click.option(
            "--theta", type=NUMBER, help="Weight of the new state: 1 implicit, 0.5 trapezoidal."
        ),
        click.option(
            "--method",
            metavar="NAME",
            help="auto, modewise, sdirk or moreau; euler-newton or euler-newton-rate without "
            "energy storage.",
        ),
    ):
        command = option(command)
    return command


class Sharpness(Number):
    """``auto``, ``sidiode`` or a number."""

    name = "auto|sidiode|N"

    def convert(  # type: ignore[override]
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float | str:
        """Return the word or the number."""
        word = str(value).lower()
        return word if word in ("auto", "sidiode") else super().convert(value, param, ctx)


def ngspice_options(command: F) -> F:
    """Add the options for running ngspice."""
    for option in (
        click.option(
            "--deck", metavar="FILE", help="Write the last deck given to ngspice to a file."
        ),
        click.option(
            "--force",
            is_flag=True,
            default=None,
            help="Replace files that were not written by nsspice.",
        ),
        click.option("--timeout", type=NUMBER, help="Longest time for ngspice [s]."),
        click.option(
            "--runner",
            type=click.Choice(["library", "program"]),
            help="libngspice in a child process, or the program; by default whichever is "
            "installed.",
        ),
        click.option("--slack", type=NUMBER, help="Allowed difference of instants [s]."),
        click.option("--max-step", type=NUMBER, help="Largest time step of ngspice [s]."),
        click.option("--reltol", type=NUMBER, help="Relative tolerance of both programs."),
        click.option(
            "--gmin", type=NUMBER, help="Conductance that ngspice puts across each junction [S]."
        ),
        click.option("--roff", type=NUMBER, help="Off-resistance used for ideal elements [Ohm]."),
        click.option("--ron", type=NUMBER, help="On-resistance used for ideal elements [Ohm]."),
        click.option(
            "--junction",
            type=Sharpness(),
            help="Substitute for set-valued diodes: ngspice's piecewise-linear sidiode, or a "
            "junction with emission coefficient N.",
        ),
        click.option(
            "--plot",
            is_flag=False,
            flag_value="auto",
            metavar="[FILE]",
            help="Draw both runs in one .png, .svg or .pdf file.",
        ),
    ):
        command = option(command)
    return command


def json_option(command: F) -> F:
    """Add --json to a command."""
    return click.option("--json", "as_json", is_flag=True, help="Print JSON instead of text.")(
        command
    )


def param_option(command: F) -> F:
    """Add --param to a command without options of solvers."""
    return click.option(
        "--param", "params", multiple=True, metavar="NAME=VALUE", help="Replace a .param value."
    )(command)


def force_option(command: F) -> F:
    """Add --force to a command that writes one file."""
    return click.option(
        "--force", is_flag=True, help="Replace a file that was not written by nsspice."
    )(command)


def read_params(items: Sequence[str]) -> dict[str, float]:
    """Return the values of ``NAME=VALUE`` items.

    Raises
    ------
    UsageError
        NS4005 for an item of another form.
    """
    params = {}
    for item in items:
        name, equals, text = item.partition("=")
        value, why = spice_number(text.strip()) if equals else (None, "")
        if not name.strip() or value is None:
            hint = f"{text.strip()!r} {why}" if why else "write --param NAME=VALUE"
            raise UsageError(Diagnostic("NS4005", f"--param cannot be {item!r}", hint=hint))
        params[name.strip().lower()] = value
    return params


def read_signals(items: Sequence[str]) -> list[str] | None:
    """Return signal names, apart by blanks or by commas outside parentheses; None without any.

    Examples
    --------
    >>> read_signals(["v(a,b), i(r1)", "all"])
    ['v(a,b)', 'i(r1)', 'all']
    """
    names = []
    for item in items:
        names += [name for name in re.split(r"[,\s]+(?![^()]*\))", item.strip()) if name]
    return names or None
