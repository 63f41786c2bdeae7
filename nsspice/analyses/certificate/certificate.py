"""The certificate of a run: how well the computed points satisfy the laws of the circuit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from ...circuit.dependencies import Skipped
from .energy import Energy, worse
from .written_rows import TOLERANCE, Violation

#: Steps with error control that have taken a larger share of the energy have not met any tolerance.
TAKEN = 0.1
#: The same for the implicit steps of the mode-wise engine, whose results pass for exact.
TAKEN_BESIDE_EXACT = 1e-3
#: Steps are powers of two of the longest one, and their estimates go with the fourth power: one
#: that is a level too long errs by up to 2^4 times what was asked, only longer ones by more.
MISSED = 16.0


@dataclass(frozen=True, slots=True)
class Certificate:
    """Worst errors over all checked points of all islands.

    Parameters
    ----------
    laws : float
        Kirchhoff's laws and the element equations, relative to the currents (voltages) that meet.
    complementarity : float
        Signs and products of the set-valued elements, relative to their scale.
    checks : int
        Number of points at which both were evaluated.
    undetermined : int
        Number of steps in which the laws leave some voltage or current open (a floating part,
        diodes in parallel); the value nearest to the step before was taken.
    energy : Energy or None
        Balance of the recorded steps, None where nothing stores energy.
    jumps : float
        Worst relative balance error of charge and flux over a jump.
    worst : str
        The law that is satisfied worst: ``node a``, ``l1``.
    taken : float
        Share of the energy of the run that its steps have taken themselves: those with error
        control, and the implicit ones of the mode-wise engine.
    granted : float
        The share that they may take.
    late : float
        How far the control of a switch that chatters, and is therefore looked at now and then
        only, had passed its threshold: the part of its scale, relative to the tolerance.  Of an
        ordinary differential equation how far a step has missed the integral of its rates.
    missed : float
        Largest error of a step with error control, as the quadrature of what flows shows it, in
        units of what was asked.
    skipped : Skipped
        Elements that have not been simulated, since nothing that was asked for depends on them.
    several : tuple of str
        Elements of islands whose complementarity problems may have several solutions; empty if
        each step is proved to have one, up to what ``undetermined`` counts.

    Examples
    --------
    >>> Certificate(1e-14, 0.0, 3).passed
    True
    """

    laws: float
    complementarity: float
    checks: int
    undetermined: int = 0
    energy: Energy | None = None
    jumps: float = 0.0
    worst: str = ""
    several: tuple[str, ...] = ()
    taken: float = 0.0
    granted: float = TAKEN
    late: float = 0.0
    missed: float = 0.0
    skipped: Skipped = field(default_factory=Skipped)

    def without(self, skipped: Skipped) -> Certificate:
        """Return the certificate of a part of a circuit, which says what it does not cover."""
        return replace(self, skipped=skipped) if skipped else self

    def at_rows(self, laws: Iterable[Violation], pairs: Iterable[Violation] = ()) -> Certificate:
        """Return the certificate with the worst errors of written rows."""
        out = self
        for law in laws:
            if worse(law.error, out.laws):
                out = replace(out, laws=law.error, worst=f"{law.element} at {law.time:g} s")
        for pair in pairs:
            if worse(pair.error, out.complementarity):
                out = replace(out, complementarity=pair.error)
        return out

    def at_start(self, error: float) -> Certificate:
        """Return the certificate with the error of the first state, as that of a jump."""
        return replace(self, jumps=error) if worse(error, self.jumps) else self

    @property
    def passed(self) -> bool:
        """True if all errors are below their tolerance (nan is not)."""
        balance = self.energy is None or self.energy.drift <= TOLERANCE
        laws = self.laws <= TOLERANCE and self.complementarity <= TOLERANCE
        tolerance = self.taken <= self.granted and self.late <= 1.0 and self.missed <= MISSED
        return laws and balance and self.jumps <= TOLERANCE and tolerance

    @property
    def uniqueness(self) -> str:
        """``unique``, ``undetermined`` (a free voltage or current was chosen) or ``several``."""
        if self.several:
            return "several"
        return "undetermined" if self.undetermined else "unique"

    @classmethod
    def total(cls, parts: Iterable[Certificate]) -> Certificate:
        """Return the worst over islands."""
        parts = list(parts)
        if len(parts) == 1:
            return parts[0]
        laws, complementarity, checks, undetermined, jumps = 0.0, 0.0, 0, 0, 0.0
        late = missed = 0.0
        worst = ""
        energies: list[Energy] = []
        several: list[str] = []
        for part in parts:
            if worse(part.laws, laws):
                laws, worst = part.laws, part.worst
            complementarity = _worst(complementarity, part.complementarity)
            jumps = _worst(jumps, part.jumps)
            late = _worst(late, part.late)
            missed = _worst(missed, part.missed)
            checks += part.checks
            undetermined += part.undetermined
            several += part.several
            if part.energy is not None:
                energies.append(part.energy)
        energy = Energy.total(energies) if energies else None
        share = max(
            ((part.taken, part.granted) for part in parts),
            key=lambda share: share[0] / share[1],
            default=(0.0, TAKEN),
        )
        return cls(
            laws,
            complementarity,
            checks,
            undetermined,
            energy,
            jumps,
            worst,
            tuple(several),
            *share,
            late,
            missed,
        )

    @classmethod
    def of(cls, statistics: Iterable[Mapping[str, Any]]) -> Certificate:
        """Return the worst of the residuals that the solvers themselves report."""
        return cls.total(
            cls(
                float(stats["residual_rows"]),
                float(stats["residual_complementarity"]),
                int(stats["checks"]),
                int(stats.get("undetermined", 0)),
            )
            for stats in statistics
        )

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        return {
            "laws": self.laws,
            "complementarity": self.complementarity,
            "checks": self.checks,
            "worst": self.worst,
            "jumps": self.jumps,
            "uniqueness": self.uniqueness,
            "undetermined": self.undetermined,
            "several": list(self.several),
            "taken": self.taken,
            "late": self.late,
            "missed": self.missed,
            "skipped": list(self.skipped.elements),
            "energy": self.energy.to_dict() if self.energy else None,
            "passed": self.passed,
        }


def _worst(a: float, b: float) -> float:
    return b if worse(b, a) else a
