"""Running a circuit with ngspice."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from ...analyses.request.cards import Dc, Op, Tran
from ...circuit import Circuit
from ...errors import Diagnostic, UsageError
from ...netlist.deck import DcCard, TranCard
from .options import Options
from .process import execute
from .result import NgspiceError, NgspiceRun, finished
from .translate import Translation, translate


def run(
    circuit: Circuit,
    analysis: Op | Dc | Tran | None = None,
    signals: Iterable[str] | None = None,
    options: Options | None = None,
    *,
    values: Mapping[str, float] | None = None,
    temperature: float | None = None,
    once: bool = False,
    **changes: Any,
) -> NgspiceRun:
    r"""Run a circuit with ngspice.

    Parameters
    ----------
    circuit : Circuit
    analysis : Op, Dc or Tran, optional
        The deck's first transient or sweep if left out.
    signals : iterable of str, optional
        What to save; the circuit's default signals if left out.
    options : Options, optional
    values : mapping of str to float, optional
        Values of elements that replace those of the deck.
    temperature : float, optional
        [degrees Celsius]
    once : bool
        Do not try again with softer substitutes or a shunt where ngspice fails.
    **changes
        Fields of ``Options``: ``junction=0.01``, ``reltol=1e-4``, ``max_step=1e-6`` ...

    Returns
    -------
    NgspiceRun

    Raises
    ------
    UsageError
        NS4013 if ngspice is not installed, NS4014 if it cannot do the deck at all.
    NgspiceError
        If ngspice does not finish, however it is helped: the failure without help.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read("divider\nV1 a 0 2\nR1 a b 1\nR2 b 0 1\n.op\n")
    >>> round(float(run(circuit, Op())["v(b)"][0]), 9)
    1.0
    """
    chosen = replace(options or Options(), **changes)
    task = analysis if analysis is not None else first_analysis(circuit)

    failures: list[NgspiceError] = []
    todo = translate(circuit, task, signals, chosen, values=values, temperature=temperature)
    attempts = chosen.attempts(todo.exact)
    for attempt in attempts[:1] if once else attempts:
        todo = translate(circuit, task, signals, attempt, values=values, temperature=temperature)
        try:
            return replace(_run(todo), attempts=tuple(failures))
        except NgspiceError as error:
            if chosen.junction == "auto" and error.reason == "code model missing":
                return run(
                    circuit,
                    task,
                    signals,
                    replace(chosen, junction=0.01),
                    values=values,
                    temperature=temperature,
                )
            failures.append(error)
            if error.reason not in _SOFTENED:
                break
    raise failures[0]


#: failures that a less sharp substitute may avoid
_SOFTENED = ("timestep too small", "no operating point", "singular matrix", "time-out")


def first_analysis(circuit: Circuit) -> Op | Dc | Tran:
    """Return the first transient or sweep of a deck, else its operating point."""
    for card in circuit.deck.analyses:
        if isinstance(card, TranCard):
            return Tran.from_card(card)
        if isinstance(card, DcCard):
            return Dc.from_card(card)
    if circuit.deck.analyses:
        return Op()
    raise UsageError(
        Diagnostic(
            "NS4006",
            f"{circuit.deck.file} asks for no analysis",
            hint="add .tran tstep tstop, .dc source start stop step, or .op",
        )
    )


def _run(translation: Translation) -> NgspiceRun:
    options = translation.options
    try:
        raw = execute(translation.text, options.runner, options.timeout)
    except subprocess.TimeoutExpired:
        raise NgspiceError(
            Diagnostic(
                "NS5011",
                f"ngspice took longer than {options.timeout:g} s and was stopped",
                hint="give it more time with --timeout, a larger --max-step, or a shorter run",
            ),
            "time-out",
            translation,
            None,
        ) from None
    return finished(raw, translation)
