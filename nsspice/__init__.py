"""nsspice: a circuit simulator for networks with set-valued elements.

Ideal diodes and switches, Zener diodes and piecewise-linear curves are kept as they are: no
parasitics, no shrinking steps.  The public names are loaded when they are first used, so that
``import nsspice`` costs next to nothing.

Examples
--------
>>> import nsspice
>>> circuit = nsspice.read('''half-wave rectifier
... V1 in 0 SIN(0 10 50)
... D1 in out
... R1 out 0 1k
... .tran 1m 20m
... ''')
>>> solution = circuit.run()[0]
>>> bool(abs(solution["v(out)"].max() - 10.0) < 1e-9)
True
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

__all__ = [
    "Circuit",
    "InfeasibleError",
    "NetlistError",
    "NsspiceError",
    "NumericalError",
    "OutputError",
    "RegularityError",
    "Solution",
    "StepError",
    "TopologyError",
    "UsageError",
    "__version__",
    "check",
    "cost",
    "dc",
    "op",
    "read",
    "run",
    "tran",
]

if TYPE_CHECKING:
    from .analyses import Solution, dc, op, read, run, tran
    from .circuit import Circuit
    from .compare.cost import cost
    from .compare.expect import check
    from .errors import (
        InfeasibleError,
        NetlistError,
        NsspiceError,
        NumericalError,
        OutputError,
        RegularityError,
        StepError,
        TopologyError,
        UsageError,
    )

_HOME = {
    "Circuit": ".circuit",
    "Solution": ".analyses",
    "check": ".compare.expect",
    "cost": ".compare.cost",
    "dc": ".analyses",
    "op": ".analyses",
    "read": ".analyses",
    "run": ".analyses",
    "tran": ".analyses",
}


def __getattr__(name: str) -> Any:
    """Import a public name from its home the first time it is asked for."""
    if name not in __all__:
        raise AttributeError(f"module 'nsspice' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(_HOME.get(name, ".errors"), __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
