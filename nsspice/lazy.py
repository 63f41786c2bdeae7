"""What is imported when it is first used: public names of a package (PEP 562), other packages.

A small deck needs few of the modules, and loading all of them would take longer than its
simulation.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from typing import Any


def lazily(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package.

    Parameters
    ----------
    package : str
        Its full name.
    homes : mapping of str to str
        Module of each name, relative to the package: ``{"Resistor": ".resistor"}``.

    Returns
    -------
    callable
        It imports a name, stores it in the package, and raises AttributeError for other names.

    Examples
    --------
    >>> lazily("nsspice.problems", {"Csc": ".csc"})("Csc").__name__
    'Csc'
    """

    def load(name: str) -> Any:
        home = homes.get(name)
        if home is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(home, package), name)
        setattr(sys.modules[package], name, value)
        return value

    return load


def need_library(name: str, install: str = "", instead: str = "") -> Any:
    """Return a package that is not installed together with this one.

    Parameters
    ----------
    name : str
        Module to import: ``pyarrow.parquet``.
    install : str
        What pip installs; the package by default.
    instead : str
        What works without it, a clause: ``write .csv or .npz``.

    Raises
    ------
    UsageError
        NS4010 if it is missing, with the way to get it.

    Examples
    --------
    >>> need_library("json").__name__
    'json'
    """
    try:
        return import_module(name)
    except ImportError as error:
        from .errors import Diagnostic, UsageError

        package = name.partition(".")[0]
        hint = f"pip install {install or package}" + (f", or {instead}" if instead else "")
        message = f"this needs the package {package}, which is not installed"
        raise UsageError(Diagnostic("NS4010", message, hint=hint)) from error


@cache
def resolve(place: str) -> Any:
    """Return what is at a place of this package, imported when it is first asked for.

    Parameters
    ----------
    place : str
        ``.module:name`` relative to the package, or ``module:name``.

    Examples
    --------
    >>> resolve(".devices.effect:Effect").__name__
    'Effect'
    """
    module, _, name = place.partition(":")
    return getattr(import_module(module, __package__), name)
