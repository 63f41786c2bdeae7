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

from typing import TYPE_CHECKING

from .lazy import lazily

__version__ = "0.2.0"

__all__ = [
    "Adc",
    "CertificateError",
    "CertificateWarning",
    "Circuit",
    "Controller",
    "InfeasibleError",
    "NetlistError",
    "NsspiceError",
    "NumericalError",
    "OutputError",
    "Pwm",
    "RegularityError",
    "Solution",
    "StepError",
    "TopologyError",
    "UsageError",
    "__version__",
    "ac",
    "bounds",
    "check",
    "cost",
    "dc",
    "effects",
    "gradient",
    "loop",
    "objective",
    "op",
    "plot",
    "pss",
    "read",
    "run",
    "sens",
    "start",
    "sweep",
    "tran",
]

if TYPE_CHECKING:
    from .analyses import Solution, ac, dc, loop, op, pss, read, run, sens, tran
    from .analyses.bounds.search import bounds
    from .analyses.request.controller import Controller
    from .analyses.request.converters import Adc, Pwm
    from .analyses.studies.gradient import gradient
    from .analyses.studies.objective import objective
    from .analyses.transient.stepwise import start
    from .circuit import Circuit
    from .compare.cost import cost
    from .compare.expect import check
    from .errors import (
        CertificateError,
        CertificateWarning,
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
    from .output.overlay import plot
    from .screening import effects
    from .sweeps import sweep

_HOME = {
    "CertificateError": ".errors",
    "CertificateWarning": ".errors",
    "InfeasibleError": ".errors",
    "NetlistError": ".errors",
    "NsspiceError": ".errors",
    "NumericalError": ".errors",
    "OutputError": ".errors",
    "RegularityError": ".errors",
    "StepError": ".errors",
    "TopologyError": ".errors",
    "UsageError": ".errors",
    "Adc": ".analyses.request.converters",
    "Circuit": ".circuit",
    "Controller": ".analyses.request.controller",
    "Pwm": ".analyses.request.converters",
    "Solution": ".analyses",
    "ac": ".analyses",
    "bounds": ".analyses.bounds.search",
    "check": ".compare.expect",
    "cost": ".compare.cost",
    "dc": ".analyses",
    "loop": ".analyses",
    "objective": ".analyses.studies.objective",
    "effects": ".screening",
    "gradient": ".analyses.studies.gradient",
    "op": ".analyses",
    "plot": ".output.overlay",
    "pss": ".analyses",
    "read": ".analyses",
    "run": ".analyses",
    "sens": ".analyses",
    "start": ".analyses.transient.stepwise",
    "sweep": ".sweeps",
    "tran": ".analyses",
}


__getattr__ = lazily(__name__, _HOME)


def __dir__() -> list[str]:
    return sorted(__all__)
