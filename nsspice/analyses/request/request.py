"""What is wanted of a run beyond its analysis: conditions, settings, signals, and where rows go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ...circuit import Circuit
from ...errors import Diagnostic, UsageError
from ...netlist.deck import Deck
from .notebook_progress import Progress
from .recorder import select
from .row_sinks import Sink
from .settings import Settings

if TYPE_CHECKING:
    from ...solvers.orbit import State
    from .controller import Controller


@dataclass(slots=True)
class Neighbour:
    """The orbits of a run before, from which the next one of a sweep begins."""

    states: dict[int, State] = field(default_factory=dict)


def named_controllers(
    circuit: Circuit, controllers: Sequence[Controller]
) -> tuple[Controller, ...]:
    """Return controllers with canonical names; most runs have none and need nothing of them."""
    if not controllers:
        return ()
    from .controller import checked_controllers

    return checked_controllers(circuit, controllers)


@dataclass(frozen=True, slots=True)
class Request:
    """What the caller of a run wants beyond the deck.

    Parameters
    ----------
    method, theta, step, reltol, accuracy
        As for :func:`nsspice.tran`.
    stop : float or None
        Replaces the end of ``.tran`` cards [s].
    signals, extra : sequence of str
        Signals to show, and to record besides.
    keep : bool
        False if the rows may be left to the sinks alone.
    all_points : bool
        Rows at the solver's points and on both sides of jumps.
    neighbour : Neighbour
        Orbits of the step before.
    power : bool
        Average powers of all elements of ``.pss`` and ``.tran``.
    loads : tuple of str
        Elements whose power is useful.
    follow : sequence of str
        Signals to record between the rows, for statistics and pictures.
    record : bool
        Whether signals of all measures are recorded, and stay so.
    rows : bool
        False if nobody reads rows: where an engine does not need them there are few.
    everything : bool
        Simulate also what no signal depends on.
    temperature : float or None
        [degrees Celsius], the deck's by default.
    values : mapping of str to float
        Values by element name that replace those of the deck, checked.
    progress, sink, controllers
        As for :func:`nsspice.tran`; the names of controllers are canonical.
    """

    method: str | None = None
    theta: float | None = None
    step: float | None = None
    stop: float | None = None
    signals: Sequence[str] | None = None
    extra: Sequence[str] = field(default_factory=tuple)
    keep: bool = True
    all_points: bool = False
    reltol: float | None = None
    neighbour: Neighbour = field(default_factory=Neighbour)
    power: bool = False
    loads: tuple[str, ...] = ()
    follow: Sequence[str] = field(default_factory=tuple)
    record: bool = False
    rows: bool = True
    everything: bool = False
    accuracy: str | None = None
    temperature: float | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    progress: Progress | None = None
    sink: Sink | None = None
    controllers: tuple[Controller, ...] = ()

    def settings(self, deck: Deck) -> Settings:
        """Return how to solve, with the deck's options where nothing is said."""
        return Settings.of(deck, self.method, self.theta, self.step, self.reltol, self.accuracy)

    def all_controllers(self, circuit: Circuit) -> tuple[Controller, ...]:
        """Return the controllers of the caller and those that the deck has."""
        if not (self.controllers or circuit.deck.sampled):
            return ()
        from .sampled import controllers_of

        return named_controllers(circuit, [*self.controllers, *controllers_of(circuit.deck)])

    def refuse_controllers(self) -> None:
        """Refuse an analysis that knows no controllers.

        Raises
        ------
        UsageError
            NS4024
        """
        if self.controllers:
            message = "controllers work in .tran and .pss"
            hint = "run the other analyses without them"
            raise UsageError(Diagnostic("NS4024", message, hint=hint))

    def names(self, circuit: Circuit) -> tuple[list[str], list[str]]:
        """Return the signals to show, and all that are recorded, these first."""
        columns = select(circuit, self.signals)
        if not self.extra:
            return columns, columns
        return columns, columns + [n for n in select(circuit, self.extra) if n not in columns]
