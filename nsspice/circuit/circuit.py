"""The circuit: elements with their laws, split into islands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from numbers import Real
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from ..devices.device import Device
from ..devices.sources.waveform import depends_on_run
from ..devices.stamper import AnalysisKind, Conditions
from ..errors import Diagnostic, NetlistError, UsageError, suggest
from ..netlist.deck import Deck, Source
from ..netlist.expressions.functions import no_temperature
from .mna import MnaSystem, assemble
from .problem_class import ProblemClass
from .signals import owner, parse_signal, unknown_signal

if TYPE_CHECKING:
    from ..analyses import Solution

_NOTHING: Mapping[str, float] = MappingProxyType({})


@dataclass(slots=True)
class Island:
    """An independent part of a circuit.

    Parameters
    ----------
    devices : list of Device
        In deck order.
    nodes : list of str
        All but ground, in order of appearance.
    problem_class : ProblemClass
    reason : str
        The sentence that says why it is of this class.
    defaults : Conditions
        Temperature and times of the deck.
    """

    devices: list[Device]
    nodes: list[str]
    problem_class: ProblemClass
    reason: str
    defaults: Conditions = field(default_factory=Conditions)
    #: the last system, and under which conditions it was assembled: runs are repeated
    _last: tuple[Conditions, MnaSystem] | None = field(
        default=None, init=False, repr=False, compare=False
    )
    #: whether the system depends on the times of the run, once that is known
    _timed: bool | None = field(default=None, init=False, repr=False, compare=False)

    def assemble(
        self,
        temperature: float | None = None,
        values: Mapping[str, float] = _NOTHING,
        *,
        analysis: AnalysisKind = "tran",
        tstep: float | None = None,
        tstop: float | None = None,
    ) -> MnaSystem:
        """Return the MNA system of the island; the last one is kept, and not to be changed.

        Parameters
        ----------
        temperature : float, optional
            [degrees Celsius], the deck's by default.
        values : mapping of str to float
            Values of R, L, C, V or I by element name that replace those of the deck (sweeps).
        analysis : str
            ``"dc"``: sources have their DC value (else their value at t = 0); ``"tran"``: their
            transient function.
        tstep, tstop : float, optional
            Times for the defaults of PULSE, SIN, EXP [s]; those of the ``.tran`` card by default.
        """
        number = isinstance(temperature, Real | None)
        why = no_temperature(temperature) if number and temperature is not None else ""
        if not number or why:
            kind = f"degrees Celsius is {why}" if number else "is not a number"
            message = f"a temperature of {temperature} {kind}"
            raise UsageError(Diagnostic("NS4005", message, None, "give degrees Celsius"))
        if not self.timed:
            tstep = tstop = None  # one system for all runs
        conditions = Conditions(
            self.defaults.temperature if temperature is None else temperature,
            dict(values),
            analysis,
            self.defaults.tstep if tstep is None else tstep,
            self.defaults.tstop if tstop is None else tstop,
            self.defaults.nominal,
        )
        if self._last is None or self._last[0] != conditions:
            self._last = conditions, assemble(self.devices, self.nodes, conditions)
        return self._last[1]

    @property
    def timed(self) -> bool:
        """True if defaults of its sources are times of the run."""
        if self._timed is None:
            sources = [getattr(device, "source", None) for device in self.devices]
            self._timed = any(isinstance(s, Source) and depends_on_run(s) for s in sources)
        return self._timed

    @property
    def pair_count(self) -> int:
        """Number of complementarity pairs."""
        return sum(device.pair_count for device in self.devices)


@dataclass(slots=True, repr=False)
class Circuit:
    """A circuit that passed all checks; :func:`nsspice.read` makes one.

    Parameters
    ----------
    deck : Deck
    devices : list of Device
        In deck order.
    islands : list of Island
    warnings : list of Diagnostic
        Those of the deck and those found while building.
    node_island, element_island : dict of str to int
        Number of the island that contains a node or an element.

    Examples
    --------
    >>> import nsspice
    >>> circuit = nsspice.read('''two separate loops
    ... V1 a 0 1
    ... R1 a 0 1
    ... V2 b 0 2
    ... R2 b 0 1
    ... ''')
    >>> len(circuit.islands), circuit.node_island["b"]
    (2, 1)
    """

    deck: Deck
    devices: list[Device]
    islands: list[Island]
    warnings: list[Diagnostic]
    node_island: dict[str, int]
    element_island: dict[str, int]
    _by_name: dict[str, Device] = field(init=False, repr=False)
    _parts: dict[str, list[tuple[int, str, float]]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        self._by_name = {device.name: device for device in self.devices}
        self._parts = {}

    def __repr__(self) -> str:
        return f"<Circuit {self.deck.title!r}: {self.size}>"

    def _repr_html_(self) -> str:
        """Return what a notebook shows: title, size, and the effects of each element."""
        from ..output.notebook import circuit_html

        return circuit_html(self)

    @property
    def size(self) -> str:
        """Numbers of elements, nodes and islands, as text."""
        sizes = {"element": self.devices, "node": self.node_island, "island": self.islands}
        return ", ".join(f"{len(of)} {word}{'s' * (len(of) != 1)}" for word, of in sizes.items())

    def run(self, **options: Any) -> list[Solution]:
        r"""Run all analyses of the deck, for every value of its ``.step`` cards.

        Parameters
        ----------
        **options
            Keyword arguments of :func:`nsspice.run`.

        Returns
        -------
        list of Solution

        Examples
        --------
        >>> import nsspice
        >>> circuit = nsspice.read("divider\nV1 a 0 2\nR1 a b 1\nR2 b 0 1\n.op\n")
        >>> float(circuit.run()[0]["v(b)"][0])
        1.0
        """
        from ..analyses import run

        return run(self, **options)

    def default_signals(self) -> list[str]:
        """Return all node voltages, then the currents of V, L, E, H, D, S and W elements.

        Nodes inside an element of the deck, such as ``l1#rser``, are not among them.
        """
        by_name = self._by_name
        voltages = [f"v({n})" for n in self.node_island if n.rpartition("#")[0] not in by_name]
        return voltages + [
            f"i({d.name})"
            for d in self.devices
            if d.shows_current and d.name.rpartition(".")[0] not in by_name
        ]

    def broken_junctions(self) -> dict[str, dict[str, Any]]:
        """Return for each junction that is broken lines how many, and how far from its laws.

        The errors are relative to the larger of the scale [A], [C] and the value itself.
        """
        from ..devices.diodes.broken_junction import BrokenJunction

        return {
            name: {"element": device.name, **body.to_dict()}
            for device in self.devices
            for name, body in device.bodies()
            if isinstance(body, BrokenJunction)
        }

    def device(self, name: str) -> Device:
        """Return an element by its name.

        Parameters
        ----------
        name : str
            In upper or lower case; elements of subcircuits by their path, ``x1.r1``.

        Raises
        ------
        NetlistError
            NS2012 if there is none.
        """
        device = self._by_name.get(name.lower())
        if device is not None:
            return device
        hint = suggest(name.lower(), self._by_name) or "name an element of the deck, such as r1"
        raise NetlistError(Diagnostic("NS2012", f"there is no element {name}", hint=hint))

    def parts(self, signal: str) -> list[tuple[int, str, float]]:
        """Return a signal as a sum over islands: (island number, local signal, factor).

        A voltage between two islands is the difference of two node voltages, each against ground;
        ``v(0)`` is an empty sum.

        Parameters
        ----------
        signal : str
            ``v(a)``, ``v(a,b)`` or ``i(element)``.

        Raises
        ------
        NetlistError
            NS2012 if there is no such signal.
        """
        found = self._parts.get(signal)
        if found is None:
            found = self._parts[signal] = self._find(signal)
        return found

    def _find(self, signal: str) -> list[tuple[int, str, float]]:
        parsed = parse_signal(signal)
        if parsed is not None and parsed.kind == "v":
            homes = self.node_island
            a, b = parsed.names if len(parsed.names) == 2 else (parsed.names[0], "0")
            if (a == "0" or a in homes) and (b == "0" or b in homes):
                if "0" not in (a, b) and homes[a] == homes[b]:
                    return [(homes[a], f"v({a},{b})", 1.0)]
                return [(homes[n], f"v({n})", f) for n, f in ((a, 1.0), (b, -1.0)) if n != "0"]
        elif parsed is not None and parsed.kind == "i":
            found = owner(parsed.names[0], self._by_name)
            if found is not None and found[0].letter != "k":
                home = self.element_island[found[0].name]
                return [(home, f"i({parsed.names[0]})", 1.0)]
        known = [f"v({n})" for n in self.node_island] + [f"i({d})" for d in self.element_island]
        raise unknown_signal(signal, known)
