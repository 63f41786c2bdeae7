"""Reading ``X.expect.toml``: every key is known, every check has a tolerance."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import Diagnostic, NetlistError, UsageError, suggest
from .checks import Check, check_from

_ENDING = ".expect.toml"
_TOP = ("source", "run", "check", "refused")
_RUN = ("step", "theta", "method", "params", "tstop")
_REFUSED = ("code", "exit", "mentions")


@dataclass(frozen=True, slots=True)
class Refusal:
    """An error that the deck must raise.

    Parameters
    ----------
    code : str
    exit : int or None
        Exit code of the command line.
    mentions : tuple of str
        Words that the message must contain.
    """

    code: str
    exit: int | None = None
    mentions: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Expectation:
    """The content of one file.

    Parameters
    ----------
    netlist : Path
    source : str
        Where the numbers come from.
    checks : tuple of Check
    refused : Refusal or None
    step, theta, method, params, tstop
        Overrides, as on the command line.
    """

    netlist: Path
    source: str
    checks: tuple[Check, ...]
    refused: Refusal | None
    step: float | None = None
    theta: float | None = None
    method: str | None = None
    tstop: float | None = None
    params: Mapping[str, float] | None = None


def read_expectation(path: Path) -> Expectation:
    """Read the expectation of a netlist.

    Parameters
    ----------
    path : Path
        ``X.net`` or ``X.expect.toml``.

    Raises
    ------
    UsageError
        NS4012 if the file is missing, is not TOML, or holds an unknown or wrong item.
    """
    file, netlist = _names(path)
    data = _load(file)
    _known(file, "the file", data, _TOP)
    source = data.get("source")
    if not isinstance(source, str) or not source.strip():
        raise _bad(file, 'it needs source = "where the numbers come from"')
    run = data.get("run", {})
    _known(file, "[run]", run, _RUN)
    refused = data.get("refused")
    items = data.get("check", [])
    if not isinstance(items, list):
        raise _bad(file, "checks are written [[check]]")
    if bool(items) == (refused is not None):
        raise _bad(file, "it needs either [[check]] items or one [refused] table")
    checks = []
    for number, item in enumerate(items, 1):
        try:
            checks.append(check_from(item))
        except ValueError as error:
            raise _bad(file, f"[[check]] number {number}: {error}") from None
        except NetlistError as error:
            message = error.diagnostics[0].message
            raise _bad(file, f"[[check]] number {number}: {message}") from None
    return Expectation(
        netlist,
        source.strip(),
        tuple(checks),
        _refusal(file, refused),
        _number(file, run, "step"),
        _number(file, run, "theta"),
        _text(file, run, "method"),
        _number(file, run, "tstop"),
        _params(file, run.get("params", {})) or None,
    )


def _params(file: Path, table: Any) -> dict[str, float]:
    """Return the values of ``[run.params]``."""
    if not isinstance(table, dict):
        raise _bad(file, "params must be a table", "write params = { r = 1000.0 }")
    return {key.lower(): _number(file, table, key) or 0.0 for key in table}


def _text(file: Path, table: Mapping[str, Any], key: str) -> str | None:
    value = table.get(key)
    if value is not None and not isinstance(value, str):
        raise _bad(file, f"{key} must be a string")
    return value


def _names(path: Path) -> tuple[Path, Path]:
    """Return the expectation file and its netlist."""
    if path.name.endswith(_ENDING):
        stem = path.name[: -len(_ENDING)]
        for ending in (".net", ".cir", ".sp"):
            if (netlist := path.with_name(stem + ending)).exists():
                return path, netlist
        raise _bad(path, f"there is no netlist {stem}.net next to it")
    return path.with_name(path.stem + _ENDING), path


def _load(file: Path) -> dict[str, Any]:
    try:
        import tomllib
    except ImportError:  # Python 3.10
        import tomli as tomllib  # type: ignore[import-not-found, no-redef, unused-ignore]
    try:
        with file.open("rb") as stream:
            return tomllib.load(stream)
    except FileNotFoundError:
        raise _bad(
            file, "there is no such file", "write one: source, and [[check]] items"
        ) from None
    except OSError as error:
        raise _bad(file, error.strerror or str(error)) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise _bad(file, f"it is not TOML: {error}") from None


def _known(file: Path, where: str, table: Any, keys: tuple[str, ...]) -> None:
    if not isinstance(table, dict):
        raise _bad(file, f"{where} must be a table")
    for key in table:
        if key not in keys:
            raise _bad(
                file,
                f"{where} has the unknown key {key!r}",
                suggest(key, keys) or f"keys: {', '.join(keys)}",
            )


def _number(file: Path, table: Mapping[str, Any], key: str) -> float | None:
    value = table.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _bad(file, f"{key} must be a number")
    if not math.isfinite(value):
        raise _bad(file, f"{key} must be a finite number, not {value}")
    return float(value)


def _refusal(file: Path, table: Any) -> Refusal | None:
    if table is None:
        return None
    _known(file, "[refused]", table, _REFUSED)
    code, exit_code = table.get("code"), table.get("exit")
    if not isinstance(code, str):
        raise _bad(file, '[refused] needs code = "NS...."')
    if exit_code is not None and not isinstance(exit_code, int):
        raise _bad(file, "exit must be a whole number")
    words = table.get("mentions", [])
    if not isinstance(words, list):
        raise _bad(file, "mentions must be a list", 'write mentions = ["v1", "d1"]')
    return Refusal(code, exit_code, tuple(map(str, words)))


def _bad(file: Path, message: str, hint: str = "") -> UsageError:
    return UsageError(Diagnostic("NS4012", f"{file}: {message}", hint=hint))
