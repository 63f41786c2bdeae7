"""The reference network: all rates of the states as functions of states, inputs and sources.

Tree capacitors act as voltage sources, cotree capacitors are open, cotree inductors act as current
sources, tree inductors are shorts; each set-valued branch has its free quantity ``u`` (slack in the
tree, current outside) given.  What remains is one linear system for

    z (n), lam (m), rho (states): the currents into tree capacitors, the voltages across cotree
    inductors,

with the states, ``u`` and the sources on its right side.  It is the common root of the DLCP form
and of the theta terms.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..devices.passive.capacitor import Capacitor
from ..devices.passive.inductor import Inductor
from ..errors import Diagnostic, RegularityError
from ..problems.csc import Csc, Floats, Ints
from .mna import MnaSystem
from .normal_tree import NormalTree, normal_tree
from .windings import Winding, tied, tight_windings

Bools = npt.NDArray[np.bool_]
Terms = tuple[tuple[int, float], ...]
Solve = Callable[[Floats], Floats]

#: below this number of unknowns dense linear algebra is used
DENSE = 300


@dataclass(frozen=True, slots=True)
class State:
    """An independent state.

    Parameters
    ----------
    name : str
        ``v[c1]``, ``i[l1]``, or a combination such as ``i[l1]+2*i[l2]``.
    terms : tuple of (int, float)
        The state as a combination of unknowns z; also where its rate enters the rows: the rate of
        a capacitor leaves its first node, the one of an inductor is in its branch row.
    storage : float
        Capacitance [F] or inductance [H].
    """

    name: str
    terms: Terms
    storage: float


@dataclass(frozen=True, slots=True)
class Reference:
    """The reference network of an island.

    Parameters
    ----------
    mna : MnaSystem
    tree : NormalTree
    states : tuple of State
    in_tree : ndarray of bool, shape (m,)
        Which pairs are in the tree (``u = w``).
    fixed : ndarray of bool, shape (n,)
        Rows that were replaced by "unknown = 0": redundant sources, floating roots.
    matrix : Csc
        Of the linear system, order n + m + number of states.
    """

    mna: MnaSystem
    tree: NormalTree
    states: tuple[State, ...]
    in_tree: Bools
    fixed: Bools
    matrix: Csc

    def incidence(self) -> Csc:
        """Return P, shape (n, states): where the rates enter the rows; P' z are the states."""
        return _incidence(self.mna.system.n, self.states)

    def outputs(self, z: Floats, lam: Floats) -> Floats:
        """Return the quantity of each pair that is not given: current in the tree, else slack."""
        s = self.mna.system
        slack = -s.B.dense() @ z + s.D.dense() @ lam
        return np.where(self.in_tree[:, None], lam, slack)

    def solver(self) -> Solve:
        """Return a function that solves the system for one or several right sides (columns).

        Raises
        ------
        RegularityError
            NS2060 if the system is singular.
        """
        order = self.matrix.shape[0]
        if order <= DENSE:
            dense = self.matrix.dense()
            if order and _condition(dense) > 1e15:
                raise self._singular()
            return lambda right: np.asarray(np.linalg.solve(dense, right)) if order else right
        import scipy.sparse
        import scipy.sparse.linalg

        matrix = scipy.sparse.csc_matrix(
            (self.matrix.data, self.matrix.indices, self.matrix.indptr), shape=self.matrix.shape
        )
        try:
            factors = scipy.sparse.linalg.splu(matrix)
        except RuntimeError:
            raise self._singular() from None

        def solve(right: Floats) -> Floats:
            return np.asarray(factors.solve(right))

        return solve

    def _singular(self) -> RegularityError:
        """Return the error for a network without unique rates, naming what may be at fault."""
        active = [d.name for d in self.mna.devices if d.letter in "efgh"]
        negative = [
            d.name for d in self.mna.devices if d.letter == "r" and getattr(d, "value", 1.0) < 0
        ]
        suspects = active + negative
        listed = ", ".join(suspects[:8])
        cause = f" (it holds {listed})" if suspects else ""
        return RegularityError(
            Diagnostic(
                "NS2060",
                "the states do not determine the currents and voltages of the circuit when all "
                f"set-valued elements are off{cause}",
                None,
                "use theta=1, or add a resistor where a controlled source leaves a node free",
            )
        )


def _incidence(n: int, states: Sequence[State]) -> Csc:
    """Return the matrix that takes rates to rows, shape (n, states)."""
    entries = [(index, k, value) for k, s in enumerate(states) for index, value in s.terms]
    rows, cols, values = zip(*entries, strict=True) if entries else ((), (), ())
    return Csc.from_triplets((n, len(states)), rows, cols, values)


def _condition(dense: Floats) -> float:
    """Return the condition number after scaling rows and columns to unit maximum."""
    rows = np.abs(dense).max(axis=1)
    if rows.min() == 0.0:
        return float("inf")
    scaled = dense / rows[:, None]
    columns = np.abs(scaled).max(axis=0)
    if columns.min() == 0.0:
        return float("inf")
    return float(np.linalg.cond(scaled / columns))


def reference(mna: MnaSystem) -> Reference:
    """Return the reference network of an assembled island.

    Parameters
    ----------
    mna : MnaSystem

    Raises
    ------
    RegularityError
        NS2063 if the island holds smooth nonlinear laws, or charges that are not states.
    """
    if mna.system.smooth is not None:
        smooth = ", ".join([d.name for d in mna.devices if d.smooth][:8])
        raise RegularityError(
            Diagnostic(
                "NS2063",
                f"{smooth} follow{'' if ',' in smooth else 's'} a smooth nonlinear law: the "
                f"rates of the states are not a linear function of the states",
                None,
                "use theta=1; the DLCP form needs set-valued laws",
            )
        )
    windings = tight_windings(mna)
    tree = normal_tree(mna, windings)
    stored = [b.device for b in tree.chosen("C", True) if not isinstance(b.device, Capacitor)]
    if stored:
        names = ", ".join(device.name for device in stored)
        message = f"the charges of {names} are those of inner capacitors, not states of their own"
        raise RegularityError(Diagnostic("NS2063", message, None, "use theta=1, or another method"))
    return _network(mna, tree, windings)


def _states(mna: MnaSystem, tree: NormalTree, windings: Sequence[Winding]) -> tuple[State, ...]:
    """Return the states: tree capacitors, then cotree inductors and groups of windings."""
    layout = mna.layout
    states: list[State] = []
    for branch in tree.chosen("C", True):
        device = branch.device
        assert isinstance(device, Capacitor)
        terms = layout.voltage(*device.ends)
        states.append(State(f"v[{device.name}]", terms, device.capacitance(layout)))
    by_pivot = {w.pivot.name: w for w in windings}
    follow = tied(windings)
    for branch in tree.chosen("L", False):
        device = branch.device
        assert isinstance(device, Inductor)
        winding = by_pivot.get(device.name)
        if winding is not None:
            terms = tuple((layout.branches[i.name], f) for i, f in winding.members)
            states.append(State(winding.name, terms, winding.inductance))
        elif device.name not in follow:
            terms = ((branch.number, 1.0),)
            states.append(State(f"i[{device.name}]", terms, device.inductance(layout)))
    return tuple(states)


def _network(mna: MnaSystem, tree: NormalTree, windings: Sequence[Winding]) -> Reference:
    """Return the reference network for a given tree."""
    states = _states(mna, tree, windings)
    s = mna.system
    n, m, k = s.n, s.m, len(states)
    in_tree = np.zeros(m, dtype=bool)
    in_tree[[b.number for b in tree.chosen("P", True)]] = True
    fixed = np.zeros(n, dtype=bool)
    fixed[[b.number for b in tree.redundant]] = True
    fixed[list(tree.roots)] = True

    rows: list[Ints] = []
    cols: list[Ints] = []
    data: list[Floats] = []

    def put(block: Csc, top: int, left: int, keep: Bools, sign: float = 1.0) -> None:
        """Add a block, only the rows to be kept."""
        mask = keep[block.indices]
        rows.append(block.indices[mask] + top)
        cols.append(block.columns[mask] + left)
        data.append(sign * block.data[mask])

    def ones(row: Ints, col: Ints) -> None:
        rows.append(row)
        cols.append(col)
        data.append(np.ones(row.size))

    incidence = _incidence(n, states)
    put(s.G, 0, 0, ~fixed)
    put(s.A, 0, n, ~fixed)
    put(incidence, 0, n + m, ~fixed)
    ones(np.flatnonzero(fixed), np.flatnonzero(fixed))
    put(s.B, n, 0, in_tree)
    put(s.D, n, n, in_tree, -1.0)
    ones(n + np.flatnonzero(~in_tree), n + np.flatnonzero(~in_tree))
    rows.append(incidence.columns + n + m)
    cols.append(incidence.indices)
    data.append(incidence.data)
    order = n + m + k
    matrix = Csc.from_triplets(
        (order, order), np.concatenate(rows), np.concatenate(cols), np.concatenate(data)
    )
    return Reference(mna, tree, states, in_tree, fixed, matrix)


@dataclass(frozen=True, slots=True)
class StorageTerms:
    """What the stores outside the states add to ``E_x x' + E_u u' + E_s s' = rho(x, u, s)``.

    Parameters
    ----------
    E_x, E_u, E_s : ndarray
        Shapes (states, states), (states, m), (states, p).  The diagonal of E_x holds the states'
        own capacitances and inductances; cotree capacitors, tree inductors and couplings add to it
        through the voltages and currents that they share.
    outputs : ndarray, shape (m, states + m + p)
        How the pairs' other quantities depend on x', u' and s': zero without controlled sources.
    """

    E_x: Floats
    E_u: Floats
    E_s: Floats
    outputs: Floats


def storage_terms(network: Reference, z: Floats) -> StorageTerms:
    """Return the storage terms of a reference network.

    Parameters
    ----------
    network : Reference
    z : ndarray, shape (n, states + m + p + 1)
        Solution of the network for its unit inputs.
    """
    s = network.mna.system
    n, m, k = s.n, s.m, len(network.states)
    own = np.array([state.storage for state in network.states])
    incidence = network.incidence().dense()
    rest = s.E.dense() - incidence @ (own[:, None] * incidence.T)
    rest[network.fixed] = 0.0
    right = np.zeros((n + m + k, z.shape[1] - 1))
    right[:n] = -rest @ z[:, :-1]
    dz, dlam, rho = np.split(network.solver()(right), [n, n + m])
    by_x, by_u, by_s = np.split(rho, [k, k + m], axis=1)
    return StorageTerms(np.diag(own) - by_x, -by_u, -by_s, network.outputs(dz, dlam))


def network_inputs(network: Reference) -> Floats:
    """Return the right sides for unit states, unit u, unit sources and the constants, by column."""
    s = network.mna.system
    n, m, k, p = s.n, s.m, len(network.states), len(s.waveforms)
    right = np.zeros((n + m + k, k + m + p + 1))
    right[n + m :, :k] = np.eye(k)
    # a tree pair has B z - D lam = q - u, a cotree pair lam = u
    right[n : n + m, k : k + m] = np.diag(np.where(network.in_tree, -1.0, 1.0))
    sources = s.S.dense()
    sources[network.fixed] = 0.0
    right[:n, k + m : k + m + p] = sources
    right[n : n + m, -1] = np.where(network.in_tree, s.q, 0.0)
    return right
