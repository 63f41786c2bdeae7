"""What is said and done about a run whose certificate fails."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace

from ...errors import CertificateError, CertificateWarning, Diagnostic, UsageError
from ..certificate.certificate import TAKEN_BESIDE_EXACT
from ..certificate.failure import RANGE, grown
from ..request.path_following import PATH_METHODS
from .solution import Solution

#: what may be done about it
ON_FAILURE = ("raise", "warn", "ignore")

#: voltages beyond this are worth a word [V]
_FAR = 1e9


def check_on_failure(wanted: str) -> None:
    """Raise UsageError unless the word is one of ``ON_FAILURE``."""
    if wanted not in ON_FAILURE:
        message = f"on_failure cannot be {wanted!r}"
        raise UsageError(Diagnostic("NS4005", message, hint=f"choose {', '.join(ON_FAILURE)}"))


def failure_of(solution: Solution) -> CertificateError | None:
    """Return why the points of a solution are not to be relied upon, None if they are.

    A run that was interrupted is not judged: its summary says so.
    """
    certificate = solution.certificate
    if certificate is None or certificate.passed or solution.interrupted:
        return None
    return CertificateError(Diagnostic("NS3003", *_reason(solution)), solution)


def judge(solutions: Sequence[Solution], on_failure: str) -> None:
    """Raise or warn if the certificate of a solution fails.

    Parameters
    ----------
    solutions : sequence of Solution
    on_failure : str
        ``raise``, ``warn`` or ``ignore``.

    Raises
    ------
    CertificateError
        NS3003 for the first that fails, with all ``solutions``.
    """
    if on_failure == "ignore":
        return
    for solution in solutions:
        failure = failure_of(solution)
        if failure is None:
            continue
        if on_failure == "raise":
            failure.solutions = list(solutions)
            raise failure
        found = replace(failure.diagnostics[0], severity="warning")
        solution.warnings.append(found)
        warnings.warn(found.render(), CertificateWarning, stacklevel=3)


def _reason(solution: Solution) -> tuple[str, None, str]:
    """Return the message and the hint."""
    c = solution.certificate
    assert c is not None
    far = _grown(solution)
    if far is not None:
        message, hint = grown(*far)
        return message, None, hint
    if c.taken > c.granted == TAKEN_BESIDE_EXACT:
        return (
            f"numerical damping by the implicit steps of the mode-wise engine is "
            f"{c.taken:.1%} of the energy of the run: the steps are too long",
            None,
            "try --method sdirk, which controls its errors, or a smaller output step",
        )
    if c.taken > c.granted:
        return (
            f"numerical damping by the steps is {c.taken:.0%} of the energy of the run: they do "
            f"not meet their tolerance",
            None,
            "try a smaller --reltol, or order=4 if the deck asks for order=2",
        )
    if c.late > 1.0 and replace(c, late=0.0).passed:
        return (
            "chattering switches react too late: a control overshot its threshold by "
            f"{c.late:.2g} times the tolerance",
            None,
            "give them hysteresis (VH), reduce the longest step (the last number of .tran), or "
            "increase --reltol",
        )
    if replace(c, missed=0.0).passed:
        return (
            f"a step errs by {c.missed:.2g} times what was asked: charges (fluxes) do not change "
            "by the integral of the currents (voltages)",
            None,
            "try a smaller --reltol, or a smaller longest step (the last number of .tran)",
        )
    hint = "try a shorter step; the files are kept; please report this deck"
    if any(island.method in PATH_METHODS for island in solution.islands):
        hint = "path following ends at folds; use --method auto to solve every point"
    far = _far(solution)
    if far is not None:
        name, volts = far
        hint = (
            f"{name} reaches {volts:.1e} V: if nothing can carry the current at that node, put a "
            "resistor from there to ground"
        )
    where = f", worst at {c.worst}" if c.worst else ""
    text = f"relative errors {c.laws:.1e} (laws{where}), {c.complementarity:.1e} (set-valued)"
    if c.energy is not None:
        text += f", {c.energy.drift:.1e} (energy)"
    if c.jumps:
        text += f", {c.jumps:.1e} (charge and flux over jumps)"
    return f"the computed points violate the laws of the circuit: {text}", None, hint


def _far(solution: Solution) -> tuple[str, float] | None:
    """Return the voltage that is farthest from zero, if no circuit has such a one on purpose."""
    sizes = {n: float(abs(solution[n]).max()) for n in solution.columns if n.startswith("v(")}
    name = max(sizes, key=lambda n: sizes[n], default=None)
    if name is None or not sizes[name] > _FAR:
        return None
    values = solution[name]
    return name, float(values[abs(values).argmax()])


def _grown(solution: Solution) -> tuple[str, float] | None:
    """Return the signal that is first seen beyond the range of energies, and when.

    The command line keeps the last rows alone.
    """
    first: tuple[str, float] | None = None
    for name in solution.columns if solution.axis_name == "time" else ():
        within = abs(solution[name]) < RANGE  # false where it is not a number
        if not within.all():
            time = float(solution.axis[within.argmin()])
            if first is None or time < first[1]:
                first = name, time
    return first
