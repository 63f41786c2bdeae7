"""Sources that are set from outside, and the clock for which all islands wait."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from ...circuit import Circuit
from ...devices import CurrentSource, VoltageSource
from ...solvers.polynomial import Polynomial


@dataclass(slots=True)
class HeldSources:
    """Sources that are set from outside, and the clock for which all islands wait.

    Parameters
    ----------
    values : dict of str to float
        The value of each source now, at first that of the deck [V or A].
    """

    values: dict[str, float]
    held: dict[str, Polynomial] = field(init=False)
    clock: Polynomial = field(init=False)
    #: up to where all of them are known, and each of them [s]
    known: float = 0.0
    _ends: dict[str, float] = field(init=False)

    def __post_init__(self) -> None:
        self.renew(self.values)

    @classmethod
    def of(cls, circuit: Circuit, names: Iterable[str]) -> HeldSources:
        """Return independent sources of a circuit by name, with their own values."""
        return cls({name: _own_value(circuit, name) for name in names})

    def renew(self, before: Mapping[str, float]) -> None:
        """Begin a new run, before which the sources had other values."""
        self.held = {name: Polynomial.held(value) for name, value in before.items()}
        self.clock = Polynomial.held(0.0, steady=True)
        self._ends = dict.fromkeys(before, 0.0)
        self.known = 0.0

    def change(self, name: str, value: float, at: float) -> None:
        """Set a source from an instant on that is not before all that is known [s]."""
        before = self.values[name]
        if value == before:
            return
        if at > self._ends[name]:
            self.held[name].hold(before, at)
            self._ends[name] = at
        self.values[name] = value

    def hold(self, to: float) -> None:
        """Hold all sources to an instant [s]."""
        self.known = to
        for name, source in self.held.items():
            source.hold(self.values[name], to)
            self._ends[name] = to
        self.clock.hold(0.0, to)

    @property
    def overrides(self) -> dict[str, float]:
        """The held values, to be put in place of those of the deck."""
        return dict(self.held)  # type: ignore[arg-type]


def _own_value(circuit: Circuit, name: str) -> float:
    """Return the value of a source before anything sets it."""
    device = circuit.device(name)
    assert isinstance(device, VoltageSource | CurrentSource)
    return device.source.dc or 0.0
