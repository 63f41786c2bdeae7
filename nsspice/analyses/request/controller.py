"""Digital controllers: functions that are called at sampling instants and set sources."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from ...circuit import Circuit
from ...devices import CurrentSource, VoltageSource
from ...errors import Diagnostic, UsageError
from .recorder import select

#: called with the time [s] and the values read; returns the value or values to set
Step = Callable[[float, tuple[float, ...]], "float | Sequence[float] | None"]


@dataclass(frozen=True, slots=True)
class Controller:
    """A function that is called once a period, and what it reads and sets.

    What it sets is held to the next time: between instants the circuit is as without a controller,
    and every engine meets the instants exactly.

    Parameters
    ----------
    period : float
        Between two calls [s].
    reads : sequence of str
        Signals, sampled just before the instant: ``v(out)``, ``i(l1)``.
    writes : sequence of str
        Independent sources whose value [V or A] is set; before the first call it is that of the
        deck.
    step : callable
        ``step(time, values)`` with the values of ``reads`` in order; returns one value for each of
        ``writes``, a number if there is one, or None to leave them as they are.
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
    reads: Sequence[str]
    writes: Sequence[str]
    step: Step = field(compare=False)
    delay: float = 0.0
    offset: float = 0.0

    def checked(self, circuit: Circuit) -> Controller:
        """Return the controller with canonical names.

        Raises
        ------
        UsageError
            NS4005 for times that are impossible, and for what is no independent source.
        NetlistError
            For a signal or an element that does not exist.
        """
        for name, value, least in (
            ("period", self.period, 0.0),
            ("delay", self.delay, -1.0),
            ("offset", self.offset, -1.0),
        ):
            if not (math.isfinite(value) and value > least and value >= 0.0):
                raise _wrong(f"the {name} of a controller cannot be {value!r}", "give seconds")
        if not callable(self.step):
            raise _wrong(f"a controller cannot call {self.step!r}", "give a function")
        if isinstance(self.reads, str) or isinstance(self.writes, str):
            raise _wrong("reads and writes are lists of names", 'write reads=["v(out)"]')
        reads = tuple(select(circuit, self.reads)) if self.reads else ()
        writes = []
        for name in self.writes:
            device = circuit.device(name.lower())
            if not isinstance(device, VoltageSource | CurrentSource):
                hint = "give it a V or I source to set, with its first value: Vduty duty 0 0.5"
                raise _wrong(f"a controller cannot set {name}: it is no independent source", hint)
            writes.append(device.name)
        if len(set(writes)) < len(writes):
            raise _wrong(f"a controller sets a source twice: {', '.join(writes)}", "name it once")
        return Controller(self.period, reads, tuple(writes), self.step, self.delay, self.offset)


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
        for name in controller.writes:
            if owners.setdefault(name, k) != k:
                raise _wrong(f"two controllers set {name}", "let one of them set it")
    return found


def _wrong(message: str, hint: str) -> UsageError:
    return UsageError(Diagnostic("NS4005", message, hint=hint))
