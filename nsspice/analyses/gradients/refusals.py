"""Why a measure has no derivative."""

from __future__ import annotations

from ...circuit import MnaSystem
from ...errors import Diagnostic, NumericalError, StepError, UsageError
from ...solvers.orbit import NoDerivative

#: codes of what has no derivative, or none that is known
UNKNOWN = frozenset(("NS3065", "NS3068", "NS4041", "NS4042"))


def undone(why: str, what: str) -> UsageError:
    """Return the error of what has no derivative, or none that is known."""
    hint = "use the difference of two runs"
    return UsageError(Diagnostic("NS4041", f"no derivative for {what}: {why}", hint=hint))


def unbounded() -> NumericalError:
    """Return the error of a run whose adjoint has no closed form."""
    return StepError(
        Diagnostic(
            "NS3065",
            "no derivatives: nothing restores the orbit, a mode has a double rate, or a current is "
            "an impulse",
            hint="change a value slightly, or add damping",
        ),
        time=0.0,
        residual=float("nan"),
    )


def no_derivative(problem: NoDerivative, mna: MnaSystem) -> NumericalError:
    """Return the error of an event that has no derivative."""
    pairs = (mna.pair_elements[p] for p in problem.pairs if p < len(mna.pairs))
    names = ", ".join(dict.fromkeys(pairs)) or "a switching"
    what = {
        "grazing": f"{names} touches its switching condition without crossing it",
        "together": f"{names} switch in an order that a perturbation decides",
        "unproved": "events accumulate, or a switch chatters",
        "many": "there are more events than are kept",
    }[problem.kind]
    return StepError(
        Diagnostic(
            "NS3068",
            f"a measure has no derivative: at t = {problem.time:.9g} s {what}",
            hint="change a value slightly: on each side of such a point there is one",
        ),
        time=problem.time,
        residual=float("nan"),
    )


def at_a_tie(measure: str, times: tuple[float, float]) -> NumericalError:
    """Return the error of an extreme that is reached twice."""
    one, other = sorted(times)
    return StepError(
        Diagnostic(
            "NS3068",
            f"{measure} has no derivative: its extreme is reached at t = {one:.9g} s and at "
            f"t = {other:.9g} s, and a parameter moves them apart",
            hint="measure one of them, with from= and to=",
        ),
        time=one,
        residual=float("nan"),
    )
