"""A transient that is advanced step by step, with sources that are set in between."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ...circuit import Circuit
from ...errors import Diagnostic, UsageError, suggest
from ..certificate.certificate import Certificate
from ..request.cards import Tran
from ..request.controller import Controller
from ..request.interrupts import Interrupts
from ..request.load import need_circuit
from ..request.recorder import Recorder, select
from ..request.sampled import refuse_sampled
from ..request.settings import Settings
from ..signals.curve import Floats
from ..signals.signal_names import canonical
from .controlled import Sampler, to_the_wait
from .held import HeldSources
from .island_runner import IslandRunner
from .outcomes import Stopped


@dataclass(frozen=True, slots=True)
class SimulationState:
    """Where a simulation was, from :meth:`Simulation.state`.

    Parameters
    ----------
    circuit : Circuit
    time : float
        [s]
    inputs : dict of str to float
        Values of the sources [V or A].
    moves : tuple of (float, tuple of float)
        Up to when it was advanced [s], with which inputs: the way to the state.
    """

    circuit: Circuit
    time: float
    inputs: dict[str, float]
    moves: tuple[tuple[float, tuple[float, ...]], ...]

    def __repr__(self) -> str:
        return f"<state at {self.time:.6g} s>"


class Simulation:
    """A circuit at an instant, which can be advanced; made by :func:`nsspice.start`.

    ``sim["v(out)"]`` is a signal now (before what jumps at this instant), ``sim["vref"] = 2.0``
    sets a source from now on.
    """

    def __init__(
        self,
        circuit: Circuit,
        inputs: Sequence[str],
        signals: Sequence[str],
        analysis: Tran,
        settings: Settings,
    ) -> None:
        self._circuit, self._analysis, self._settings = circuit, analysis, settings
        self._sources = HeldSources.of(circuit, inputs)
        self._recorder = Recorder(circuit, list(signals))
        self._own = dict(self._sources.values)
        self._interrupts = Interrupts()
        #: present time [s]
        self.time = 0.0
        # what the run begins with is asked of a run that goes nowhere
        self._sources.hold(analysis.stop)
        self._values = self._read(self._started(), begin=True)
        self._first = dict(self._values)
        self._runners: list[IslandRunner] = []
        self._moves: list[tuple[float, tuple[float, ...]]] = []

    def _started(self) -> list[IslandRunner]:
        """Return the islands, each at its start."""
        runners = [
            IslandRunner(
                self._circuit,
                k,
                island,
                self._recorder.local[k],
                self._analysis,
                self._settings,
                None,
                self._sources.overrides,
                clock=self._sources.clock,
            )
            for k, island in enumerate(self._circuit.islands)
        ]
        for runner in runners:
            runner.start()
        return runners

    def _read(self, runners: Sequence[IslandRunner], begin: bool = False) -> dict[str, float]:
        """Return all signals where the run begins, or waits."""
        names = self._recorder.names
        sampler = Sampler(runners, self._recorder, names)
        return dict(zip(names, sampler(begin), strict=True))

    def __repr__(self) -> str:
        return f"<Simulation of {self._circuit.deck.title!r} at {self.time:.6g} s>"

    @property
    def inputs(self) -> dict[str, float]:
        """The sources that can be set, with their values [V or A]."""
        return dict(self._sources.values)

    @property
    def signals(self) -> dict[str, float]:
        """All signals now."""
        return dict(self._values)

    @property
    def certificate(self) -> Certificate | None:
        """The verdict on the run up to now, None before it has begun."""
        if not self._runners:
            return None
        return Certificate.total(runner.certificate() for runner in self._runners)

    def __getitem__(self, name: str) -> float:
        """Return a signal, or the value of an input.

        Raises
        ------
        KeyError
            With the nearest name.
        """
        key = canonical(name)
        if key in self._sources.values:
            return self._sources.values[key]
        if key not in self._values:
            hint = suggest(key, self._values) or "name it in signals= of nsspice.start"
            raise KeyError(f"no signal {name!r} in this simulation; {hint}")
        return self._values[key]

    def __setitem__(self, name: str, value: float) -> None:
        """Set a source from now on.

        Raises
        ------
        UsageError
            NS4005 for anything but an input and a finite number.
        """
        key = name.lower()
        if key not in self._sources.values:
            hint = suggest(key, self._sources.values) or "name it in inputs= of nsspice.start"
            message = f"{name} cannot be set in this simulation"
            raise UsageError(Diagnostic("NS4005", message, hint=hint))
        if not math.isfinite(value):
            message = f"{name} cannot be {value!r}"
            raise UsageError(Diagnostic("NS4005", message, hint="give a finite number"))
        self._sources.values[key] = float(value)

    def advance(self, duration: float) -> Simulation:
        """Simulate further by a time [s]; return the simulation.

        Raises
        ------
        UsageError
            NS4005 for a time that is not positive, or beyond the stop.
        NumericalError
            If a step has no solution.
        """
        to = self.time + duration
        if not (math.isfinite(to) and to > self.time):
            message = f"a simulation cannot advance by {duration!r}"
            raise UsageError(Diagnostic("NS4005", message, hint="give a time above zero"))
        if to > self._analysis.stop * (1.0 + 1e-12):
            message = f"{to:g} s lies beyond the stop of this simulation, {self._analysis.stop:g} s"
            raise UsageError(Diagnostic("NS4005", message, hint="give nsspice.start a later stop"))
        self._go(to)
        return self

    def _go(self, to: float) -> None:
        """Simulate to an instant [s]."""
        if not self._runners:
            self._sources.renew(self._own)
            self._sources.hold(to)
            self._runners = self._started()
        else:
            self._sources.hold(to)
        with self._interrupts:
            for runner in self._runners:
                try:
                    to_the_wait(runner, _forget, self._interrupts)
                except Stopped as stopped:
                    raise runner.failure(stopped.problem) from stopped.problem
        self.time = to
        self._moves.append((to, tuple(self._sources.values.values())))
        self._values = self._read(self._runners)

    def state(self) -> SimulationState:
        """Return where the simulation is, so that it can come back: :meth:`restore`."""
        return SimulationState(self._circuit, self.time, self.inputs, tuple(self._moves))

    def restore(self, state: SimulationState) -> Simulation:
        """Go back to a state; return the simulation.

        All is as it was, to the last digit: charges, fluxes, and which diodes and switches conduct.
        The way there is simulated once more, which costs what it did.

        Parameters
        ----------
        state : SimulationState
            From this simulation, or from another one of the same circuit and inputs.

        Raises
        ------
        UsageError
            NS4005 for the state of another circuit, or of other inputs.

        Examples
        --------
        >>> import nsspice
        >>> circuit = nsspice.read("RC\\nVin a 0 1\\nR1 a b 1k\\nC1 b 0 1u\\n")
        >>> sim = nsspice.start(circuit, ["vin"], uic=True).advance(1e-3)
        >>> there = sim.state()
        >>> ahead = sim.advance(1e-3)["v(b)"]
        >>> sim.restore(there).advance(1e-3)["v(b)"] == ahead
        True
        """
        if state.circuit is not self._circuit or state.inputs.keys() != self._sources.values.keys():
            message = "this state belongs to a simulation of another circuit, or with other inputs"
            raise UsageError(Diagnostic("NS4005", message, hint="restore what sim.state() gave"))
        self.time, self._runners, self._moves = 0.0, [], []
        self._values = dict(self._first)
        for to, values in state.moves:
            self._sources.values.update(zip(state.inputs, values, strict=True))
            self._go(to)
        self._sources.values.update(state.inputs)
        return self


def _forget(rows: Floats) -> None:
    """Take no rows: values are asked for where the run waits."""


def checked_inputs(circuit: Circuit, names: Sequence[str]) -> Sequence[str]:
    """Return independent sources that are set from outside; NS4005 for anything else."""
    # the checks of a controller's names are those of inputs
    return Controller(1.0, (), names, lambda time, values: None).checked(circuit).sources


def start(
    circuit: Circuit,
    inputs: Sequence[str] = (),
    *,
    stop: float = 1e3,
    signals: Sequence[str] | None = None,
    uic: bool = False,
    method: str | None = None,
    step: float | None = None,
    reltol: float | None = None,
) -> Simulation:
    """Begin a transient that is advanced by hand.

    Parameters
    ----------
    circuit : Circuit
        From :func:`nsspice.read`.
    inputs : sequence of str
        Independent sources that will be set; up to then they have the value of the deck.
    stop : float
        Up to where it may be advanced [s].
    signals : sequence of str, optional
        What can be read; by default all node voltages and the currents that a run shows.
    uic : bool
        Start from the initial values of the elements instead of the DC solution.
    method, step, reltol
        As for :func:`nsspice.tran`.

    Returns
    -------
    Simulation

    Raises
    ------
    UsageError
        NS4005 for an input that is not an independent source.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''RC
    ... Vin a 0 0
    ... R1 a b 1k
    ... C1 b 0 1u
    ... ''')
    >>> sim = nsspice.start(circuit, ["vin"])
    >>> sim["vin"] = 1.0
    >>> round(sim.advance(1e-3)["v(b)"], 6)
    0.632121
    >>> sim["vin"] = 0.0
    >>> round(sim.advance(1e-3)["v(b)"], 6)
    0.232544
    """
    need_circuit(circuit)
    refuse_sampled(circuit.deck, "a simulation step by step")
    names = checked_inputs(circuit, inputs)
    settings = Settings.of(circuit.deck, method, None, step, reltol, None)
    analysis = Tran(stop, stop, 0.0, None, uic)
    return Simulation(circuit, names, select(circuit, signals), analysis, settings)
