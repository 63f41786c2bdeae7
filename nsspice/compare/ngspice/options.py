"""How ngspice is run, and what replaces the laws that it does not have."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ...errors import Diagnostic, UsageError

#: ways to run ngspice, in the order in which they are tried
RUNNERS = ("library", "program")

#: resistances of an ideal element while it conducts and while it blocks [Ohm], sharpest first
SHARPNESS = ((1e-6, 1e12), (1e-3, 1e9), (1e-3, 1e7), (1e-2, 1e6))
#: SPICE's own tolerances, with which ngspice finishes where tighter ones make it reject all steps
OWN_TOLERANCES = {"reltol": 1e-3, "abstol": 1e-12, "vntol": 1e-6}
#: resistances from every node to ground [Ohm] that may help ngspice
SHUNTS = (1e9, 1e7)


@dataclass(frozen=True, slots=True)
class Options:
    """Tolerances of ngspice, and the sharpness of its substitutes for set-valued laws.

    Parameters
    ----------
    junction : str or float
        What stands for a set-valued diode: ``"sidiode"`` (XSPICE's piecewise-linear diode), or the
        emission coefficient N of an exponential junction; ``"auto"`` takes ``sidiode`` where the
        code models of ngspice are installed and a junction with N = 0.01 elsewhere.
    saturation : float
        IS of that junction [A].
    ron, roff : float or None
        Resistance of ideal diodes and switches while they conduct and while they block [Ohm]; None
        for the sharpest of ``SHARPNESS`` with which ngspice finishes.
    reltol, abstol, vntol : float
        ngspice's tolerances: relative, of currents [A], of voltages [V].
    gmin : float
        Conductance that ngspice puts in parallel with every junction [S].
    rshunt : float or None
        Resistance from every node to ground [Ohm]; None for none, unless ngspice fails without.
    method : str
        ``trap`` or ``gear``.
    max_step : float or None
        Largest time step [s]; None for the smallest of the deck's own, half the distance of its
        rows, and a 10 000th of the run.
    edge : float or None
        Length of the ramp that stands for an ideal edge [s]; None for a thousandth of ``max_step``.
    runner : str or None
        ``library`` (PySpice and libngspice in a child process), ``program`` (``ngspice -b``), or
        None for the first one that is installed.
    timeout : float
        Longest time that ngspice may take [s].

    Examples
    --------
    >>> Options(junction=0.01).diode
    'junction with N=0.01'
    """

    junction: str | float = "auto"
    saturation: float = 1e-12
    ron: float | None = None
    roff: float | None = None
    reltol: float = 1e-6
    abstol: float = 1e-12
    vntol: float = 1e-9
    gmin: float = 1e-15
    rshunt: float | None = None
    method: str = "gear"
    max_step: float | None = None
    edge: float | None = None
    runner: str | None = None
    timeout: float = 300.0

    def __post_init__(self) -> None:
        junction = self.junction
        if isinstance(junction, str) and junction not in ("auto", "sidiode"):
            raise _wrong("junction", junction, "give auto, sidiode, or a number such as 0.01")
        if self.method not in ("trap", "gear"):
            raise _wrong("method", self.method, "give trap or gear")
        if self.runner is not None and self.runner not in RUNNERS:
            raise _wrong("runner", self.runner, "give library or program")
        positive = {
            "saturation": self.saturation,
            "ron": 1.0 if self.ron is None else self.ron,
            "roff": 1.0 if self.roff is None else self.roff,
            "rshunt": 1.0 if self.rshunt is None else self.rshunt,
            "reltol": self.reltol,
            "abstol": self.abstol,
            "vntol": self.vntol,
            "gmin": self.gmin,
            "timeout": self.timeout,
            "max_step": 1.0 if self.max_step is None else self.max_step,
            "edge": 1.0 if self.edge is None else self.edge,
            "junction": 1.0 if isinstance(junction, str) else junction,
        }
        for name, value in positive.items():
            if not 0.0 < value < math.inf:
                raise _wrong(name, value, "give a positive number")

    @property
    def diode(self) -> str:
        """What stands for a set-valued diode, in words."""
        if isinstance(self.junction, str):
            return self.junction
        return f"junction with N={self.junction:g}"

    @property
    def resistances(self) -> tuple[float, float]:
        """``ron`` and ``roff``, the sharpest where they are left open."""
        ron, roff = SHARPNESS[0]
        return self.ron or ron, self.roff or roff

    def attempts(self, exact: bool) -> list[Options]:
        """Return these options with everything that may be tried, sharpest first.

        Parameters
        ----------
        exact : bool
            True if ngspice has every law, so that ``ron`` and ``roff`` do not matter.
        """
        pairs = [(self.ron or ron, self.roff or roff) for ron, roff in SHARPNESS]
        tried = [replace(self, ron=ron, roff=roff) for ron, roff in dict.fromkeys(pairs)]
        if exact:
            tried = tried[:1]
        last = tried[-1]
        looser = {name: max(getattr(self, name), value) for name, value in OWN_TOLERANCES.items()}
        if (relaxed := replace(last, **looser)) != last:
            tried.append(relaxed)
        if self.rshunt is None:
            tried += [replace(last, rshunt=rshunt) for rshunt in SHUNTS]
        return tried

    def card(self) -> str:
        """Return the ``.options`` card."""
        shunt = "" if self.rshunt is None else f" rshunt={self.rshunt!r}"
        return (
            f".options reltol={self.reltol!r} abstol={self.abstol!r} vntol={self.vntol!r} "
            f"gmin={self.gmin!r} chgtol=1e-16 trtol=1 method={self.method} "
            f"itl1=1000 itl2=1000 itl4=50{shunt}"
        )


def _wrong(name: str, value: object, hint: str) -> UsageError:
    return UsageError(Diagnostic("NS4005", f"{name} of ngspice cannot be {value!r}", hint=hint))
