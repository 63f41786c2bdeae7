"""Controllers as units for co-simulation (FMI 2 or 3), loaded by fmpy."""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...errors import suggest
from ...lazy import need_library
from .converters import wrong

_KINDS = {"2.0": ("Real", "setReal", "getReal"), "3.0": ("Float64", "setFloat64", "getFloat64")}


class FmuStep:
    """A unit for co-simulation that is advanced from sample to sample.

    At a sample it is advanced from the one before with the inputs of that time; then it gets those
    of now, and its outputs are read.  So what is computed inside a step acts at its end, as FMI
    says; an output that follows an input directly acts now.

    Parameters
    ----------
    path : str or Path
        Of the unit.
    inputs, outputs : int
        Numbers of ``reads`` and ``writes``.
    parameters : mapping of str to float
        Start values of its variables.

    Raises
    ------
    UsageError
        NS4005 for a unit that cannot be loaded or does not fit, NS4010 without fmpy.
    """

    def __init__(
        self, path: str | Path, inputs: int, outputs: int, parameters: Mapping[str, float]
    ) -> None:
        self._made_of = str(path), inputs, outputs, dict(parameters)
        fmpy = _fmpy()
        try:
            told = fmpy.read_model_description(str(path), validate=False)
        except Exception as error:  # of a dozen kinds
            raise wrong(f"{path} is not an FMU: {error}", "give a .fmu file") from error
        if told.fmiVersion not in _KINDS or told.coSimulation is None:
            message = f"{path} is FMI {told.fmiVersion}, or not for co-simulation"
            raise wrong(message, "export it for co-simulation, FMI 2 or 3")
        kind, setter, getter = _KINDS[told.fmiVersion]
        numbers = [v for v in told.modelVariables if v.type == kind and not v.dimensions]
        self._inputs = _variables(path, numbers, "input", inputs, "reads")
        self._outputs = _variables(path, numbers, "output", outputs, "writes")
        self._given = _named(path, numbers, parameters)
        self._told, self._kind = told, (setter, getter)
        self._folder = fmpy.extract(str(path))
        weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        self._begin()

    def _begin(self) -> None:
        """Make a new unit."""
        setter, getter = self._kind
        try:
            unit = _fmpy().instantiate_fmu(self._folder, self._told, "CoSimulation")
        except Exception as error:  # a library of another system, for instance
            message = f"{self._made_of[0]} cannot be loaded: {error}"
            raise wrong(message, "export it for this system") from error
        self._unit = unit
        self._set: Callable[..., Any] = getattr(unit, setter)
        self._get: Callable[..., list[float]] = getattr(unit, getter)
        if self._given:
            self._set(list(self._given), list(self._given.values()))
        self._time: float | None = None

    def __reduce__(self) -> tuple[type[FmuStep], tuple[str, int, int, dict[str, float]]]:
        """Begin again in each copy: a run of a sweep has a unit of its own."""
        return FmuStep, self._made_of

    @property
    def state(self) -> list[float]:
        """Refuse: what a unit remembers is not known as numbers."""
        message = f"{self._made_of[0]}: an FMU does not say what it remembers"
        raise wrong(message, ".pss needs a function in Python or C with a state; use .tran")

    def __call__(self, time: float, values: tuple[float, ...]) -> list[float]:
        """Return the outputs."""
        if self._time is not None and time <= self._time:
            self._begin()  # another run
        if self._time is None:
            self._initialise(time, values)
        else:
            self._unit.doStep(self._time, time - self._time)
        self._time = time
        if self._inputs:
            self._set(self._inputs, list(values))
        return list(self._get(self._outputs)) if self._outputs else []

    def _initialise(self, time: float, values: tuple[float, ...]) -> None:
        unit = self._unit
        if self._told.fmiVersion == "2.0":
            unit.setupExperiment(startTime=time)
            unit.enterInitializationMode()
        else:
            unit.enterInitializationMode(startTime=time)
        if self._inputs:
            self._set(self._inputs, list(values))
        unit.exitInitializationMode()


def _variables(
    path: str | Path, numbers: Sequence[Any], causality: str, count: int, role: str
) -> list[int]:
    """Return the references of all inputs or outputs, in order."""
    found = [v for v in numbers if v.causality == causality]
    if len(found) != count:
        names = ", ".join(v.name for v in found) or "none"
        hint = f"{role} has one name for each {causality}, in order: {names}"
        raise wrong(f"{path} has {len(found)} {causality}s, not {count}", hint)
    return [v.valueReference for v in found]


def _named(
    path: str | Path, numbers: Sequence[Any], given: Mapping[str, float]
) -> dict[int, float]:
    own = {v.name: v.valueReference for v in numbers if v.causality == "parameter"}
    for name in given:
        if name not in own:
            hint = suggest(name, own) or f"it has {', '.join(own) or 'none'}"
            raise wrong(f"{path} has no parameter {name}", hint)
    return {own[name]: float(value) for name, value in given.items()}


def _fmpy() -> Any:
    return need_library("fmpy", "nsspice[fmu]")
