"""The table of what accuracy costs, its plot, and the cheapest way to a target."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import groupby
from pathlib import Path
from typing import Any

from ...output.si import number
from .reference import Reference


@dataclass(frozen=True, slots=True)
class Measurement:
    """One run of one method.

    Parameters
    ----------
    method : str
    parameter : str
        What was varied: ``h``, ``reltol``, or ``""``.
    value : float
        Its value.
    steps : int
    error, l1 : float
        Largest and mean distance from the reference, as shares of the range of each signal.
    seconds : float
        Inside the process.
    order : float
        Observed: how fast the error falls with the number of steps, nan for the first of a ladder.
    note : str
        What went wrong, empty otherwise.
    """

    method: str
    parameter: str
    value: float
    steps: int
    error: float
    l1: float
    seconds: float
    order: float = float("nan")
    note: str = ""

    @property
    def per_step(self) -> float:
        """Seconds per step."""
        return self.seconds / self.steps if self.steps else float("nan")

    @property
    def setting(self) -> str:
        """The varied parameter with its value."""
        return f"{self.parameter}={self.value:.3g}" if self.parameter else ""

    @property
    def sentence(self) -> str:
        """What it has shown."""
        return self.note or f"{number(self.seconds, 's', 3)}, error {self.error:.1e}"

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-ready mapping; what is not known is None."""
        numbers = {
            "value": self.value,
            "error": self.error,
            "l1": self.l1,
            "seconds": self.seconds,
            "seconds_per_step": self.per_step,
            "order": self.order,
        }
        known = {key: value if math.isfinite(value) else None for key, value in numbers.items()}
        return {
            "method": self.method,
            "parameter": self.parameter,
            "steps": self.steps,
            "note": self.note,
            **known,
        }


@dataclass(frozen=True, slots=True)
class Advice:
    """How one method reaches a target.

    Parameters
    ----------
    method, setting : str
    seconds : float
    measured : bool
        False if extrapolated from the last run by the observed order.
    """

    method: str
    setting: str
    seconds: float
    measured: bool

    def __str__(self) -> str:
        what = " ".join(filter(None, [self.method, self.setting]))
        how = "measured" if self.measured else "extrapolated"
        return f"{what}, {number(self.seconds, 's', 3)} ({how})"


@dataclass(slots=True)
class CostReport:
    """What accuracy costs for one deck.

    Parameters
    ----------
    title : str
    signals : list of str
    reference : Reference
    rows : list of Measurement
        Those of a method come together, from coarse to fine.
    absent : list of str
        What was not measured, and why.
    default : str
        Method and time of a run of the deck as it is.
    interrupted : bool
        True if it was stopped early.
    """

    title: str
    signals: list[str]
    reference: Reference
    rows: list[Measurement] = field(default_factory=list)
    absent: list[str] = field(default_factory=list)
    default: str = ""
    interrupted: bool = False

    def ladders(self) -> dict[str, list[Measurement]]:
        """Return the finished runs of each method."""
        finished = [r for r in self.rows if math.isfinite(r.error)]
        return {name: list(rows) for name, rows in groupby(finished, key=lambda r: r.method)}

    def cheapest(self, target: float) -> list[Advice]:
        """Return how each method reaches an error, the cheapest first.

        Parameters
        ----------
        target : float
            Largest error, as a share of the range of each signal.
        """
        found = []
        for name, rows in self.ladders().items():
            good = [r for r in rows if r.error <= target]
            if good:
                best = min(good, key=lambda r: r.seconds)
                found.append(Advice(name, best.setting, best.seconds, True))
                continue
            last = min(rows, key=lambda r: r.error)
            orders = [r.order for r in rows if r.order > 0.3]
            if not orders or not last.parameter:
                continue
            factor = (last.error / target) ** (1.0 / orders[-1])
            setting = f"{last.steps * factor:.2g} steps"
            found.append(Advice(name, setting, last.seconds * factor, False))
        return sorted(found, key=lambda a: a.seconds)

    def describe(self, target: float | None = None) -> str:
        """Return the report as text."""
        reference = self.reference
        shown = ", ".join(self.signals[:8]) + (" ..." if len(self.signals) > 8 else "")
        lines = [
            f"{self.title}",
            *([f"as it is: {self.default}"] if self.default else []),
            f"errors of {shown}, relative to their range",
            f"reference: {reference.how}: {reference.error:.1e}",
            "",
            f"{'method':<22}{'':<16}{'steps':>10}{'max error':>12}{'mean error':>12}"
            f"{'time':>11}{'per step':>11}{'order':>7}",
        ]
        for r in self.rows:
            if r.note:
                lines.append(f"{r.method:<22}{r.setting:<16}{r.note}")
                continue
            order = f"{r.order:.2f}" if math.isfinite(r.order) else ""
            below = "<" if r.error < reference.error else ""
            error = below + format(max(r.error, reference.error), ".1e")
            if r.error == 0.0 and not math.isfinite(reference.error):
                error = "not known"  # it is the reference
            lines.append(
                f"{r.method:<22}{r.setting:<16}{r.steps:>10}"
                f"{error:>12}{r.l1:>12.1e}"
                f"{number(r.seconds, 's', 3):>11}{number(r.per_step, 's', 3):>11}{order:>7}"
            )
        lines += [f"not measured: {reason}" for reason in self.absent]
        if self.interrupted:
            lines.append("stopped early: the rest was not measured")
        if target is not None:
            lines += ["", *self._advice(target)]
        return "\n".join(lines)

    def _advice(self, target: float) -> list[str]:
        found = self.cheapest(target)
        if not found:
            return [f"no method reaches {target:g}"]
        best = found[0]
        lines = [f"cheapest method for {target:g}: {best}"]
        lines += [f"  {a}: {a.seconds / best.seconds:.3g} times" for a in found[1:]]
        return lines

    def to_dict(self, target: float | None = None) -> dict[str, Any]:
        """Return a JSON-ready mapping."""
        error = self.reference.error
        data: dict[str, Any] = {
            "title": self.title,
            "signals": self.signals,
            "reference": {"how": self.reference.how, "error": error if error == error else None},
            "runs": [r.to_dict() for r in self.rows],
            "absent": self.absent,
            "default": self.default,
            "interrupted": self.interrupted,
        }
        if target is not None:
            data["target"] = target
            data["cheapest"] = [
                {
                    "method": a.method,
                    "setting": a.setting,
                    "seconds": a.seconds,
                    "measured": a.measured,
                }
                for a in self.cheapest(target)
            ]
        return data

    def plot(self, path: str | Path | None = None, target: float | None = None) -> Any:
        """Draw error against time, both logarithmic; return the figure, saved to ``path``.

        Parameters
        ----------
        path : str or Path, optional
        target : float, optional
            An error that is wanted, to be marked with the cheapest run that reaches it.
        """
        from .picture import draw

        return draw(self, path, target)
