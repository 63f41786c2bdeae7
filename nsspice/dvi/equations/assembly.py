"""From equations with names to the arrays of a complementarity descriptor system.

Every state has a row ``x' = f``, every other unknown a row ``0 = f``.  A multiplier is the ``lam``
of its pair; where it appears inside a nonlinear term it has an additional unknown that equals it.
What is linear in the unknowns, and the sines and constants of the time, goes into matrices; the
rest becomes a tape that the core evaluates and differentiates.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ...devices.behaviour import Compiler
from ...devices.waves import is_wave, wave_values, waveform_of
from ...netlist.expressions import evaluate as _evaluate
from ...netlist.expressions.node import Node, add, num, var
from ...problems.csc import Csc
from ...problems.descriptor import DescriptorSystem, Functional, SmoothTerms, Waveform
from ...problems.elements import Elements
from ...problems.tape import TapeBuilder
from ..terms.errors import wrong
from ..terms.expression import Expr, merged
from ..terms.setvalued import SetValued
from ..terms.splitting import Split

Floats = npt.NDArray[np.float64]
Entries = list[tuple[int, int, float]]
#: end of the clock that a source ``time`` is [s]
_LONGEST = 1e9


@dataclass(frozen=True, slots=True)
class Row:
    """An equation ``x' = f`` of a state, or ``0 = f``.

    Parameters
    ----------
    name : str
        Of the unknown it determines, as messages name it.
    right : Expr
        f.
    state : bool
    """

    name: str
    right: Expr
    state: bool = False


@dataclass(frozen=True, slots=True)
class Pair:
    """A complementarity pair ``0 <= lam`` orthogonal to ``slack >= 0``.

    Parameters
    ----------
    name : str
        As events name it.
    slack : Expr
    enters : tuple of (str, float)
        Rows by name into which ``lam`` enters, with its factor there.
    multiplier : bool
        ``lam`` is the variable ``name`` and appears in expressions.
    """

    name: str
    slack: Expr
    enters: tuple[tuple[str, float], ...] = ()
    multiplier: bool = False


@dataclass(slots=True)
class Model:
    """Rows and pairs by name, before they become arrays."""

    rows: list[Row] = field(default_factory=list)
    pairs: list[Pair] = field(default_factory=list)
    #: factors of rates in the rows of states, of which some are not their own: (row, state)
    mass: dict[tuple[str, str], float] = field(default_factory=dict)
    #: names that are given from outside, such as the states of the last step
    given: tuple[str, ...] = ()

    def close(self) -> Model:
        """Return the model with the rows and pairs of its set-valued terms."""
        atoms: dict[str, SetValued] = {}
        waiting = [merged(*(part.atoms for part in self._parts()))]
        while waiting:
            for name, atom in waiting.pop().items():
                if name not in atoms:
                    atoms[name] = atom
                    waiting.append(atom.argument.atoms)
        out = Model(list(self.rows), list(self.pairs), self.mass, self.given)
        for name, atom in atoms.items():
            value = Expr(var(name))
            out.rows.append(Row(name, atom.argument))
            out.pairs.append(Pair(f"{name}.high", atom.high - value, ((name, 1.0),)))
            out.pairs.append(Pair(f"{name}.low", value - atom.low, ((name, -1.0),)))
        return out

    def _parts(self) -> Iterable[Expr]:
        yield from (row.right for row in self.rows)
        yield from (pair.slack for pair in self.pairs)


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """A model as arrays, with the names of everything in it.

    Parameters
    ----------
    system : DescriptorSystem
    columns, rows, pairs : list of str
        Names of the unknowns z, the rows and the pairs.
    places : dict of str to Functional
        Where each variable is found.
    signals : list of str
        What the sources are: ``1``, ``time``, ``sin(rate,phase)``.
    states : list of str
    given : tuple of str
        Names of what the tape takes as sources.
    offset : float
        Instant of the model at which the clock of the system starts [s].
    """

    system: DescriptorSystem
    columns: list[str]
    rows: list[str]
    pairs: list[str]
    places: dict[str, Functional]
    signals: list[str]
    states: list[str]
    given: tuple[str, ...] = ()
    offset: float = 0.0

    def sources(self, times: Floats, rates: bool = False) -> Floats:
        """Return the values of the sources, or their rates, shape (k, p)."""
        out = np.zeros((times.size, len(self.signals)))
        for j, signal in enumerate(self.signals):
            if signal == "1":
                out[:, j] = 0.0 if rates else 1.0
            elif signal == "time":
                out[:, j] = 1.0 if rates else times
            else:
                out[:, j] = wave_values(signal, times, rates)
        return out

    def data(self, times: Floats, rates: bool = False) -> Floats:
        """Return the right-hand sides of the rows, or their rates, shape (k, n)."""
        values = self.sources(times, rates)
        S = self.system.S
        out = np.zeros((times.size, self.system.n))
        np.add.at(out.T, S.indices, S.data[:, None] * values.T[S.columns])
        return out

    def read(self, name: str, z: Floats, lam: Floats) -> Floats:
        """Return a variable from unknowns (k, n) and multipliers (k, m), shape (k,)."""
        place = self.places[name]
        out = np.zeros(z.shape[0])
        for j, factor in place.z:
            out += factor * z[:, j]
        for j, factor in place.lam:
            out += factor * lam[:, j]
        return out


def assemble(model: Model, offset: float = 0.0) -> Assembly:
    """Return the arrays of a model.

    Parameters
    ----------
    model : Model
    offset : float
        What is added to the time in it [s].

    Raises
    ------
    UsageError
        NS6001 for a variable without an equation, or with two.
    """
    return _Writer(model.close(), offset).write()


class _Writer:
    def __init__(self, model: Model, offset: float) -> None:
        self.model, self.offset = model, offset
        self.number: dict[str, int] = {}
        for k, row in enumerate(model.rows):
            if row.name in self.number:
                raise wrong(
                    "NS6001", f"{row.name} has two equations", "give one equation for each unknown"
                )
            self.number[row.name] = k
        self.lam: dict[str, int] = {}
        for k, pair in enumerate(model.pairs):
            if pair.multiplier:
                if pair.name in self.lam or pair.name in self.number:
                    raise wrong(
                        "NS6001",
                        f"{pair.name} is determined twice",
                        "give one condition for each multiplier",
                    )
                self.lam[pair.name] = k
        self.columns = [row.name for row in model.rows]
        self.row_names = list(self.columns)
        self.tape = TapeBuilder()
        self.compiler = Compiler(self.tape, self._register)
        self.G: Entries = []
        self.A: Entries = []
        self.B: Entries = []
        self.D: Entries = []
        self.S: Entries = []
        self.F: Entries = []
        self.q: list[float] = []
        self.signals: list[str] = []
        self.copies: dict[str, int] = {}
        self.functions = 0

    def write(self) -> Assembly:
        model = self.model
        rows = [Split.of(self._shifted(row.right.node)) for row in model.rows]
        slacks = [Split.of(self._shifted(pair.slack.node)) for pair in model.pairs]
        self._check(rows, slacks)
        for split in (*rows, *slacks):
            self._copy_multipliers(split)
        for k, split in enumerate(rows):
            self._row(k, split, -1.0)
        for k, (pair, split) in enumerate(zip(model.pairs, slacks, strict=True)):
            for row, factor in pair.enters:
                self.A.append((self.number[row], k, factor))
            self._slack(k, pair, split)
        for name, column in self.copies.items():
            self.G.append((column, column, 1.0))
            self.A.append((column, self.lam[name], -1.0))
        return self._assembly()

    def _assembly(self) -> Assembly:
        n, m, p = len(self.columns), len(self.model.pairs), len(self.signals)
        states = [k for k, row in enumerate(self.model.rows) if row.state]
        kinds = np.ones(n, dtype=np.uint8)
        kinds[states] = 0
        stored = {(k, k): 1.0 for k in states}
        mass = {(self.number[r], self.number[c]): v for (r, c), v in self.model.mass.items()}
        plain = not mass
        stored.update(mass)
        E = [(r, c, v) for (r, c), v in stored.items()]
        smooth = None
        if self.functions:
            smooth = SmoothTerms(
                self.tape.finish(),
                _csc((n, self.functions), self.F),
                Csc.zeros((n, self.functions)),
            )
        system = DescriptorSystem(
            E=_csc((n, n), E),
            G=_csc((n, n), self.G),
            A=_csc((n, m), self.A),
            B=_csc((m, n), self.B),
            D=_csc((m, m), self.D),
            q=np.array(self.q, dtype=np.float64),
            S=_csc((n, p), self.S),
            waveforms=tuple(_waveform(signal) for signal in self.signals),
            row_kind=kinds,
            smooth=smooth,
            # every state is a store of its own; what else is in E and G is not a network
            elements=Elements([(k, -1, 1.0) for k in states] if plain else [], []),
        )
        places = {name: Functional(z=((k, 1.0),)) for k, name in enumerate(self.columns)}
        for name, k in self.lam.items():
            places[name] = Functional(lam=((k, 1.0),))
        return Assembly(
            system,
            self.columns,
            self.row_names,
            [pair.name for pair in self.model.pairs],
            places,
            self.signals,
            [row.name for row in self.model.rows if row.state],
            self.model.given,
            self.offset,
        )

    def _shifted(self, node: Node) -> Node:
        if self.offset == 0.0:
            return node
        later = add((var("time"), num(self.offset)))
        return _evaluate.rebuild(node, lambda leaf: later if leaf.value == "time" else leaf)

    def _check(self, rows: Sequence[Split], slacks: Sequence[Split]) -> None:
        known = set(self.number) | set(self.lam) | set(self.model.given)
        owners = [f"the equation of {row.name}" for row in self.model.rows]
        owners += [f"the condition of {pair.name}" for pair in self.model.pairs]
        for owner, split in zip(owners, (*rows, *slacks), strict=True):
            used = {name for name in split.factors if name != "time" and not is_wave(name)}
            for _, node in split.smooth:
                used |= Expr(node).names - {"time"}
            for name in sorted(used - known):
                raise wrong(
                    "NS6001",
                    f"{name} appears in {owner} but has no equation",
                    "give its rate, or a condition that determines it",
                )

    def _copy_multipliers(self, split: Split) -> None:
        """Reserve an unknown for each multiplier inside a nonlinear term."""
        for _, node in split.smooth:
            for name in sorted(Expr(node).names):
                if name in self.lam and name not in self.copies:
                    self.copies[name] = len(self.columns)
                    self.columns.append(f"{name}#copy")
                    self.row_names.append(f"{name}#copy")

    def _row(self, row: int, split: Split, sign: float) -> None:
        """Write ``sign * expression`` into a row."""
        for name, factor in split.factors.items():
            if name in self.number:
                self.G.append((row, self.number[name], sign * factor))
            elif name in self.lam:
                self.A.append((row, self.lam[name], sign * factor))
            else:
                self.S.append((row, self._signal(name), -sign * factor))
        if split.constant:
            self.S.append((row, self._signal("1"), -sign * split.constant))
        tree = split.tree
        if tree is not None:
            self.F.append((row, self._function(tree), sign))

    def _slack(self, k: int, pair: Pair, split: Split) -> None:
        """Write ``w = q - B z + D lam``; what is not of that form gets an unknown of its own."""
        signals = [n for n in split.factors if n not in self.number and n not in self.lam]
        if split.smooth or signals:
            column = len(self.columns)
            self.columns.append(f"{pair.name}#slack")
            self.row_names.append(f"{pair.name}#slack")
            self.G.append((column, column, 1.0))
            self._row(column, split, -1.0)
            self.B.append((k, column, -1.0))
            self.q.append(0.0)
            return
        for name, factor in split.factors.items():
            if name in self.number:
                self.B.append((k, self.number[name], -factor))
            else:
                self.D.append((k, self.lam[name], factor))
        self.q.append(split.constant)

    def _signal(self, name: str) -> int:
        if name not in self.signals:
            self.signals.append(name)
        return self.signals.index(name)

    def _function(self, tree: Node) -> int:
        self.tape.output(self.compiler.compile(tree))
        self.functions += 1
        return self.functions - 1

    def _register(self, name: str) -> int:
        if name == "time":
            return self.tape.time()
        if name in self.model.given:
            return self.tape.source(self.model.given.index(name))
        place = self.copies.get(name)
        return self.tape.unknown(self.number[name] if place is None else place)


def _waveform(signal: str) -> Waveform:
    if signal == "1" or "#" in signal:  # what is given from outside is not a function of the time
        return Waveform("dc", (1.0,))
    if signal == "time":
        return Waveform("pwl", (0.0, 0.0, _LONGEST, _LONGEST))
    return waveform_of(signal)


def _csc(shape: tuple[int, int], entries: Entries) -> Csc:
    rows, cols, values = zip(*entries, strict=True) if entries else ((), (), ())
    return Csc.from_triplets(shape, rows, cols, values)


def start_vector(assembly: Assembly, start: Mapping[str, float]) -> Floats:
    """Return unknowns with given values by name, shape (n,); the others are 0."""
    out = np.zeros(assembly.system.n)
    places = {name: k for k, name in enumerate(assembly.columns)}
    for name, value in start.items():
        if name in places:
            out[places[name]] = value
    return out
