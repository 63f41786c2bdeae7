"""Digital controllers: functions that are called at sampling instants and set sources."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ...circuit import Circuit
from ...devices import CurrentSource, VoltageSource
from .converters import Adc, Pwm, wrong
from .recorder import select

#: called with the time [s] and the values read; returns the value or values to set
Step = Callable[[float, tuple[float, ...]], "float | Sequence[float | None] | None"]


@dataclass(frozen=True, slots=True)
class Controller:
    """A function that is called once a period, and what it reads and sets.

    What it sets is held to the next time: between instants the circuit is as without a controller,
    and every engine meets the instants exactly.

    Parameters
    ----------
    period : float
        Between two calls [s].
    reads : sequence of str or Adc
        Signals, sampled just before the instant: ``v(out)``, ``i(l1)``.
    writes : sequence of str or Pwm
        Independent sources whose value [V or A] is set; before the first call it is that of the
        deck.  Of a :class:`Pwm` the duty cycle is set.
    step : callable
        ``step(time, values)`` with the values of ``reads`` in order; returns one value for each of
        ``writes``, a number if there is one, or None to leave them as they are.  If it remembers
        anything from call to call, a property ``state``, a list of numbers that can also be set,
        lets ``.pss`` find its steady state.
    delay : float
        From the sample to the change of the sources [s]: computing time.
    offset : float
        Of the first call [s].

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''a relay keeps a capacitor between 0 and 1 V
    ... Iin 0 a 0
    ... C1 a 0 1 IC=0
    ... R1 a 0 1meg
    ... ''')
    >>> def relay(time, values):
    ...     (v,) = values
    ...     return 1.0 if v < 0.01 else -1.0 if v > 0.99 else None
    >>> controller = nsspice.Controller(1.0, ["v(a)"], ["iin"], relay)
    >>> sol = nsspice.tran(circuit, 4.0, 1.0, uic=True, controllers=[controller])
    >>> (sol["v(a)"].round(3) + 0.0).tolist()
    [0.0, 1.0, 0.0, 1.0, 0.0]
    """

    period: float
    reads: Sequence[str | Adc]
    writes: Sequence[str | Pwm]
    step: Step = field(compare=False)
    delay: float = 0.0
    offset: float = 0.0

    @classmethod
    def from_library(
        cls,
        path: str | Path,
        period: float,
        reads: Sequence[str | Adc],
        writes: Sequence[str | Pwm],
        delay: float = 0.0,
        offset: float = 0.0,
    ) -> Controller:
        """Return a controller whose function is in a shared library, written in C.

        Parameters
        ----------
        path : str or Path
            A library with ``void step(const double *in, double *out, void *state)``, see
            the header ``nsspice/controller.h`` in the folder that ``nsspice --include`` prints.
        period, reads, writes, delay, offset
            Those of the controller.

        Raises
        ------
        UsageError
            NS4005 for a library that cannot be loaded, or has no such function.
        """
        from .c_library import CStep

        law = CStep(path, len(reads), len(writes))
        return cls(period, reads, writes, law, delay, offset)

    @classmethod
    def from_fmu(
        cls,
        path: str | Path,
        period: float,
        reads: Sequence[str | Adc],
        writes: Sequence[str | Pwm],
        parameters: Mapping[str, float] | None = None,
        delay: float = 0.0,
        offset: float = 0.0,
    ) -> Controller:
        """Return a controller that is a unit for co-simulation, FMI 2 or 3.

        Parameters
        ----------
        path : str or Path
            ``law.fmu``; its inputs are ``reads``, its outputs ``writes``, in its order.
        period, reads, writes, delay, offset
            Those of the controller.
        parameters : mapping of str to float, optional
            Values of its parameters.

        Raises
        ------
        UsageError
            NS4005 for a unit that cannot be loaded or does not fit, NS4010 without fmpy.
        """
        from .fmu_unit import FmuStep

        law = FmuStep(path, len(reads), len(writes), parameters or {})
        return cls(period, reads, writes, law, delay, offset)

    def checked(self, circuit: Circuit) -> Controller:
        """Return the controller with canonical names.

        Raises
        ------
        UsageError
            NS4005 for times that are impossible, and for what is not an independent source.
        NetlistError
            For a signal or an element that does not exist.
        """
        for name, value, least in (
            ("period", self.period, 0.0),
            ("delay", self.delay, -1.0),
            ("offset", self.offset, -1.0),
        ):
            if not (math.isfinite(value) and value > least and value >= 0.0):
                raise wrong(f"the {name} of a controller cannot be {value!r}", "give seconds")
        if not callable(self.step):
            raise wrong(f"a controller cannot call {self.step!r}", "give a function")
        if isinstance(self.reads, str) or isinstance(self.writes, str):
            raise wrong("reads and writes are lists of names", 'write reads=["v(out)"]')
        reads = [part for read in self.reads for part in _checked_read(circuit, read)]
        writes = [_checked_write(circuit, write) for write in self.writes]
        names = sources_of(writes)
        if len(set(names)) < len(names):
            raise wrong(f"a controller sets a source twice: {', '.join(names)}", "name it once")
        return replace(self, reads=tuple(reads), writes=tuple(writes))

    @property
    def sources(self) -> list[str]:
        """The sources that are set, those of counters included."""
        return sources_of(self.writes)


def sources_of(writes: Sequence[str | Pwm]) -> list[str]:
    """Return the names of all sources that are set."""
    return [n for w in writes for n in ((w,) if isinstance(w, str) else w.outputs)]


def checked_controllers(
    circuit: Circuit, controllers: Sequence[Controller]
) -> tuple[Controller, ...]:
    """Return controllers with canonical names.

    Raises
    ------
    UsageError
        NS4005 if two of them set the same source.
    """
    found = tuple(controller.checked(circuit) for controller in controllers)
    owners: dict[str, int] = {}
    for k, controller in enumerate(found):
        for name in controller.sources:
            if owners.setdefault(name, k) != k:
                raise wrong(f"two controllers set {name}", "let one of them set it")
    return found


def _checked_read(circuit: Circuit, read: str | Adc) -> list[str | Adc]:
    if not isinstance(read, Adc):
        return list(select(circuit, [read]))
    read.check()
    (name,) = select(circuit, [read.signal])
    return [replace(read, signal=name)]


def _checked_write(circuit: Circuit, write: str | Pwm) -> str | Pwm:
    if not isinstance(write, Pwm):
        return _source(circuit, write)
    write.check()
    other = write.complement
    if other is not None:
        other = _source(circuit, other)
    return replace(write, output=_source(circuit, write.output), complement=other)


def _source(circuit: Circuit, name: str) -> str:
    device = circuit.device(name.lower())
    if not isinstance(device, VoltageSource | CurrentSource):
        hint = "give it a V or I source to set, with its first value: Vduty duty 0 0.5"
        raise wrong(f"a controller cannot set {name}: it is not an independent source", hint)
    return name.lower()
