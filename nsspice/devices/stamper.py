"""The stamper: where the laws write their rows, and the layout that says what is where.

Signs: KCL rows sum the currents that leave a node; branch rows read ``L i' - (va - vb) = 0`` and
``-(va - vb) = -V``; a pair has the slack ``w = q - (va - vb) + R lam``.  With them the matrices of
passive networks are symmetric or skew and positive semidefinite.  Smooth nonlinear laws write their
currents, voltages and charges on one tape and say in which rows they enter.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, NamedTuple

from ..problems.descriptor import Functional, Switch, Waveform
from ..problems.elements import TwoTerminal
from ..problems.tape import TapeBuilder

if TYPE_CHECKING:
    from ..netlist.expressions.expression import Expression
    from .expressions.piecewise import Inner

AnalysisKind = Literal["dc", "tran"]


@dataclass(frozen=True, slots=True)
class Conditions:
    """Under which conditions a circuit is assembled.

    Parameters
    ----------
    temperature : float
        [degrees Celsius].
    values : mapping of str to float
        Values that replace those of the deck (sweeps): R, L, C and source values by element name.
    analysis : str
        ``dc``: every source is a constant (its DC value, else its value at t = 0); ``tran``: the
        transient function where there is one.
    tstep, tstop : float or None
        Times of the ``.tran`` card [s], for the defaults of SPICE's sources.
    nominal : float
        Temperature at which values are given [degrees Celsius].
    """

    temperature: float = 27.0
    values: Mapping[str, float] = field(default_factory=dict)
    analysis: AnalysisKind = "tran"
    tstep: float | None = None
    tstop: float | None = None
    nominal: float = 27.0


class Written(NamedTuple):
    """An expression on a tape: its register, and those of the signals that it reads."""

    expression: Expression
    register: int
    signals: dict[str, int]


class Compared(NamedTuple):
    """A comparison of the deck: its element, the node that is 1 where it is true, its currents.

    With ``ends`` the node has one of two other voltages, where it is false and where it is true:
    each an output and a constant [V].
    """

    element: str
    comparison: Expression
    node: int
    currents: Mapping[str, Functional]
    ends: tuple[tuple[Functional, float], tuple[Functional, float]] | None = None


class Stated(NamedTuple):
    """An expression of the deck, what stands for it in the system, and the currents it reads."""

    element: str
    expression: Expression
    value: Functional
    currents: Mapping[str, Functional]


class Layout:
    """Numbers of the unknowns, pairs, source columns and functions of one assembled island.

    Parameters
    ----------
    nodes : list of str
        All nodes but ground.
    conditions : Conditions
    """

    __slots__ = (
        "_before",
        "_depth",
        "branches",
        "broken",
        "columns",
        "compared",
        "conditions",
        "driven",
        "functions",
        "inner",
        "nodes",
        "pairs",
        "readings",
        "stated",
    )  # fmt: skip

    def __init__(
        self, nodes: list[str], conditions: Conditions, tree: Mapping[str, str] | None = None
    ) -> None:
        self.nodes: dict[str, int] = {name: k for k, name in enumerate(nodes)}
        self.nodes["0"] = -1
        #: the node against which the voltage of each node is an unknown, ground by default
        self._before: dict[str, str] = dict(tree or {})
        self._depth: dict[str, int] = {"0": 0}
        self.conditions = conditions
        self.branches: dict[str, int] = {}
        #: junctions that are broken lines
        self.broken: list[str] = []
        self.pairs: dict[str, tuple[int, ...]] = {}
        self.columns: dict[str, int] = {}
        #: voltages at t = 0 of nodes that a source holds [V]
        self.driven: dict[str, float] = {}
        #: smooth functions by the name of the current or charge that they give
        self.functions: dict[str, int] = {}
        #: expressions on the tape
        self.readings: list[Written] = []
        #: comparisons that are switches
        self.compared: list[Compared] = []
        #: nodes inside elements that stand for kinks and jumps
        self.inner: list[Inner] = []
        #: expressions that nodes, pairs and switches stand for
        self.stated: list[Stated] = []

    def voltage(self, a: str, b: str, factor: float = 1.0) -> tuple[tuple[int, float], ...]:
        """Return ``factor (va - vb)`` as terms of z: the voltages along the tree from b to a."""
        up: list[tuple[int, float]] = []
        while a != b:
            if self.depth(a) >= self.depth(b):
                up.append((self.nodes[a], factor))
                a = self._before.get(a, "0")
            else:
                up.append((self.nodes[b], -factor))
                b = self._before.get(b, "0")
        return tuple(up)

    def depth(self, node: str) -> int:
        """Return how many voltages of the tree add up to that of a node."""
        found = self._depth.get(node)
        if found is None:
            if node not in self.nodes:
                raise KeyError(node)
            path = [node]
            while (before := self._before.get(path[-1], "0")) not in self._depth:
                path.append(before)
            found = self._depth[before]
            for one in reversed(path):
                found += 1
                self._depth[one] = found
        return found

    def hang(self, node: str, beside: str) -> str:
        """Let a node hang from another one, from ground without a tree; return the one it has."""
        if self._before and beside != "0":
            self._before[node] = beside
        return self.before(node)

    def before(self, node: str) -> str:
        """Return the node against which the voltage of a node is an unknown."""
        return self._before.get(node, "0")

    def series_current(self, node: str, inner: str, conductance: float) -> Functional:
        """Return the current through a resistance inside an element as an output."""
        if inner in self.branches:
            return self.branch(inner)
        return Functional(z=self.voltage(node, inner, conductance))

    def branch(self, name: str) -> Functional:
        """Return the branch current of an element as an output."""
        return Functional(z=((self.branches[name], 1.0),))


@dataclass(slots=True)
class Triplets:
    """A sparse matrix under construction; repeated entries add."""

    rows: list[int] = field(default_factory=list)
    cols: list[int] = field(default_factory=list)
    data: list[float] = field(default_factory=list)

    def add(self, row: int, col: int, value: float) -> None:
        """Add an entry; ground (-1) is left out."""
        if row >= 0 and col >= 0:
            self.rows.append(row)
            self.cols.append(col)
            self.data.append(value)

    def across(self, terms: tuple[tuple[int, float], ...], value: float) -> None:
        """Add a symmetric two-terminal element whose voltage these terms are."""
        for row, one in terms:
            for col, two in terms:
                self.rows.append(row)
                self.cols.append(col)
                self.data.append(one * two * value)


class Stamper:
    """Collects the arrays of one descriptor system; the laws write, the circuit reads.

    Parameters
    ----------
    layout : Layout
        Its nodes are given; branches, pairs and columns are filled in while stamping.

    Examples
    --------
    A resistor of 2 Ohm from node a to ground and a 1 A source into a:

    >>> st = Stamper(Layout(["a"], Conditions()))
    >>> st.conductance("a", "0", 0.5)
    >>> st.current_source("0", "a", st.column(Waveform("dc", (1.0,))))
    >>> st.G.data, st.S.data
    ([0.5], [1.0])
    """

    def __init__(self, layout: Layout, junctions: bool = True) -> None:
        self.layout = layout
        #: junctions that are broken lines are written; without them the rest can be judged
        self.junctions = junctions
        self.E, self.G, self.A = Triplets(), Triplets(), Triplets()
        self.B, self.D, self.S = Triplets(), Triplets(), Triplets()
        self.q: list[float] = []
        #: what E and G are summed from, as far as it is capacitors and resistors
        self.capacitors: list[TwoTerminal] = []
        self.conductors: list[TwoTerminal] = []
        #: smooth functions, where they enter and where their rates do
        self.tape = TapeBuilder()
        self.F, self.Q = Triplets(), Triplets()
        self._functions: dict[int, int] = {}
        self._registers: list[int] = []
        self._voltages: dict[tuple[str, str], int] = {}
        self.waveforms: list[Waveform] = []
        self.switches: list[Switch] = []
        self.branch_names: list[str] = []
        self.branch_elements: list[str] = []
        self.branch_kinds: list[int] = []
        self.pair_names: list[str] = []
        self.pair_elements: list[str] = []
        self._column_of: dict[tuple[object, ...], int] = {}
        self._first_branch = len(layout.nodes) - 1

    @property
    def node_count(self) -> int:
        """Number of nodes of the deck; their voltages are the first unknowns."""
        return self._first_branch

    @property
    def size(self) -> int:
        """Number of unknowns so far."""
        return self._first_branch + len(self.branch_names)

    # unknowns, pairs, columns ----------------------------------------------------------------

    def branch(self, name: str, kind: int = 1, element: str = "") -> int:
        """Add a branch-current unknown with its row (kind 1: a voltage row, 0: a current row)."""
        index = self.size
        self.layout.branches[name] = index
        self.branch_names.append(f"i({name})")
        self.branch_elements.append(element or name)
        self.branch_kinds.append(kind)
        return index

    def internal_node(self, name: str, element: str, beside: str = "0") -> str:
        """Add a node inside an element; its voltage is an unknown, its row a current law.

        Where the unknowns are voltages along a tree it hangs from the node ``beside`` it.
        """
        index = self.size
        self.layout.nodes[name] = index
        before = self.layout.hang(name, beside)
        self.branch_names.append(f"v({name})" if before == "0" else f"v({name},{before})")
        self.branch_elements.append(element)
        self.branch_kinds.append(0)
        return name

    def pair(self, name: str, element: str, a: str, b: str, offset: float, series: float) -> int:
        """Add a pair with ``lam`` from a to b and ``w = offset - (va - vb) + series lam``."""
        p = len(self.q)
        for index, sign in self.layout.voltage(a, b):
            self.A.add(index, p, sign)
            self.B.add(p, index, sign)
        if series:
            self.D.add(p, p, series)
        self.q.append(offset)
        self.pair_names.append(name)
        self.pair_elements.append(element)
        return p

    def column(self, waveform: Waveform) -> int:
        """Return the column of a waveform; equal waveforms share one."""
        key = (
            waveform.kind,
            waveform.values,
            repr(waveform.repeat),
            waveform.scale,
            waveform.handed,
        )
        index = self._column_of.setdefault(key, len(self.waveforms))
        if index == len(self.waveforms):
            self.waveforms.append(waveform)
        return index

    # smooth functions ------------------------------------------------------------------------

    @property
    def smooth(self) -> bool:
        """True if some law wrote a smooth function."""
        return bool(self._registers)

    def function(self, register: int) -> int:
        """Make a register of the tape a function of the system; return its number."""
        found = self._functions.get(register)
        if found is None:
            found = self._functions[register] = self.tape.output(register)
            self._registers.append(register)
        return found

    def voltage_register(self, a: str, b: str = "0") -> int:
        """Return the register of ``va - vb``."""
        found = self._voltages.get((a, b))
        if found is None:
            sides: tuple[list[int], list[int]] = ([], [])
            for index, sign in self.layout.voltage(a, b):
                sides[sign < 0.0].append(self.tape.unknown(index))
            found = self._voltages[a, b] = self.tape.total(*sides)
        return found

    def register(self, name: str, functional: Functional) -> int:
        """Return the register of a combination of z, u and f.

        Multipliers and rates are not read by tapes: a quantity that holds some becomes an unknown.

        Parameters
        ----------
        name : str
            Element whose current it is.
        functional : Functional
        """
        if functional.lam or functional.dz or functional.df:
            return self.tape.unknown(self.as_unknown(name, functional))
        tape = self.tape
        terms = [(tape.unknown(index), value) for index, value in functional.z]
        terms += [(tape.source(index), value) for index, value in functional.u]
        terms += [(self._registers[index], value) for index, value in functional.f]
        total: int | None = None
        for register, value in terms:
            term = register if value == 1.0 else tape.op("mul", tape.constant(value), register)
            total = term if total is None else tape.op("add", total, term)
        return tape.constant(0.0) if total is None else total

    def as_unknown(self, name: str, functional: Functional) -> int:
        """Return an unknown that equals the current of an element, a new one if it has none."""
        branches = self.layout.branches
        if name not in branches:
            row = self.branch(name, kind=0)
            self.G.add(row, row, 1.0)
            self.add(row, functional, -1.0)
        return branches[name]

    def of_unknowns(self, name: str, functional: Functional) -> tuple[tuple[int, float], ...]:
        """Return an output as a combination of unknowns, a new one where it is more than that."""
        f = functional
        if f.lam or f.dz or f.u or f.f or f.df:
            return ((self.as_unknown(name, f), 1.0),)
        return f.z

    def enter(self, a: str, b: str, current: int, factor: float = 1.0) -> None:
        """Let ``factor`` times a smooth function flow from a through the element to b."""
        for row, sign in self.layout.voltage(a, b, factor):
            self.F.add(row, current, sign)

    def enter_charge(self, a: str, b: str, charge: int, factor: float = 1.0) -> None:
        """Let the rate of ``factor`` times a smooth function flow from a to b."""
        for row, sign in self.layout.voltage(a, b, factor):
            self.Q.add(row, charge, sign)

    # stamps ----------------------------------------------------------------------------------

    def conductance(self, a: str, b: str, value: float) -> None:
        """Add a conductance [S] between two nodes."""
        nodes = self.layout.nodes
        if nodes[a] != nodes[b]:
            self.G.across(self.layout.voltage(a, b), value)
            self.conductors.append((nodes[a], nodes[b], value))

    def capacitance(self, a: str, b: str, value: float) -> None:
        """Add a capacitance [F] between two nodes."""
        nodes = self.layout.nodes
        if nodes[a] != nodes[b]:
            self.E.across(self.layout.voltage(a, b), value)
            self.capacitors.append((nodes[a], nodes[b], value))

    def connect(self, branch: int, a: str, b: str) -> None:
        """Let the branch current flow from a to b and write ``-(va - vb)`` into its row."""
        for index, sign in self.layout.voltage(a, b):
            self.G.add(index, branch, sign)
            self.G.add(branch, index, -sign)

    def series_resistance(
        self, node: str, inner: str, element: str, ohms: float, *, held: bool
    ) -> None:
        """Add a node inside an element, behind a resistance [Ohm]; a capacitance may have it held.

        Otherwise the current is an unknown: that of a blocking junction is less than the rounding
        of a difference of voltages over so small a resistance.
        """
        self.internal_node(inner, element, node)
        if held:
            self.conductance(node, inner, 1.0 / ohms)
            return
        branch = self.branch(inner, element=element)
        self.connect(branch, node, inner)
        self.G.add(branch, branch, ohms)

    def charge_with_knots(
        self,
        node: str,
        unit: float,
        across: Iterable[tuple[int, float]],
        slope: float,
        knots: Iterable[tuple[int, float]],
    ) -> None:
        """Add a charge that is a broken line, as the capacitor ``unit`` [F] at an inner node.

        Its current is the unknown of the branch of this name: ``unit`` times the rate of the node's
        voltage, which is ``slope`` times the voltage ``across`` and a multiple of what each pair
        has beyond its knot; ``knots`` are pairs with their multiples.
        """
        y, row = self.layout.nodes[node], self.layout.branches[node]
        self.capacitance(node, "0", unit)
        self.G.add(y, row, -1.0)
        self.G.add(row, y, 1.0)
        for index, sign in across:
            self.G.add(index, row, sign)
            self.G.add(row, index, -sign * slope)
        for pair, multiple in knots:
            self.A.add(row, pair, -multiple)

    def current_source(self, a: str, b: str, column: int, factor: float = 1.0) -> None:
        """Let ``factor`` times a waveform flow from a through the element to b."""
        for index, sign in self.layout.voltage(a, b, -factor):
            self.S.add(index, column, sign)

    def add(self, row: int, functional: Functional, factor: float = 1.0) -> None:
        """Add a linear combination of z, lam, z', u, f and f' to the left side of a row."""
        for index, value in functional.z:
            self.G.add(row, index, factor * value)
        for index, value in functional.lam:
            self.A.add(row, index, factor * value)
        for index, value in functional.dz:
            self.E.add(row, index, factor * value)
        for index, value in functional.u:
            self.S.add(row, index, -factor * value)
        for index, value in functional.f:
            self.F.add(row, index, factor * value)
        for index, value in functional.df:
            self.Q.add(row, index, factor * value)

    def inject(self, a: str, b: str, functional: Functional, factor: float = 1.0) -> None:
        """Let ``factor`` times an output flow from a through the element to b."""
        for row, sign in self.layout.voltage(a, b, factor):
            self.add(row, functional, sign)
