"""Public names of a package that are imported from their homes when they are first used (PEP 562).

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
