"""Why there is no periodic steady state, described with the names of the circuit."""

from __future__ import annotations

import numpy as np

from ...circuit import MnaSystem
from ...errors import Diagnostic, NumericalError, Span, StepError, UsageError
from ...solvers.orbit import NoDerivative, NoOrbit
from ..signals.curve import Floats

_NAMED = 4  # elements spelt out
_SHARE = 1e-3  # of the largest energy, below which an element is not named


def stored_names(mna: MnaSystem, charges: Floats) -> list[str]:
    """Return the stores that a direction of charges and fluxes (n,) changes most."""
    touched = []
    # what an element stores: its charge enters the rows of its nodes, its flux its own row
    for store in [*mna.capacitors, *mna.inductors]:
        rows = [j for j, _ in store.functional.z]
        if rows and store.value:
            size = float(np.abs(charges[rows]).max()) ** 2 / abs(store.value)
            touched.append((size, store.name))
    most = max((size for size, _ in touched), default=0.0)
    named = [n for size, n in sorted(touched, reverse=True) if size > _SHARE * most and size > 0.0]
    return named[:_NAMED]


def no_period(span: Span | None, several: bool) -> UsageError:
    """Return the error of sources that have no common period, or of none that repeats."""
    if several:
        message = "the sources have no common period"
        hint = "choose periods that are multiples of each other"
    else:
        message = "no source is periodic, so nothing determines the period"
        hint = "name a signal that oscillates: .pss trigger=v(node) level=0"
    return UsageError(Diagnostic("NS4015", message, span, hint))


def no_closed_form(number: int, reason: str, span: Span | None) -> UsageError:
    """Return the error of what needs closed forms of an island, which it has not for a reason."""
    message = f"the periodic steady state of island {number + 1} has no closed form: {reason}"
    hint = "use set-valued diodes (D(ideal)) and DC, SIN, PULSE and PWL sources"
    return UsageError(Diagnostic("NS4015", message, span, hint))


def no_derivative(problem: NoDerivative, mna: MnaSystem, span: Span | None) -> NumericalError:
    """Return the error of a run that is not a differentiable function of its beginning."""
    names = ", ".join(
        dict.fromkeys(mna.pair_elements[p] for p in problem.pairs if p < len(mna.pairs))
    )
    at = f"at t = {problem.time:.9g} s of the period"
    if problem.kind == "grazing":
        message = f"{names} touches its switching condition {at} without crossing it: the "
        message += "period map has no derivative there"
        hint = "change a value slightly: next to such a point the steady state is found"
    elif problem.kind == "together":
        message = (
            f"{names} switch at one instant, {at}, in an order that a perturbation would decide: "
        )
        message += "the period map has directional derivatives, but no single derivative"
        hint = "shift one of them slightly"
    elif problem.kind == "many":
        message = f"the period has too many switchings: up to {at[7:]} more than can be kept"
        hint = "look for chattering switches; give them hysteresis"
    else:
        message = (
            f"events accumulate {at}, or a switch chatters, and implicit steps are used: the "
            f"period "
        )
        message += "has no closed form"
        hint = "give switches hysteresis, or add a path for the current they interrupt"
    return StepError(
        Diagnostic("NS3060", message, span, hint), time=problem.time, residual=float("nan")
    )


def no_orbit(
    problem: NoOrbit, mna: MnaSystem, span: Span | None, trigger: str | None
) -> NumericalError:
    """Return the error of an orbit that does not exist, or was not found."""
    if problem.kind == "drift" and problem.direction is not None:
        names = ", ".join(stored_names(mna, problem.direction)) or "what is stored"
        message = (
            f"there is no periodic steady state: the charge or flux of {names} grows by the same "
            f"amount "
        )
        message += "in each period, and nothing restores it (multiplier 1)"
        hint = "put a resistance in its path, or use a source with zero mean"
    elif problem.kind == "trigger":
        message = f"no periodic steady state: {trigger} does not rise through the level again"
        hint = "choose a level that it crosses; start an oscillator with .ic or IC="
    else:
        message = "no periodic steady state was found: over the last period the state changed by "
        message += f"{problem.residual:.1e} of its size"
        hint = (
            "give tstab= a time after which it is nearly periodic; the orbit may be a "
            "multiple of the "
        )
        hint += "period of the sources (period=), or chaotic"
    return StepError(Diagnostic("NS3062", message, span, hint), time=0.0, residual=problem.residual)
