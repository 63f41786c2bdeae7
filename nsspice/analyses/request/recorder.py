"""Which quantities of which island make up the signals asked for."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np
import numpy.typing as npt

from ...circuit import Circuit
from ...errors import Diagnostic, NetlistError, Span
from ..signals.curve import Floats
from ..signals.signal_names import canonical
from .arguments import name_of, several


@dataclass(slots=True)
class Recorder:
    """Maps signals to columns recorded by the islands, and back.

    A voltage between two islands is a difference of two columns; a power is a sum of products of a
    voltage and a current.  Each quantity is recorded once.

    Parameters
    ----------
    circuit : Circuit
    names : sequence of str
        Canonical names of the signals.
    beside : sequence of (int, str)
        Islands and names of quantities that are recorded besides, as parts of no signal.
    """

    circuit: Circuit
    names: list[str]
    beside: Sequence[tuple[int, str]] = ()
    #: names that each island records
    local: list[list[str]] = field(default_factory=list)
    _sums: list[list[tuple[int, float]]] = field(default_factory=list)
    _products: list[tuple[int, int, int]] = field(default_factory=list)
    _order: list[int] = field(default_factory=list)
    #: True if the recorded columns are the signals already, in order
    direct: bool = False
    _first: npt.NDArray[np.int64] = field(init=False)
    _factor: Floats = field(init=False)
    _more: list[tuple[int, list[tuple[int, float]]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        circuit = self.circuit
        self.local = [[] for _ in circuit.islands]
        places: dict[tuple[int, str], int] = {}
        numbered: list[tuple[int, int]] = []  # island, place among its names

        def linear(name: str) -> list[tuple[int, float]]:
            terms = []
            for home, local, factor in circuit.parts(name):
                place = places.get((home, local))
                if place is None:
                    place = places[home, local] = len(numbered)
                    numbered.append((home, len(self.local[home])))
                    self.local[home].append(local)
                terms.append((place, factor))
            return terms

        for column, name in enumerate(self.names):
            if name.startswith("p("):
                for current, a, b in circuit.device(name[2:-1]).powers:
                    self._sums += [linear(f"v({a},{b})"), linear(f"i({current})")]
                    self._products.append((column, len(self._sums) - 2, len(self._sums) - 1))
                self._order.append(-1)
            else:
                self._order.append(len(self._sums))
                self._sums.append(linear(name))
        for home, local_name in self.beside:
            if local_name not in self.local[home]:
                self.local[home].append(local_name)
        # islands are side by side in the recorded block: renumber from order of appearance
        if len(self.local) > 1:
            starts = list(accumulate(map(len, self.local), initial=0))
            position = [starts[home] + index for home, index in numbered]
            self._sums = [[(position[k], f) for k, f in terms] for terms in self._sums]
        in_order = [[(k, 1.0)] for k in range(len(self.names))]
        self.direct = not self._products and self._sums == in_order
        self.direct = self.direct and self.recorded == len(self.names)
        if self.direct:
            return
        # most signals are one recorded column: they are picked all at once
        self._first = np.array([terms[0][0] if terms else 0 for terms in self._sums], np.int64)
        self._factor = np.array([terms[0][1] if terms else 0.0 for terms in self._sums])
        self._more = [(j, terms[1:]) for j, terms in enumerate(self._sums) if len(terms) > 1]

    @property
    def recorded(self) -> int:
        """Number of recorded columns of all islands."""
        return sum(map(len, self.local))

    def homes(self) -> npt.NDArray[np.int64]:
        """Return the island of each signal, -1 for those of several or of none."""
        found = []
        for name in self.names:
            of = "i" + name[1:] if name.startswith("p(") else name
            islands = {home for home, _, _ in self.circuit.parts(of)}
            found.append(islands.pop() if len(islands) == 1 else -1)
        return np.array(found, dtype=np.int64)

    def terms(self, name: str) -> list[tuple[int, float]] | None:
        """Return a signal as a sum of recorded columns with factors, None for a power."""
        place = self._order[self.names.index(name)]
        return None if place < 0 else self._sums[place]

    def signals(self, block: Floats) -> Floats:
        """Return the signals, shape (k, len(names)), of recorded columns (k, recorded)."""
        if self.direct:
            return block
        sums = block[:, self._first] * self._factor
        for j, terms in self._more:
            for k, factor in terms:
                sums[:, j] += factor * block[:, k]
        out: Floats = sums[:, self._order]
        for column, _, _ in self._products:
            out[:, column] = 0.0
        for column, voltage, current in self._products:
            out[:, column] += sums[:, voltage] * sums[:, current]
        return out


def select(circuit: Circuit, requested: Sequence[str] | None = None) -> list[str]:
    """Return the signals to show.

    Parameters
    ----------
    circuit : Circuit
    requested : sequence of str, optional
        Names as the user writes them, ``all`` (node voltages), ``alli`` (currents); else the deck's
        ``.save`` and ``.print`` cards; else the default set.

    Raises
    ------
    NetlistError
        NS2012 with every name that does not exist.
    UsageError
        NS4005 for anything but a name.
    """
    wanted: list[tuple[str, Span | None]] = [
        (name_of(name, "a signal", "v(out)"), None)
        for name in several(requested, "the signals", '["v(out)"]')
    ]
    if not wanted:
        wanted = [(signal.name, signal.span) for signal in circuit.deck.saves]
    if not wanted:
        return circuit.default_signals()
    names: dict[str, None] = {}
    errors: list[Diagnostic] = []
    for written, span in wanted:
        for name in _expand(circuit, canonical(written)):
            try:
                # a power exists if the current does
                circuit.parts("i" + name[1:] if name.startswith("p(") else name)
            except NetlistError as error:
                found = error.diagnostics[0]
                errors.append(Diagnostic(found.code, found.message, span, found.hint))
            else:
                names[name] = None
    if errors:
        raise NetlistError(errors)
    return list(names)


def _expand(circuit: Circuit, name: str) -> Iterable[str]:
    if name in ("all", "v(all)", "allv"):
        return [f"v({node})" for node in circuit.node_island]
    if name in ("alli", "i(all)"):
        return [f"i({d.name})" for d in circuit.devices if d.letter != "k"]
    if name in ("allp", "p(all)"):
        return [f"p({d.name})" for d in circuit.devices if d.letter != "k"]
    return [name]
