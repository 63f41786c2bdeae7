"""The model in an exported FMU: a circuit that a co-simulation advances.

This file is copied into the FMU.  It runs in the Python of the importing tool, where ``nsspice``
and ``pythonfmu3`` must be installed; it is not imported by the program itself.
"""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import Any

from pythonfmu3 import DefaultExperiment, Float64, Fmi3Causality, Fmi3Slave, Fmi3Variability

import nsspice

SPEC = "model.json"


class CircuitFmu(Fmi3Slave):  # type: ignore[misc]
    """Inputs are values of sources, held over a communication step; outputs are signals."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        folder = Path(self.resources.removeprefix("file://"))
        spec = json.loads((folder / SPEC).read_text("utf-8"))
        self.modelName = spec["name"]
        self.description = spec["title"]
        self._deck = folder / spec["deck"]
        # names of the deck by those of FMI
        self._sources = {name: own for name, (own, _) in spec["inputs"].items()}
        self._values = {name: own for name, (own, _) in spec["parameters"].items()}
        self._inputs = {name: value for name, (_, value) in spec["inputs"].items()}
        self._parameters = {name: value for name, (_, value) in spec["parameters"].items()}
        self._given = dict(self._parameters)
        self._signals, self._options = dict(spec["signals"]), dict(spec["options"])
        self._simulation: Any = None
        self.default_experiment = DefaultExperiment(
            start_time=0.0, stop_time=spec["stop"], step_size=spec["step"]
        )
        self._register("time", Fmi3Causality.independent, lambda: self._now)
        for name in self._inputs:
            self._register_value(self._inputs, name, Fmi3Causality.input)
        for name in self._parameters:
            self._register_value(self._parameters, name, Fmi3Causality.parameter)
        for name, own in self._signals.items():
            self._register(name, Fmi3Causality.output, partial(self._signal, own))

    @property
    def _now(self) -> float:
        return 0.0 if self._simulation is None else self._simulation.time

    def _register(self, name: str, causality: Any, getter: Any, **more: Any) -> None:
        variable = Float64(
            name,
            causality=causality,
            variability=Fmi3Variability.continuous,
            getter=getter,
            **more,
        )
        self.register_variable(variable, nested=False)

    def _register_value(self, values: dict[str, float], name: str, causality: Any) -> None:
        fixed = causality == Fmi3Causality.parameter
        variable = Float64(
            name,
            start=values[name],
            causality=causality,
            variability=Fmi3Variability.fixed if fixed else Fmi3Variability.continuous,
            getter=partial(values.__getitem__, name),
            setter=partial(values.__setitem__, name),
        )
        self.register_variable(variable, nested=False)

    def _signal(self, name: str) -> float:
        return 0.0 if self._simulation is None else self._simulation[name]

    def exit_initialization_mode(self) -> None:
        """Read the deck with the parameters that are set, and begin."""
        # others may follow from these: what nobody sets is left to the deck
        set_values = self._parameters.items() - self._given.items()
        values = {self._values[name]: value for name, value in set_values}
        circuit = nsspice.read(self._deck, values)
        sources, signals = list(self._sources.values()), list(self._signals.values())
        self._simulation = nsspice.start(circuit, sources, signals=signals, **self._options)
        self._set_inputs(self._simulation)

    def _set_inputs(self, simulation: Any) -> None:
        for name, value in self._inputs.items():
            simulation[self._sources[name]] = value

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance with the inputs as they are now."""
        assert self._simulation is not None
        self._set_inputs(self._simulation)
        self._simulation.advance(current_time + step_size - self._simulation.time)
        return True

    def terminate(self) -> None:
        """Refuse results that do not obey the laws of the circuit."""
        certificate = None if self._simulation is None else self._simulation.certificate
        if certificate is not None and not certificate.passed:
            raise RuntimeError(f"the certificate fails: laws {certificate.laws:.1e}")
