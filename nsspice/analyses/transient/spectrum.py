"""Fourier coefficients and distortion of ``.four`` and ``.measure``, exact along closed forms."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...circuit import Circuit
from ...errors import Diagnostic, NsspiceError, UsageError
from ...netlist.deck import FourCard, Measure
from ...solvers.modewise import NotModewise
from ...solvers.orbit import NoDerivative, NoOrbit
from ...solvers.stepper import UnsolvedStep
from ..results.spectrum import Spectrum
from ..signals.signal_names import canonical
from .integrals import Integrals

if TYPE_CHECKING:
    from ..solution.solution import Solution

#: what an engine has to say if a run has no closed form throughout
INEXACT = (NotModewise, NoDerivative, NoOrbit, UnsolvedStep, NsspiceError, ValueError)
#: a frequency is a multiple of another up to this part
_SAME = 1e-9
_NAMED = 6  # elements without a power that are listed by name


def spectrum(integrals: Integrals, name: str, harmonics: int, multiple: int = 1) -> Spectrum:
    """Return the spectrum of a signal.

    Parameters
    ----------
    integrals : Integrals
    name : str
        A voltage or current.
    harmonics : int
        Coefficients to return besides the mean.
    multiple : int
        The fundamental, in units of the window's own frequency.
    """
    key = canonical(name)
    orders = [k * multiple for k in range(harmonics + 1)]
    found = integrals.coefficients([key], orders)[key]
    square = integrals.product(key, key)
    own = 2.0 * abs(found[1]) ** 2
    rest = square - abs(found[0]) ** 2 - own
    return Spectrum(
        key,
        integrals.frequency * multiple,
        tuple(complex(c) for c in found),
        math.sqrt(max(square, 0.0)),
        math.sqrt(max(rest, 0.0) / own) if own > 0.0 else math.nan,
    )


def add_spectra(solution: Solution, cards: Sequence[FourCard]) -> None:
    """Compute what ``.four`` cards ask for; what has no closed form becomes a warning."""
    for card in cards:
        try:
            integrals, multiple = _window(solution, card)
            for name in card.signals:
                solution.spectra.append(spectrum(integrals, name, card.harmonics, multiple))
        except INEXACT as problem:
            solution.warnings.append(_left_out(card, problem))


def add_powers(circuit: Circuit, solution: Solution, loads: Sequence[str]) -> None:
    """Compute the average powers of all elements; without closed forms they become a warning."""
    from .losses import losses, without_powers

    if solution.integrals is None:
        if solution.analysis == "pss":
            solution.warnings.append(_left_out(None, ValueError("the run has no closed form")))
        return
    try:
        lost = math.fsum(jump.lost for jump in solution.jumps)
        given = math.fsum(jump.delivered for jump in solution.jumps)
        solution.powers = losses(circuit, solution.integrals, loads, lost, given)
        if others := without_powers(circuit, solution.integrals):
            names = ", ".join(others[:_NAMED]) + (" ..." if len(others) > _NAMED else "")
            problem = ValueError(f"{names}: blocks driven by another one take steps")
            solution.warnings.append(_left_out(None, problem, "for some elements"))
        hot = (solution.integrals.heat or {}).values()
        if beyond := [h.element for h in hot if h.outside]:
            solution.warnings.append(_beyond(beyond))
    except UsageError:
        raise
    except INEXACT as problem:
        found = _left_out(None, problem)
        solution.warnings.append(found)


def _beyond(elements: Sequence[str]) -> Diagnostic:
    return Diagnostic(
        "NS5005",
        f"switching events of {', '.join(elements)} are outside the tables of their model cards: "
        f"energies are extrapolated from the outermost cells",
        hint="extend the tables",
        severity="warning",
    )


def _window(solution: Solution, card: FourCard) -> tuple[Integrals, int]:
    """Return integrals over the periods of a card, and the fundamental as a multiple of theirs."""
    integrals = solution.integrals
    if integrals is None:
        raise ValueError("the run has no closed form")
    if solution.analysis == "pss":
        if card.frequency is None:
            return integrals, 1
        ratio = card.frequency / integrals.frequency
        if round(ratio) < 1 or abs(ratio - round(ratio)) > _SAME * ratio:
            own = integrals.frequency
            raise ValueError(
                f"{card.frequency:g} Hz is not a multiple of the orbit's own {own:.9g} Hz"
            )
        return integrals, round(ratio)
    if card.frequency is None:
        raise ValueError("a transient needs the frequency of the fundamental")
    stop = integrals.window[1]
    start = stop - card.periods / card.frequency
    if start < -_SAME * stop:
        raise ValueError(f"{card.periods} periods of {card.frequency:g} Hz are longer than the run")
    return integrals.over((max(start, 0.0), stop)), card.periods


def _left_out(card: FourCard | None, problem: Exception, part: str = "") -> Diagnostic:
    if isinstance(problem, NsspiceError):
        reason = problem.diagnostics[0].message
    elif isinstance(problem, NoDerivative):
        reason = "the run needed implicit steps, which have no closed form"
    else:
        reason = str(problem)
    what = " ".join(filter(None, ["--power" if card is None else ".four", "is omitted", part]))
    return Diagnostic(
        "NS5003",
        f"{what}: {reason}",
        None if card is None else card.span,
        "averages and Fourier coefficients are computed from the closed forms of the exact engine",
        severity="warning",
    )


def exact_statistic(solution: Solution, card: Measure) -> float | None:
    """Return the average or rms of one signal over an orbit, None for anything else."""
    if solution.analysis != "pss" or card.operation not in ("avg", "rms"):
        return None
    if solution.integrals is None or card.start is not None or card.stop is not None:
        return None
    name = "" if card.expression is None else canonical(card.expression.text)
    if name not in solution.signals or (name.startswith("p(") and card.operation == "rms"):
        return None
    try:
        integrals = solution.integrals
        return integrals.mean(name) if card.operation == "avg" else integrals.rms(name)
    except INEXACT:
        return None


def is_hot(card: Measure) -> bool:
    """Return whether a measure is one of ``psw(x)`` or ``tj(x)``."""
    return card.expression is not None and card.expression.text.lower().startswith(("psw(", "tj("))


def hot_measure(solution: Solution, card: Measure) -> float:
    """Return a statistic of the power of switchings or of a junction's temperature.

    Raises
    ------
    ValueError
        If it has none; the text says why.
    """
    from .heat import hot_statistic

    assert card.expression is not None
    (name,) = card.expression.variables()
    if solution.integrals is None:
        raise ValueError("the run has no closed form")
    integrals, window = solution.integrals, None
    if card.start is not None or card.stop is not None:
        low, high = integrals.window
        start = low if card.start is None else card.start
        window = (start, high if card.stop is None else card.stop)
        if not low <= window[0] < window[1] <= high * (1.0 + _SAME):
            raise ValueError("FROM and TO are not within the run")
    try:
        found = hot_statistic(integrals.circuit, integrals, name, card.operation, window)
    except INEXACT as problem:
        message = problem.diagnostics[0].message if isinstance(problem, NsspiceError) else ""
        raise ValueError(message or str(problem) or "the run has no closed form") from problem
    if found is None:
        reason = "the model card has no table or thermal network, or the statistic is no avg, max"
        raise ValueError(f"{name}: {reason}, min, pp (of tj) or avg, integ (of psw)")
    return found


def spectral_measure(solution: Solution, card: Measure) -> float:
    """Return ``thd`` or the amplitude ``harm<n>`` of a signal within the window of a measure.

    Raises
    ------
    ValueError
        If it has none; the text says why.
    """
    names = [] if card.expression is None else sorted(card.expression.variables())
    if len(names) != 1 or canonical(names[0]) != canonical(card.expression.text):  # type: ignore[union-attr]
        raise ValueError("a spectrum needs exactly one signal")
    integrals = solution.integrals
    if integrals is None:
        raise ValueError("the run has no closed form")
    if card.start is not None or card.stop is not None:
        low, high = integrals.window
        window = (card.start if card.start is not None else low, card.stop or high)
        integrals = integrals.over(window)
    try:
        if card.operation == "thd":
            return integrals.distortion(names[0])
        order = int(card.operation.removeprefix("harm"))
        found = integrals.coefficients([names[0]], [order])[canonical(names[0])]
        return float(np.abs(found[0])) * (2.0 if order else 1.0)
    except INEXACT as problem:
        reason = str(problem) or "the run has no closed form"
        raise ValueError(reason) from problem
