"""Fourier coefficients, distortion and powers, as exact as the engine that ran."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ...circuit import Circuit
from ...devices.heat.switching_loss import switching_loss
from ...errors import Diagnostic, NsspiceError, UsageError
from ...netlist.deck import FourCard, Measure
from ..results.spectrum import Spectrum
from ..signals.signal_names import canonical
from .recorded_integrals import RecordedIntegrals
from .window_integrals import NoClosedForm, WindowIntegrals

if TYPE_CHECKING:
    from ..results.loss_table import LossTable
    from ..solution.solution import Solution

#: why there are no integrals
UNKNOWN = (NoClosedForm, NsspiceError, ValueError)
#: a frequency is a multiple of another up to this part
_SAME = 1e-9
T = TypeVar("T")


def along(solution: Solution, use: Callable[[WindowIntegrals], T]) -> T:
    """Return what ``use`` makes of a run's closed forms, or else of the polynomials of its steps.

    Raises
    ------
    ValueError
        If the run is neither known in closed form nor by steps, but at its rows alone.
    """
    exact = solution.integrals
    if exact is not None:
        try:
            return use(exact)
        except NoClosedForm:
            pass
    steps = RecordedIntegrals.of(solution)
    if steps is None:
        raise ValueError("the run is known at its rows alone")
    return use(steps)


def spectrum(integrals: WindowIntegrals, name: str, harmonics: int, multiple: int = 1) -> Spectrum:
    """Return the spectrum of a signal.

    Parameters
    ----------
    integrals : WindowIntegrals
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
    """Compute what ``.four`` cards ask for; what is not known becomes a warning."""
    for card in cards:

        def spectra(over: WindowIntegrals, card: FourCard = card) -> list[Spectrum]:
            window, multiple = _window(over, solution.analysis, card)
            return [spectrum(window, name, card.harmonics, multiple) for name in card.signals]

        try:
            solution.spectra.extend(along(solution, spectra))
        except UNKNOWN as problem:
            solution.warnings.append(_left_out(card, problem))


def add_powers(circuit: Circuit, solution: Solution, loads: Sequence[str]) -> None:
    """Compute the average powers of all elements; what is not known becomes a warning."""
    from .losses import losses

    def table(integrals: WindowIntegrals) -> LossTable:
        steps = RecordedIntegrals.of(solution)
        if steps is not None:
            steps = steps.over(integrals.window)
        return losses(circuit, integrals, steps, loads, solution.jumps)

    try:
        solution.powers = along(solution, table)
    except UsageError:
        raise
    except UNKNOWN as problem:
        solution.warnings.append(_left_out(None, problem))
        return
    exact = solution.integrals
    hot = {} if exact is None or exact.heat is None else exact.heat
    if beyond := [h.element for h in hot.values() if h.outside]:
        solution.warnings.append(_beyond(beyond))
    if cold := [e.name for e in circuit.deck.elements if switching_loss(e) and e.name not in hot]:
        why = f"energies and temperatures of {', '.join(cold)} need the exact engine"
        solution.warnings.append(_left_out(None, ValueError(why), "in part"))


def _beyond(elements: Sequence[str]) -> Diagnostic:
    return Diagnostic(
        "NS5005",
        f"switching events of {', '.join(elements)} are outside the tables of their model cards: "
        f"energies are extrapolated from the outermost cells",
        hint="extend the tables",
        severity="warning",
    )


def _window(
    integrals: WindowIntegrals, analysis: str, card: FourCard
) -> tuple[WindowIntegrals, int]:
    """Return integrals over the periods of a card, and the fundamental as a multiple of theirs."""
    if analysis == "pss":
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
    reason = problem.diagnostics[0].message if isinstance(problem, NsspiceError) else str(problem)
    what = " ".join(filter(None, ["--power" if card is None else ".four", "is omitted", part]))
    return Diagnostic(
        "NS5003",
        f"{what}: {reason}",
        None if card is None else card.span,
        "check the frequency, and that the run is long enough",
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
    except UNKNOWN:
        return None


def _window_of(card: Measure, integrals: WindowIntegrals) -> tuple[float, float]:
    """Return between which instants a measure looks [s]; what it does not say, those of the run."""
    low, high = integrals.window
    return (low if card.start is None else card.start, high if card.stop is None else card.stop)


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
        window = _window_of(card, integrals)
        if not low <= window[0] < window[1] <= high * (1.0 + _SAME):
            raise ValueError("FROM and TO are not within the run")
    try:
        found = hot_statistic(integrals.circuit, integrals, name, card.operation, window)
    except UNKNOWN as problem:
        message = problem.diagnostics[0].message if isinstance(problem, NsspiceError) else ""
        raise ValueError(message or str(problem) or "the run has no closed form") from problem
    if found is None:
        reason = "the model card has no table or thermal network, or the statistic is not avg, max"
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
    name, operation = canonical(names[0]), card.operation

    def value(integrals: WindowIntegrals) -> float:
        if card.start is not None or card.stop is not None:
            integrals = integrals.over(_window_of(card, integrals))
        if operation == "thd":
            return integrals.distortion(name)
        order = int(operation.removeprefix("harm"))
        (found,) = integrals.coefficients([name], [order])[name]
        return float(np.abs(found)) * (2.0 if order else 1.0)

    try:
        return along(solution, value)
    except UNKNOWN as problem:
        raise ValueError(str(problem)) from problem
